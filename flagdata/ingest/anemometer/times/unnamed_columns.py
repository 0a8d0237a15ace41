"""Times in several columns that no line names, told by their numbers alone.

2026 5 1 12 30        year, month, day, hour and minute; or the hour and minute in one number, 1230
2026 121 1230         year, day of the year and a clock of one number
2026 5 1              year, month and day, in a log of a row a day
20260501 1230         a date of eight digits and a clock of one number, perhaps twice: in UTC and local
20260501 13           a date of eight digits and an hour, in a log of a row an hour
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.instants.midnight import parse_with_bare_dates
from flagdata.ingest.anemometer.instants.stamps import DAY, Stamps
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import (
    DIGITS,
    SHARE,
    TWO_DIGITS,
    YEAR,
    TimeChoice,
    fits,
    hours_and_minutes,
    share,
    time_choice,
    whole_numbers,
)
from flagdata.timebase import NANOSECONDS

_UNNAMED = (("%m", 1, 12), ("%d", 1, 31), ("%H", 0, 24), ("%M", 0, 59))
_SECONDS_OF_MINUTE = re.compile(r"^\s*\d{1,2}(\.\d*)?\s*$")
_EIGHT = re.compile(r"^\s*(19|20)\d\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])\s*$")
_HOURS = 10
"""Rows that are an hour apart, by which the number of the hour is told from a count of rows."""
_DAYS = 10
"""Rows that are a day apart, by which month and day are told from other small numbers."""
_QUARTER, _FARTHEST = 900, 14 * 3600
"""Offsets of zones are multiples of this, and at most so large [s]."""


def choice(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """The time of a table whose columns no line names; `None` where their numbers tell none.

    Args:
        columns: the cells of each, with decimal points.
    """
    if any(layout.names):
        return None
    kinds = (_parts, _dates, _ordinal, _compact, _dated_hours)
    return next((found for kind in kinds if (found := kind(layout, columns)) is not None), None)


def _compact(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """A date of eight digits and a clock of hours and minutes beside it; of two such pairs the first."""
    found: list[tuple[int, Stamps]] = []
    for index, (dates, clock) in enumerate(itertools.pairwise(columns)):
        if not share(_EIGHT, dates) or not _clock(clock):
            continue
        texts = [" ".join(row) for row in zip(dates, clock, strict=True)]
        stamps, _ = parse_with_bare_dates(texts, "%Y%m%d %H%M")
        if fits(stamps) and _rises(stamps):
            found.append((index, stamps))
    if not found:
        return None
    index, stamps = found[0]
    time = time_choice(layout, (index, index + 1), "%Y%m%d %H%M", stamps, 2.2)
    return replace(time, unnamed=True, zone_advice=_other_zone(found))


def _dated_hours(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """A date of eight digits and the number of the hour beside it, in a log of a row an hour."""
    for index, (dates, hours) in enumerate(itertools.pairwise(columns)):
        if not share(_EIGHT, dates) or not whole_numbers(hours, 0, 24) or not _hourly((dates, hours), "%Y%m%d %H"):
            continue
        found, _ = parse_with_bare_dates([" ".join(row) for row in zip(dates, hours, strict=True)], "%Y%m%d %H")
        return replace(time_choice(layout, (index, index + 1), "%Y%m%d %H", found, 2.2), unnamed=True)
    return None


def _other_zone(found: Sequence[tuple[int, Stamps]]) -> str:
    """What a second pair of a date and a clock tells of the zone of the first."""
    if len(found) != 2 or not bool((found[0][1].valid & found[1][1].valid).all()):
        return ""
    (first, stamps), (second, others) = found
    offsets = set(((others.ns - stamps.ns) // NANOSECONDS).tolist())
    offset = offsets.pop() if len(offsets) == 1 else 0
    if offset == 0 or offset % _QUARTER or abs(offset) > _FARTHEST:
        return ""
    hours = f"{abs(offset) / 3600:g} h {'later' if offset > 0 else 'earlier'}"
    zone = f"{'-' if offset > 0 else '+'}{abs(offset) // 3600:02d}:{abs(offset) % 3600 // 60:02d}"
    return (
        f"columns {second + 1} and {second + 2} hold the times of columns {first + 1} and {first + 2} {hours}, as local"
        f" time beside UTC: --zone UTC if columns {first + 1} and {first + 2} are UTC, --zone {zone} if the others are"
    )


def _clock(cells: Sequence[str]) -> bool:
    """Whether cells are hours and minutes in one number; below an hour only where all are written in four digits."""
    padded = all(len(cell) == 4 and cell.isdigit() for cell in cells)
    return hours_and_minutes(cells) and (padded or any(int(cell) > 100 for cell in cells if cell.isdigit()))


def _rises(found: Stamps) -> bool:
    """Whether stamps never fall, and rise somewhere."""
    steps = np.diff(found.ns[found.valid])
    return len(steps) > 0 and bool(np.all(steps >= 0)) and bool(np.any(steps > 0))


def _parts(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """Year, month, day, hour, minute and second side by side where no line names the columns.

    Whole numbers that are a year, a month, a day, an hour and a minute and rise from row to row are nothing else; what
    follows is a second only where it is written or moves as one, since a speed looks much the same.
    """
    for index, cells in enumerate(columns):
        if not share(YEAR, cells):
            continue
        taken, form = [index], "%Y"
        for (directive, low, high), at in zip(_UNNAMED, range(index + 1, len(columns)), strict=False):
            if not share(TWO_DIGITS, columns[at]) or not whole_numbers(columns[at], low, high):
                break
            if directive == "%M" and _shorter(columns[at], [columns[before] for before in taken]):
                break
            if directive == "%M" and _places(columns[at], [columns[before] for before in taken]):
                break
            taken, form = [*taken, at], f"{form} {directive}"
        beyond = taken[-1] + 1
        if form == "%Y %m %d" and beyond < len(columns) and _clock(columns[beyond]):
            taken, form = [*taken, beyond], f"{form} %H%M"
        if "%H" not in form or ("%M" not in form and not _hourly([columns[at] for at in taken])):
            continue
        after = taken[-1] + 1
        if "%H %M" in form and after < len(columns) - 1 and _seconds(columns[after], [columns[at] for at in taken]):
            taken, form = [*taken, after], f"{form} %S%f"
        texts = [" ".join(row) for row in zip(*(columns[i] for i in taken), strict=True)]
        found, _ = parse_with_bare_dates(texts, form)
        if fits(found) and bool(np.all(np.diff(found.ns[found.valid]) >= 0)):
            return replace(time_choice(layout, tuple(taken), form, found, 2.2), unnamed=True)
    return None


def _dates(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """Year, month and day side by side, in a log of a row a day; as day of the year and clock they would not be one."""
    for index in range(len(columns) - 2):
        parts = columns[index : index + 3]
        if not share(YEAR, parts[0]) or not all(share(TWO_DIGITS, cells) for cells in parts[1:]):
            continue
        if not whole_numbers(parts[1], 1, 12) or not whole_numbers(parts[2], 1, 31):
            continue
        found, _ = parse_with_bare_dates([" ".join(row) for row in zip(*parts, strict=True)], "%Y %m %d")
        steps = np.diff(found.ns)
        daily = steps[steps != 0]  # rows of several stations share their days
        if (
            len(daily) >= _DAYS
            and bool(found.valid.all())
            and float((daily == DAY).mean()) >= SHARE
            and daily.min() > 0
        ):
            return replace(time_choice(layout, (index, index + 1, index + 2), "%Y %m %d", found, 2.2), unnamed=True)
    return None


def _places(cells: Sequence[str], before: Sequence[Sequence[str]]) -> bool:
    """Whether numbers run from 1 to the same few in every hour that is there: stations are counted so, no minutes."""
    hours: dict[tuple[str, ...], list[str]] = {}
    for *hour, cell in zip(*before, cells, strict=True):
        hours.setdefault(tuple(hour), []).append(cell.strip().lstrip("0"))
    whole = list(hours.values())[:-1]  # the last may be cut off
    counted = [str(number) for number in range(1, len(whole[0]) + 1)] if whole else []
    return len(whole) >= _HOURS // 2 and len(counted) > 1 and all(own == counted for own in whole)


def _ordinal(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """Year, day of the year and a clock of one number side by side, as arrays of Campbell's older loggers have them.

    They are told by their numbers alone: the clock has no minutes above 59, and the rows rise. Month and day may stand
    between, as they do in the tables of Antarctic stations.
    """
    for index in range(len(columns) - 2):
        year, day = columns[index : index + 2]
        if not share(YEAR, year) or not whole_numbers(day, 1, 366):
            continue
        at = index + 4 if _again(columns[index : index + 4]) and index + 4 < len(columns) else index + 2
        clock = columns[at]
        if not share(DIGITS, clock):
            continue
        if not whole_numbers(clock, 0, 2400) or any(int(cell) % 100 > 59 for cell in clock if cell.isdigit()):
            continue
        texts = [" ".join(row) for row in zip(year, day, clock, strict=True)]
        found, _ = parse_with_bare_dates(texts, "%Y %j %H%M")
        rising = np.diff(found.ns[found.valid])
        if fits(found) and len(rising) and bool(np.all(rising >= 0)) and bool(np.any(rising > 0)):
            choice = time_choice(layout, (index, index + 1, at), "%Y %j %H%M", found, 2.2)
            return replace(choice, unnamed=True)
    return None


def _again(columns: Sequence[Sequence[str]]) -> bool:
    """Whether year, day of the year, month and day say the same date twice in every row."""
    if len(columns) < 4 or not all(share(TWO_DIGITS, cells) for cells in columns[2:]):
        return False
    rows = list(zip(*columns, strict=True))
    ordinal, _ = parse_with_bare_dates([f"{year} {day}" for year, day, _, _ in rows], "%Y %j")
    dates, _ = parse_with_bare_dates([f"{year} {month} {day}" for year, _, month, day in rows], "%Y %m %d")
    return bool((ordinal.valid & dates.valid).all()) and bool((ordinal.ns == dates.ns).all())


def _hourly(parts: Sequence[Sequence[str]], form: str = "%Y %m %d %H") -> bool:
    """Whether a date and an hour in columns that nothing names are those of a log of a row an hour."""
    found, _ = parse_with_bare_dates([" ".join(row) for row in zip(*parts, strict=True)], form)
    steps = np.diff(found.ns)
    return len(steps) >= _HOURS and bool(found.valid.all()) and float((steps == 3600 * NANOSECONDS).mean()) >= SHARE


def _padded(parts: Sequence[Sequence[str]]) -> bool:
    """Whether parts of a time are written with two digits where one would do."""
    return any(len(cell) > 1 and cell[0] == "0" for column in parts for cell in column)


def _shorter(cells: Sequence[str], before: Sequence[Sequence[str]]) -> bool:
    """Whether a column is written with one digit where all of the date before it has two: it is no part of the time."""
    return _padded(before) and any(len(cell.split(".")[0]) < 2 for cell in cells)


def _seconds(cells: Sequence[str], before: Sequence[Sequence[str]]) -> bool:
    """Whether a column behind that of the minutes, which nothing names, is of the seconds."""
    if not share(_SECONDS_OF_MINUTE, cells) or not whole_numbers([cell.split(".")[0] for cell in cells], 0, 59):
        return False
    padded = _padded(before)
    if _shorter(cells, before):
        return False
    if any(re.match(r"0\d", cell) for cell in cells):
        return True
    stamps = list(zip(*before, strict=True))
    same = np.array([one == other for one, other in itertools.pairwise(stamps)], dtype=bool)
    steps = np.diff(numbers(cells).value)
    if same.any():
        return bool(np.all(steps[same] > 0))
    # Rows minutes apart: the second of a steady clock stays or drifts, a speed does not.
    return padded and len(steps) > 2 and bool(np.all(np.abs(steps) <= 2))
