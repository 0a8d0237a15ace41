"""The order of the pictures in a folder, and how many frames apart they are, by the numbers in
their names.

A name is text and numbers in turn. The text has to be the same in all names; of the numbers, those
that vary count. Where several do, they have to rise together, as a frame's number and its time do,
or be a date and a time of day. What
leaves the order open is refused: a picture in the wrong place is a frame at an instant at which it
was not taken.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import PurePath
from statistics import median

from flagdata.core.findings import Finding
from flagdata.core.numbered import read_bounded
from flagdata.errors import InputError
from flagdata.ingest.camera.name_clocks import Clock, clock_of
from flagdata.timebase import NANOSECONDS

_COUNTS = 2  # common steps of the middle step of numbers that count, some of which are not there
_JITTER = 0.25  # part of the middle step by which a step of times may be off a whole number of it
_PACE = 0.2  # part by which the time that the names state may differ from the one by the rate
_EPOCH = range(1_000_000_000, 2_200_000_000)  # seconds since 1970, of the years 2001 to 2039
_NUMBER = re.compile(r"(\d+)")
_COPY = re.compile(r"\s*\((\d+)\)$")
_MINUS = re.compile(r"(?:^|[ _=(])-$")
_RENAME = (
    "name the pictures of one recording alike, with one number that counts the frames, and keep "
    "others elsewhere"
)
_COUNT = "number the pictures by frames, 1, 2, 3, …; a number that is left out is a missing frame"
_LARGEST = 10**40
"""Largest number of a name that is calculated with: a date, a time of day and a fraction have 23
digits."""
_LAST = 2**53
"""Last place of a picture: its time is a fraction's multiple of it."""


@dataclass(frozen=True, kw_only=True)
class Ordered:
    """Pictures in the order of their recording.

    Attributes:
        order: index of each among the names that were given.
        places: frame that each is, from 0 on.
    """

    order: tuple[int, ...]
    places: tuple[int, ...]
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Column:
    """One number of all names.

    Attributes:
        before: the text before it.
        values: of each name.
        digits: as it is written; of a number with a fraction, the fraction.
        tick: seconds of one unit, of a number that is a time since 1970.
    """

    before: str
    values: tuple[int, ...]
    digits: tuple[str, ...]
    tick: Fraction | None = None

    @property
    def varies(self) -> bool:
        return len(set(self.values)) > 1

    @property
    def distinguishes(self) -> bool:
        return len(set(self.values)) == len(self.values)

    @property
    def padded(self) -> bool:
        """Whether all are written with the same number of digits."""
        return len({len(text) for text in self.digits}) == 1


@dataclass(frozen=True, kw_only=True)
class _Reading:
    """One way to take the pictures' places from their names.

    Attributes:
        steps: of what size the numbers' steps are, where it is not 1.
        clock: whether they are by the times that the names state.
        ranked: whether only their order is stated.
    """

    places: tuple[int, ...]
    steps: str = ""
    clock: bool = False
    ranked: bool = False


def order_pictures(names: Sequence[str], *, rate: Fraction, where: str) -> Ordered:
    """Pictures in the order of the numbers in their names, and the frame that each is.

    A number that is missing is a missing frame. Numbers in steps, and times in about even ones,
    count one frame a step.

    Args:
        rate: frames a second, as the user gives it.

    Raises:
        InputError: the names leave the order open.
    """
    stems = _with_copies([PurePath(name).stem.casefold() for name in names])
    if len(stems) == 1:
        return Ordered(order=(0,), places=(0,))
    if not any(_NUMBER.search(stem) for stem in stems):
        order = tuple(sorted(range(len(stems)), key=lambda i: stems[i]))
        note = Finding.of(
            "order-by-name",
            "the file names have no numbers: the images are taken in the order of their names, "
            "none as missing",
            fix="if it is not the order of the recording, number them in it",
        )
        return Ordered(order=order, places=tuple(range(len(order))), findings=(note,))
    columns = _columns(stems, names, where)
    clock = clock_of(stems)
    if clock is not None:
        taken = _by_clock(clock, columns, names, rate, where)
    else:
        taken = _by_number(_with_fractions(columns), names, rate, where)
    _check_gaps(taken, names, where)
    return taken


def _check_gaps(taken: Ordered, names: Sequence[str], where: str) -> None:
    """Refuse places that no clock counts up to.

    Raises:
        InputError: the last is beyond.
    """
    if taken.places[-1] <= _LAST:
        return
    steps = [b - a for a, b in pairwise(taken.places)]
    wide = next(k for k, step in enumerate(steps) if step > 1)
    raise InputError(
        f"by the numbers in the names {sum(steps) - len(steps)} frames are missing, the first "
        "after "
        f"{names[taken.order[wide]]}: they do not count frames",
        where=where,
        fix=_COUNT,
    )


def _with_copies(stems: list[str]) -> list[str]:
    """Returns the names with the "(1)" of a further picture of one name on all of them, where it is
    on some."""
    copies = [_COPY.search(stem) for stem in stems]
    if all(copies) or not any(copies):
        return stems
    return [
        f"{stem[: match.start()]} ({match[1]})" if match else f"{stem} (0)"
        for stem, match in zip(stems, copies, strict=True)
    ]


def _columns(stems: Sequence[str], names: Sequence[str], where: str) -> list[_Column]:
    """Cuts the numbers of all names into columns.

    Raises:
        InputError: names whose text differs, or a minus that may be a dash.
    """
    split = [_NUMBER.split(stem) for stem in stems]
    texts = [parts[0::2] for parts in split]
    signs = [[1] * (len(parts) // 2) for parts in split]
    for k in range(min(map(len, texts)) - 1):
        variants = {text[k] for text in texts}
        for text, sign in zip(texts, signs, strict=True):
            if text[k].endswith("-") and text[k][:-1] in variants:
                text[k], sign[k] = text[k][:-1], -1
    kinds = Counter(map(tuple, texts))
    if len(kinds) > 1:
        examples = [
            f"{next(n for n, t in zip(names, texts, strict=True) if tuple(t) == kind)} ({count})"
            for kind, count in kinds.most_common(3)
        ]
        raise InputError(
            f"the pictures' names are of {len(kinds)} kinds, such as {', '.join(examples)}: which "
            "of them are one "
            "recording, and in which order, is not known",
            where=where,
            fix=_RENAME,
        )
    columns = []
    for k, before in enumerate(texts[0][:-1]):
        digits = tuple(parts[2 * k + 1] for parts in split)
        values = tuple(
            sign[k] * value
            for sign, value in zip(signs, _values(digits, names, where), strict=True)
        )
        column = _Column(before=before, values=values, digits=digits, tick=_epoch(values))
        unpadded = not any(len(text) > 1 and text[0] == "0" for text in digits)
        dash = (
            (k == 0 or before != "-")
            and _MINUS.search(before) is not None
            and column.varies
            and unpadded
        )
        if dash or (min(values) < 0 and 0 not in values):
            raise InputError(
                f"whether the numbers of {names[0]} and {names[1]} are negative is not known",
                where=where,
                fix=_RENAME,
            )
        columns.append(column)
    return columns


def _values(digits: Sequence[str], names: Sequence[str], where: str) -> list[int]:
    """Numbers of a column; 0 of one that is the same in all names and longer than any count or
    time.

    Raises:
        InputError: they are longer, and vary.
    """
    values = [value for text in digits if (value := read_bounded(text, most=_LARGEST)) is not None]
    if len(values) == len(digits):
        return values
    if len(set(digits)) > 1:
        raise InputError(
            f"the numbers in the names, as of {names[0]} and {names[1]}, are longer than any count "
            "or time",
            where=where,
            fix=_COUNT,
        )
    return [0 for _ in digits]


def _epoch(values: Sequence[int]) -> Fraction | None:
    """Seconds of a unit of times since 1970 in s, ms, µs or ns; None of other numbers."""
    for power in (0, 3, 6, 9):
        if all(value // 10**power in _EPOCH for value in values):
            return Fraction(1, 10**power)
    return None


def _with_fractions(columns: list[_Column]) -> list[_Column]:
    """Joins a number and the fraction behind its point to one column: seconds as 0.04, or since
    1970."""
    for k, (column, part) in enumerate(pairwise(columns)):
        zeros = any(text[0] == "0" for text in part.digits)
        point = part.before == "." and (column.varies or (zeros and not part.padded))
        seconds = column.tick == 1 and column.varies and part.before in ("-", "_", ".")
        if not part.varies or not (point or seconds):
            continue
        width = max(map(len, part.digits))
        padded = [text.ljust(width, "0") for text in part.digits]
        if (
            seconds and part.before != "." and not part.padded
        ):  # nanoseconds, written without their zeros
            width, padded = 9, [text.rjust(9, "0") for text in part.digits]
        values = tuple(
            integer * 10**width + int(text)
            for integer, text in zip(column.values, padded, strict=True)
        )
        tick = Fraction(1, 10**width) if seconds else None
        merged = _Column(before=column.before, values=values, digits=part.digits, tick=tick)
        even = _evenly_counted(sorted(values)) if merged.distinguishes else None
        if seconds or (even is not None and even.places[-1] < 2 * len(values)):
            return [*columns[:k], merged, *columns[k + 2 :]]
    return columns


def _by_number(
    columns: Sequence[_Column], names: Sequence[str], rate: Fraction, where: str
) -> Ordered:
    varying = [column for column in columns if column.varies]
    ordering = [column for column in varying if column.distinguishes]
    if not ordering:
        raise _undecided_error(columns, names, where)
    order = sorted(range(len(names)), key=ordering[0].values.__getitem__)
    _check_rising(varying, order, names, where)
    readings = []
    for column in ordering:
        values = [column.values[i] for i in order]
        reading = _evenly_counted(values)
        instants = (
            None if column.tick is None else [round(v * column.tick * NANOSECONDS) for v in values]
        )
        if reading is None and instants is not None:
            reading = _at_rate(instants, rate)
        if reading is not None:
            readings.append((reading, column, instants))
    if not readings:
        first, second = (names[i] for i in order[:2])
        raise InputError(
            f"the numbers in the names, as of {first} and {second}, rise by steps that are neither "
            "one nor even: they "
            "do not count frames",
            where=where,
            fix=_COUNT,
        )
    reading, column, instants = min(readings, key=lambda candidate: candidate[0].places[-1])
    _check_passed_end(column, reading, names, where)
    return Ordered(
        order=tuple(order),
        places=reading.places,
        findings=tuple(_findings(reading, instants, rate)),
    )


def _by_clock(
    clock: Clock, columns: Sequence[_Column], names: Sequence[str], rate: Fraction, where: str
) -> Ordered:
    later = [column for column in columns[clock.last :] if column.varies]
    other_columns = [column for column in columns[: clock.first] if column.varies]
    keys = [(clock.times[i], clock.counts[i]) for i in range(len(names))]
    if len(set(keys)) == len(keys):
        other_columns += later
        later = []
    elif any(re.search(r"[^\W_]", column.before.replace("burst", "")) for column in later):
        raise _open_order(names, where)
    full = [(*key, *(column.values[i] for column in later)) for i, key in enumerate(keys)]
    if len(set(full)) < len(full):
        raise _undecided_error(columns, names, where)
    if clock.problem is not None:
        raise InputError(clock.problem[0], where=where, fix=clock.problem[1])
    order = sorted(range(len(names)), key=full.__getitem__)
    _check_rising(other_columns, order, names, where)
    instants = [clock.times[i] for i in order]
    distinct = len(set(instants)) == len(instants)
    timed = _evenly_counted(instants, clock=True) if distinct else None
    counted = [
        (reading, column.values[order[0]])
        for column in columns
        if column.distinguishes and _rises(column, order)
        if (reading := _evenly_counted([column.values[i] for i in order])) is not None
    ]
    # Numbers from 0 or 1 on that look like times are counted frames.
    readings = [reading for reading, least in counted if least <= 1] + (
        [timed] if timed is not None else []
    )
    readings += [reading for reading, least in counted if least > 1]
    by_rank = _Reading(places=tuple(range(len(order))), clock=True, ranked=True)
    if readings:
        reading = min(readings, key=lambda candidate: candidate.places[-1])
    else:
        reading = (_at_rate(instants, rate) if distinct else None) or by_rank
    instants_or_none = instants if clock.dated and reading.clock else None
    return Ordered(
        order=tuple(order),
        places=reading.places,
        findings=tuple(_findings(reading, instants_or_none, rate, resolution=clock.resolution)),
    )


def _evenly_counted(values: Sequence[int], *, clock: bool = False) -> _Reading | None:
    """Places of rising numbers that count in a common step, or that rise by about one step as times
    do; else None."""
    steps = [b - a for a, b in pairwise(values)]
    common, middle = math.gcd(*steps), median(steps)
    if min(steps) == common or middle <= _COUNTS * common:
        places = tuple((value - values[0]) // common for value in values)
        return _Reading(places=places, steps=str(common) if common > 1 else "", clock=clock)
    counts = [round(step / middle) for step in steps]
    slack = max(common, _JITTER * middle)
    if any(abs(step - number * middle) > slack for step, number in zip(steps, counts, strict=True)):
        return None
    single = [step for step, number in zip(steps, counts, strict=True) if number == 1]
    if not single or min(counts) < 1:
        return None
    steps_of = f"about {middle:g} ({min(single)} to {max(single)})"
    return _Reading(places=tuple(accumulate(counts, initial=0)), steps=steps_of, clock=clock)


def _at_rate(instants: Sequence[int], rate: Fraction) -> _Reading | None:
    """Frames of the rate that are nearest to instants [ns]; None where two of these are of one
    frame."""
    places = tuple(round((instant - instants[0]) * rate / NANOSECONDS) for instant in instants)
    return _Reading(places=places, clock=True) if len(set(places)) == len(places) else None


def _rises(column: _Column, order: Sequence[int]) -> bool:
    return all(column.values[a] <= column.values[b] for a, b in pairwise(order))


def _check_rising(
    columns: Sequence[_Column], order: Sequence[int], names: Sequence[str], where: str
) -> None:
    if not all(_rises(column, order) for column in columns):
        raise _open_order(names, where)


def _check_passed_end(column: _Column, reading: _Reading, names: Sequence[str], where: str) -> None:
    """Refuse a count that may have gone on at 0001 after 9999: most numbers are missing between
    these."""
    width = len(column.digits[0])
    ends = column.padded and max(column.values) == 10**width - 1 and min(column.values) <= 1
    if ends and reading.places[-1] > 2 * len(names):
        raise InputError(
            f"the numbers in the names are the first and the last of {width} digits and few "
            "between: whether the "
            "camera went on counting from the first is not known",
            where=where,
            fix="name those that came later with a larger number",
        )


def _open_order(names: Sequence[str], where: str) -> InputError:
    return InputError(
        f"several numbers vary in the names, as in {names[0]} and {names[-1]}, and do not rise "
        "together: which of them "
        "counts the frames is not known",
        where=where,
        fix=_RENAME,
    )


def _undecided_error(columns: Sequence[_Column], names: Sequence[str], where: str) -> InputError:
    """Returns the error of pictures that no number distinguishes: all numbers of two are alike, or
    several numbers vary."""
    first: dict[tuple[int, ...], str] = {}
    for key, name in zip(
        zip(*(column.values for column in columns), strict=True), names, strict=True
    ):
        if key in first:
            message = (
                f"{first[key]} and {name} have the same number: which of them is the frame is not "
                "known"
            )
            return InputError(
                message, where=where, fix="keep one of them, or give each a number of its own"
            )
        first[key] = name
    return _open_order(names, where)


def _findings(
    reading: _Reading, instants: Sequence[int] | None, rate: Fraction, *, resolution: int = 1
) -> Iterator[Finding]:
    """Reports what is odd of a reading.

    Args:
        instants: that the names state [ns], to `resolution`; None where they state none.
    """
    if reading.ranked:
        yield Finding.of(
            "order-by-time",
            "the names state times that say the order of the pictures and not how far apart they "
            "are: they are "
            "taken as evenly spaced, none as missing",
        )
    elif reading.steps:
        unit = " ns" if reading.clock else ""
        yield Finding.of(
            "numbered-by-steps",
            f"the file names count in steps of {reading.steps}{unit}; one step is taken as one "
            "frame",
            value=float(reading.steps) if reading.steps.isdigit() else None,
        )
    if instants is None:
        return
    stated_span, taken = instants[-1] - instants[0], reading.places[-1] / rate * NANOSECONDS
    if stated_span > 0 and abs(stated_span - taken) > _PACE * max(stated_span, taken) + resolution:
        yield Finding.of(
            "rate-unlike-names",
            f"by the times in their names the pictures span {stated_span / NANOSECONDS:.6g} s, at "
            "the rate that was "
            f"given {float(taken) / NANOSECONDS:.6g} s",
            value=stated_span / NANOSECONDS,
            fix="if the times are right, the rate is "
            f"{reading.places[-1] / stated_span * NANOSECONDS:.4g} Hz",
        )
