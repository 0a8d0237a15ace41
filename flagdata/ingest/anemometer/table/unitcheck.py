"""Which unit the numbers of a wind speed speak for, and whether they contradict the one that is stated.

Two kinds of evidence:

- *Resolution.* A logger that measures in whole mph (or tenths of m/s, knots …) and writes another unit writes multiples
  of the converted step: 1.6, 3.2, 4.8 km/h. That n distinct values all lie on such a grid of step g by chance, within a
  tolerance t, has the probability (2 t / g)^n; below `CHANCE` it is evidence of the unit they are written in.
- *Range.* The windiest station known, Cape Denison, has an annual mean of 19.4 m/s (Mawson 1915): a log of a day or
  more whose median is above `WINDY` is more likely in another unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.units import unit

CHANCE = 1e-4
"""Probability by chance below which a grid is evidence."""
WINDY = 12.0
"""Median of a day or more [m/s] above which a unit is doubted."""
STORMY = 30.0
"""Median [m/s] above which a unit that is guessed is none either."""
FASTEST = 60.0
"""Speed [m/s] above which a value, other than a gust, is doubted; hurricanes of category 4 begin at 58 m/s."""
IMPOSSIBLE = 75.0
"""Median [m/s] that no wind has, by which a unit is doubted of however few rows."""
_FASTEST_OF_ALL = 120.0
"""Number that few speeds of a log reach in any unit."""
DAY = 86_400.0
_STEPS: tuple[tuple[str, tuple[float, ...]], ...] = (
    ("mph", (1.0, 0.5, 0.1)), ("kn", (1.0, 0.5, 0.1)), ("km/h", (1.0, 0.1)), ("m/s", (1.0, 0.5, 0.1)),
)  # fmt: skip
_SHOWN = ("m/s", "km/h", "mph", "kn")
_FACTOR = 6e-4
"""Relative error of the factors that loggers convert with (0.447, 0.514, 1.609)."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What the values say: the unit they are likely in, and why."""

    unit: str
    reason: str


def from_resolution(values: NDArray[np.float64]) -> Evidence | None:
    """The unit that values are written in, where they are multiples of a converted step; `None` where they are not.

    Args:
        values: (n,) as written, NaN where missing.
    """
    known = np.unique(values[np.isfinite(values) & (values > 0)])
    if len(known) < 4:
        return None
    rounding = _rounding(known)
    best: tuple[float, Evidence] | None = None
    for native, steps in _STEPS:
        for shown in _SHOWN:
            if shown == native:
                continue
            for step in steps:
                grid = step * unit(native).scale / unit(shown).scale
                tolerance = rounding / 2 * 1.02 + _FACTOR * known
                usable = tolerance < grid / 5
                if usable.sum() < 4:
                    continue
                off = np.abs(known - np.round(known / grid) * grid)
                if float((off[usable] <= tolerance[usable]).mean()) < 0.98:
                    continue
                chance = float(np.log10(2 * tolerance[usable] / grid).sum())
                # Rounded to whole steps of the tolerance, a value is on the grid with at least rounding / grid.
                if chance > np.log10(CHANCE) or (best is not None and chance >= best[0]):
                    continue
                listed = ", ".join(f"{value:g}" for value in known[:4])
                reason = f"the values ({listed} …) are multiples of {step:g} {native} written in {shown}"
                best = chance, Evidence(unit=shown, reason=reason)
    return best[1] if best is not None else None


def _whole(values: NDArray[np.float64], stated: str) -> bool:
    """Whether values are whole numbers of another unit written in the stated one, by a factor rounded before."""
    known = np.unique(values[np.isfinite(values) & (values > 0)])
    rounding = _rounding(known)
    for native in ("mph", "kn", "km/h", "m/s"):
        grid = unit(native).scale / unit(stated).scale
        if native == stated or grid < 5 * rounding:
            continue
        whole = np.round(known / grid)
        # n times the factor that was rounded first, as 0.9 for 2 mph where 1 mph is 0.45 m/s
        off = np.minimum(np.abs(known - whole * grid), np.abs(known - whole * np.round(grid / rounding) * rounding))
        chance = len(known) * float(np.log10(2 * rounding / grid))
        if bool(np.all(off <= rounding * 0.51 + _FACTOR * known)) and chance < np.log10(CHANCE):
            return True
    return False


def _rounding(known: NDArray[np.float64]) -> float:
    """The last digit that is used."""
    for digits in range(6):
        scaled = known * 10**digits
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-4):
            return 10.0**-digits
    return 1e-6


def contradiction(
    values: NDArray[np.float64], stated: str, *, span: float, channel: str = "wind_speed"
) -> Finding | None:
    """The finding about a stated unit that the values speak against; `None` where they do not.

    Args:
        values: (n,) as written, NaN where missing.
        stated: the unit, as `flagdata.units` spells it.
        span: length of the log [s].
    """
    scale = unit(stated).scale
    found = from_resolution(values)
    if found is not None and abs(unit(found.unit).scale / scale - 1) > 1e-9 and not _whole(values, stated):
        return _finding(channel, stated, found)
    known = np.abs(values[np.isfinite(values)]) * scale
    if not len(known) or scale < unit("km/h").scale or (len(known) < 10 and float(np.median(known)) < IMPOSSIBLE):
        return None
    median, high = float(np.median(known)), float(np.quantile(known, 0.99))
    tenths = scale == 1.0 and bool(np.all(known % 1 == 0)) and median > WINDY
    if not (high > FASTEST or tenths or (median > WINDY and span >= DAY)):
        return None
    # Of the units that are smaller, the first in which the wind is an ordinary one.
    others = [name for name in ("km/h", "mph", "kn") if unit(name).scale < 0.9 * scale]
    others += ["km/day"] if high > FASTEST and span >= 0.9 * DAY * (len(known) - 1) else []
    if not others and median <= STORMY:
        return None
    ordinary = next((name for name in others if median * unit(name).scale / scale <= STORMY), None)
    reason = _too_fast(median / scale, high / scale, stated) + _or_angles(known / scale)
    if ordinary is None:
        return Finding(
            kind="unit-doubtful", severity=Severity.WARNING,
            what=f"{channel} is stated in {stated}, and no unit makes an ordinary wind of its numbers: {reason}",
            fix="check that the column is the speed of the wind, and its unit",
        )  # fmt: skip
    other = ordinary
    if tenths:
        smaller = "0.1 m/s" if median < 10 * FASTEST / 3 else "0.01 m/s"
        reason += f"; whole numbers may also be in {smaller} (--unit '{smaller}')"
    return _finding(channel, stated, Evidence(unit=other, reason=reason))


def _too_fast(median: float, high: float, name: str) -> str:
    return f"half of the values are above {median:.3g}, one in a hundred above {high:.3g}: in {name} an extreme wind"


def _or_angles(values: NDArray[np.float64]) -> str:
    """What is said of numbers beyond every wind that may be directions."""
    low, high = float(values.min()), float(values.max())
    return "; all are between 0 and 360, as directions are" if low >= 0 and _FASTEST_OF_ALL < high <= 360 else ""


def _finding(channel: str, stated: str, found: Evidence) -> Finding:
    return Finding(
        kind="unit-doubtful", severity=Severity.WARNING,
        what=f"{channel} is stated in {stated}, but looks like {found.unit}: {found.reason}",
        fix=f"check the instrument's setting; if it is {found.unit}, say so: --unit {found.unit}, or the recipe's unit",
    )  # fmt: skip
