"""Numbers of a log that are impossible or doubtful: of a draft each opens a question that only the
user answers.

A doubt is answered for good by its key in a recipe: `[expect] confirmed = ["fast", …]`. Of a log
that an exact format or a recipe reads, those that speak against the column or its unit are
reported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from flagdata.core.findings import Finding
from flagdata.core.units import UNITS, unit
from flagdata.ingest.anemometer.instants.stamp_text import DAY
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.sensor_recipe import Recipe
from flagdata.record.signals import Series
from flagdata.timebase import NANOSECONDS, iso

_FASTEST = 75.0
"""m/s; above the strongest gusts of any storm but tornadoes and the record of Barrow Island (113
m/s)."""
_STRONG = 30.0
"""m/s; a median above it is a storm that lasts."""
_FEW, _RARE = 0.05, 0.01
_SLOW = 60 * NANOSECONDS
_BEFORE = 631_152_000 * NANOSECONDS
"""1990-01-01T00:00:00Z."""
_TENS = 36.0
_CALM = 0.2
_FAR = 0.1
"""Share of a log by which its time goes back no clock that was set goes."""
_NORTH = 30.0
_WINDY = 12.0
"""m/s; Cape Denison, the windiest station known, has an annual mean of 19.4 m/s (Mawson 1915)."""
_CODE, _MOST = 2.0, 1e5
"""Times all others that a code for no value is, and a number that is a code in any unit."""
_CHANGES, _RISES, _ANEW = 20, 0.7, 6.0
"""Changes from which on a count is recognised, share of them that rise, and median rises at which
it begins anew."""
_CHANCE, _DISTINCT = -4.0, 4
"""Logarithm of the probability by chance below which a grid is evidence, and distinct values that
can be."""
_GRIDS = {"mph": (1.0, 0.5, 0.1), "kn": (1.0, 0.5, 0.1), "km/h": (1.0, 0.1), "m/s": (1.0, 0.5, 0.1)}
"""Steps in which instruments measure, and the units that are written."""
_FACTOR = 6e-4
"""Relative error of the factors that loggers convert with (0.447, 0.514, 1.609)."""


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """What speaks against a drafted reading.

    Attributes:
        key: of the recipe's [expect].
        text: what is odd, with numbers.
        question: to be answered.
    """

    key: str
    text: str
    question: str


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """A reading as it is examined: speed and direction as they are written, without missing
    values."""

    reading: Reading
    speed: Series
    direction: Series
    pairs: tuple[Series, Series]
    unit: str
    assumed: bool
    left_out: int
    now: int


def doubts(
    reading: Reading, recipe: Recipe, *, assumed: frozenset[str], left_out: int, now: int
) -> tuple[Doubt, ...]:
    """Lists everything that is odd of a drafted reading, but for what the recipe expects.

    Args:
        reading: in the order of the file, before it was judged.
        assumed: channels whose unit is assumed.
        left_out: lines that could not be read.
        now: UTC nanoseconds.
    """
    written = {name: _written(reading, recipe, name) for name in ("wind_speed", "wind_direction")}
    sight = _sight(
        reading,
        written,
        _unit(recipe, "wind_speed"),
        "wind_direction" in assumed,
        left_out=left_out,
        now=now,
    )
    texts = (
        (key, check(sight), question)
        for key, (check, question) in CHECKS.items()
        if key not in recipe.expect
    )
    of_values = tuple(
        Doubt(key=key, text=text, question=question) for key, text, question in texts if text
    )
    of_reader = (
        Doubt(key=finding.kind, text=finding.what, question="Is that right?")
        for finding in reading.findings
        if finding.kind in REPORTED and finding.kind not in recipe.expect
    )
    return (*of_values, *of_reader)


def report_doubts(reading: Reading, answered: frozenset[str]) -> tuple[Finding, ...]:
    """Reports what speaks against the column or the unit of the wind that an exact format or a
    recipe has read.

    Args:
        answered: keys of doubts whose numbers are right, as the recipe says.
    """
    speed = next(
        (
            channel
            for channel in ("wind_speed", "apparent_wind_speed")
            if channel in reading.channels
        ),
        None,
    )
    if speed is None or not len(reading.time):
        return ()
    written = {
        "wind_speed": reading.channels[speed],
        "wind_direction": np.full(len(reading.time), np.nan),
    }
    sight = _sight(reading, written, "m/s", assumed=False, left_out=0, now=0)
    return tuple(
        Finding.of("doubtful-numbers", f"{speed}: {text}", fix=CHECKS[key][1])
        for key in _OF_THE_COLUMN
        if key not in answered and (text := CHECKS[key][0](sight))
    )


def _sight(
    reading: Reading,
    written: Mapping[str, Series],
    unit_name: str,
    assumed: bool,
    *,
    left_out: int,
    now: int,
) -> _Seen:
    speed, direction = written["wind_speed"], written["wind_direction"]
    finite = np.isfinite(speed) & np.isfinite(direction)
    return _Seen(
        reading=reading,
        speed=speed[np.isfinite(speed)],
        direction=direction[np.isfinite(direction)],
        pairs=(speed[finite], direction[finite]),
        unit=unit_name,
        assumed=assumed,
        left_out=left_out,
        now=now,
    )


def _unit(recipe: Recipe, name: str) -> str:
    return recipe.channels[name].unit if name in recipe.channels else "m/s"


def _written(reading: Reading, recipe: Recipe, name: str) -> Series:
    """Returns a channel in the file's unit; angles in degrees where they are points of the
    compass."""
    values = reading.channels.get(name)
    if values is None:
        return np.full(len(reading.time), np.nan)
    spelled = _unit(recipe, name)
    return unit(spelled).from_si(values) if spelled in UNITS else np.rad2deg(values)


def _si(sight: _Seen) -> Series:
    return unit(sight.unit).to_si(sight.speed)


def _fast(sight: _Seen) -> str:
    over = _si(sight) > _FASTEST
    return (
        f"{int(over.sum())} speeds are above {_FASTEST:g} m/s, the highest {_si(sight).max():.4g}"
        if over.any()
        else ""
    )


def _strong(sight: _Seen) -> str:
    median = float(np.median(_si(sight))) if len(sight.speed) else 0.0
    days = int(np.ptp(sight.reading.time)) / DAY
    if median > _WINDY and days >= 1:
        return (
            f"the median speed of {days:.3g} days is {median:.3g} m/s, more than of the windiest "
            "stations"
        )
    return f"the median speed is {median:.3g} m/s" if median > _STRONG else ""


def _code(sight: _Seen) -> str:
    """Finds a number that loggers write for no value: one that recurs, far above all others or
    below all directions."""
    sentences: list[str] = []
    high, counts = np.unique(sight.speed, return_counts=True)
    if len(high) > 1 and counts[-1] > 1 and (high[-1] > _CODE * high[-2] or high[-1] > _MOST):
        sentences.append(
            f"{high[-1]:g} {sight.unit} occurs {counts[-1]} times, and all other speeds are up to "
            f"{high[-2]:g}"
        )
    low, counts = np.unique(sight.direction[sight.direction < 0], return_counts=True)
    if len(low) == 1 and counts[0] > 1 and sight.direction.max() > 180:
        sentences.append(
            f"the direction {low[0]:g} occurs {counts[0]} times, and no other is below 0"
        )
    return "; ".join(sentences)


def _grows(sight: _Seen) -> str:
    """Checks whether most changes are rises, and what falls begins anew near the size of one: a
    count, a distance, a sum.

    A speed falls about as often as it rises: that m changes in a row are rises has a probability of
    about 2⁻ᵐ.
    """
    steps = np.diff(sight.speed)
    rises, falls = steps[steps > 0], np.flatnonzero(steps < 0)
    if len(rises) < _RISES * max(_CHANGES, len(rises) + len(falls)) or bool(
        (sight.speed < 0).any()
    ):
        return ""
    usual = float(np.median(rises))
    anew = len(falls) == 0 or float((sight.speed[falls + 1] <= _ANEW * usual).mean()) >= 0.9
    high = (
        (sight.speed[falls] > _ANEW * usual).any()
        if len(falls)
        else sight.speed.max() > 2 * _CHANGES * usual
    )
    if not (anew and high):
        return ""
    return f"the speed rises in {len(rises)} of {len(rises) + len(falls)} changes, as a sum does"


def _steps(sight: _Seen) -> str:
    """Checks whether the speeds are multiples of a step of one unit written in another unit than
    the stated one.

    That n distinct values all are multiples of a step g by chance, within t, has the probability (4
    t / g)ⁿ: 2 t for the product as it is, and as much for one whose factor was rounded first.
    """
    speeds = np.unique(sight.speed[sight.speed > 0])
    if len(speeds) < _DISTINCT:
        return ""
    rounding = _rounding(speeds)
    grids: list[tuple[float, str, str]] = []
    for native, steps in _GRIDS.items():
        for written in {*_GRIDS, sight.unit} - {native}:
            for step in steps:
                chance = _on(speeds, step * unit(native).scale / unit(written).scale, rounding)
                grids.append(
                    (
                        chance,
                        written,
                        f"the speeds are multiples of {step:g} {native} written in {written}",
                    )
                )
    chance, written, text = min(grids)
    chance_as_stated = min(chance for chance, written, _ in grids if written == sight.unit)
    return (
        f"{text}, and {sight.unit} is stated"
        if chance < _CHANCE and written != sight.unit and chance_as_stated > _CHANCE
        else ""
    )


def _rounding(speeds: Series) -> float:
    """Finds the last digit that is used."""
    digits = (
        digit
        for digit in range(6)
        if np.all(np.abs(speeds * 10**digit - np.round(speeds * 10**digit)) < 1e-4)
    )
    return 10.0 ** -next(digits, 6)


def _on(speeds: Series, grid: float, rounding: float) -> float:
    """Computes the logarithm of the probability that distinct values are multiples of `grid` by
    chance; 0 where they are not.

    A logger may round the factor first, as 0.45 m/s for a mile an hour, and write 0.9 for two.
    """
    tolerance = rounding / 2 * 1.02 + _FACTOR * speeds
    usable = tolerance < grid / 8
    steps = np.round(speeds / grid)
    off = np.minimum(
        np.abs(speeds - steps * grid), np.abs(speeds - steps * np.round(grid / rounding) * rounding)
    )
    if usable.sum() < _DISTINCT or float((off[usable] <= tolerance[usable]).mean()) < 0.98:
        return 0.0
    return float(np.log10(4 * tolerance[usable] / grid).sum())


def _negative(sight: _Seen) -> str:
    below = sight.speed[sight.speed < 0]
    values, counts = np.unique(below, return_counts=True)
    if len(counts) and counts.max() > 1:
        return (
            f"{values[counts.argmax()]:g} {sight.unit} occurs {counts.max()} times and is no speed"
        )
    share = len(below) / max(1, len(sight.speed))
    return (
        f"{share:.0%} of the speeds are below 0, the lowest {below.min():g} {sight.unit}"
        if share > _FEW
        else ""
    )


def _still(sight: _Seen) -> str:
    return "every speed is 0" if len(sight.speed) and not sight.speed.any() else ""


def _constant(sight: _Seen) -> str:
    same = (
        len(sight.speed) > 10
        and sight.speed[0] != 0
        and bool((sight.speed == sight.speed[0]).all())
    )
    return f"every speed is {sight.speed[0]:g} {sight.unit}" if same else ""


def _angles(sight: _Seen) -> str:
    off = np.abs(sight.speed - np.round(sight.speed))
    whole_numbers = (
        len(sight.speed) > 10 and bool((off < 1e-6).all()) and bool((sight.speed >= 0).all())
    )
    spread = (
        whole_numbers
        and sight.speed.max() <= 360
        and sight.speed.max() > 180
        and len(np.unique(sight.speed)) > 10
    )
    return (
        f"the speeds are whole numbers from {sight.speed.min():g} to {sight.speed.max():g}"
        if spread
        else ""
    )


def _tens(sight: _Seen) -> str:
    directions = sight.direction
    small = (
        sight.assumed
        and len(directions) > 1
        and bool((directions % 1 == 0).all())
        and directions.min() >= 0
        and directions.max() <= _TENS
    )
    return (
        f"the directions are whole numbers up to {directions.max():g}, and no unit is stated"
        if small
        else ""
    )


def _fixed_sentence(sight: _Seen) -> str:
    speed, direction = sight.pairs
    same = (
        len(direction) > 10
        and bool((direction == direction[0]).all())
        and len(np.unique(speed)) > 3
    )
    return f"the direction is {direction[0]:g} in every row, while the speed varies" if same else ""


def _calm(sight: _Seen) -> str:
    speed, direction = sight.pairs
    zero = direction == 0
    si = unit(sight.unit).to_si(speed)
    if zero.sum() < 2 or zero.all():
        return ""
    rows = f"the direction is 0 in {int(zero.sum())} rows"
    if bool((si[zero] <= _CALM).all()) and bool((si[~zero] > _CALM).any()):
        return f"{rows}, all of them at speeds up to {_CALM:g} m/s"
    northerly = (np.minimum(direction % 360, -direction % 360) < _NORTH) & ~zero
    if (
        bool((np.abs(direction - np.round(direction, -1)) < 1e-6).all())
        and (~zero).sum() > 10
        and direction.max() > 180
    ):
        return f"{rows}, and all others are whole tens of degrees, none of them 360"
    return "" if northerly.any() else f"{rows}, and no other is within {_NORTH:g}° of north"


def _order(sight: _Seen) -> str:
    steps = np.diff(sight.reading.time)
    back = steps <= 0
    share = float(back.mean()) if len(back) else 0.0
    span = int(np.ptp(sight.reading.time))
    far_back = len(back) and -int(steps.min()) > max(_SLOW, _FAR * span)
    if far_back:
        by = f"{-int(steps.min()) / NANOSECONDS:g} s"
        return (
            f"the time goes back by {by}, as after a clock was set back, or where devices follow "
            "one another"
        )
    return f"the time does not increase in {share:.0%} of the rows" if share > _RARE else ""


def _future(sight: _Seen) -> str:
    last = int(sight.reading.time.max())
    return f"the last row is of {iso(last)}, which is to come" if last > sight.now + DAY else ""


def _old(sight: _Seen) -> str:
    first = int(sight.reading.time.min())
    return f"the first row is of {iso(first)[:10]}" if first < _BEFORE else ""


def _coarse(sight: _Seen) -> str:
    steps = np.diff(np.sort(sight.reading.time))
    step = float(np.median(steps)) / NANOSECONDS if len(steps) else 0.0
    return f"rows are {step:g} s apart" if step * NANOSECONDS > _SLOW else ""


def _lines(sight: _Seen) -> str:
    share = sight.left_out / max(1, sight.left_out + len(sight.reading.time))
    return f"{sight.left_out} lines ({share:.0%}) were left out" if share > _RARE else ""


CHECKS: Mapping[str, tuple[Callable[[_Seen], str], str]] = {
    "fast": (_fast, "Is the unit right?"),
    "strong": (_strong, "Is the unit right?"),
    "negative": (_negative, "Do negative speeds occur, as of a calibration's zero?"),
    "still": (_still, "Did the wind rest all the time?"),
    "constant": (_constant, "Did the wind never change?"),
    "code": (_code, "Is this a measured value?"),
    "steps": (_steps, "Is the unit right?"),
    "grows": (_grows, "Is this a speed, and no distance, count or sum?"),
    "angles": (_angles, "Are these speeds, and no directions?"),
    "tens": (_tens, "Are these degrees, and no tens of degrees or sectors?"),
    "fixed": (_fixed_sentence, "Did the vane never turn?"),
    "calm": (_calm, "Is 0 the north, and not calm air or a variable wind?"),
    "order": (
        _order,
        "Are all rows of one device, in their order? (--clock corrects a clock that was set)",
    ),
    "future": (_future, "Is the clock right?"),
    "old": (_old, "Is the clock right?"),
    "coarse": (_coarse, "Are these readings or means that long apart?"),
    "lines": (_lines, "May these lines be left out?"),
}
"""Key of [expect] → the check, and what is asked; "yes" confirms the reading as it is."""
_OF_THE_COLUMN = ("strong", "code", "steps", "grows", "angles")
REPORTED = frozenset({"out-of-range", "below-threshold", "calm-in-words", "zero-beside-360"})
"""Kinds of findings of the reader that are doubts of a draft, each by its kind."""
KEYS = frozenset({*CHECKS, *REPORTED, "components", "gust", "order"})
"""All that [expect] and --expect can hold; "components" and "gust" are doubts of the draft itself
(see `beside`)."""
