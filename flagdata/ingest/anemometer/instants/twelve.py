"""Clocks of twelve hours that are written without AM or PM: 12:59 is followed by 1:00, twice a day.

They are recognised by hours of 1 to 12 alone and by stamps that go on, but for the fall from 12:59 to 1:00. A date that
holds the end of its first half shows both; a date that holds one half goes on from the evening before, or leads to the
morning after. Where neither shows it, the user gives when the first row was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.clock import DAY, HOUR

HALF = 12 * HOUR
_NEAR = 3
"""Usual steps within which rows follow one another."""


def is_twelve(wall: NDArray[np.int64], *, dated: bool) -> bool:
    """Whether stamps are of a clock of twelve hours without AM or PM.

    Args:
        wall: (n,) nanoseconds of the wall clock as read with hours of 0 to 23, in the order of the rows.
        dated: whether they have a date; else they are nanoseconds since midnight.
    """
    hours = wall % DAY // HOUR
    if len(wall) < 3 or int(hours.min()) < 1 or int(hours.max()) != 12:
        return False
    usual, falls = _usual(wall), np.flatnonzero(np.diff(wall) < 0)
    if dated:
        falls = falls[wall[falls] // DAY == wall[falls + 1] // DAY]
    on = (wall[falls + 1] - wall[falls]) % HALF
    return len(falls) > 0 and bool(np.all(on <= max(_NEAR * usual, 1))) and bool(np.all(hours[falls] == 12))


def resolved(
    wall: NDArray[np.int64], *, dated: bool, start: int | None, line: NDArray[np.int64], where: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
    """Stamps of a clock of twelve hours as those of one of 24.

    Args:
        start: the first row's instant by the wall clock [ns], as the user says.

    Raises:
        TimeError: the file does not say which half of the day the first rows are of.
    """
    inside = wall % HALF
    turns = np.concatenate(([0], np.cumsum(np.diff(inside) < 0)))
    if start is not None and not dated:
        base = round((start - int(inside[0])) / HALF) * HALF
        return inside + base + turns * HALF, (_finding(wall, line, "the first row was when you say"),)
    if not dated:
        raise _unknown("the log's", int(line[0]), where)
    day = wall // DAY
    first = np.flatnonzero(np.concatenate(([True], np.diff(day) != 0)))
    last = np.append(first[1:], len(wall)) - 1
    after = turns[last] - turns[first]
    if np.any(after > 1):
        row = int(line[first[np.flatnonzero(after > 1)[0]]])
        raise TimeError(
            "the hours run from 1 to 12 without AM or PM, and more than twice in a day", where=f"{where}, line {row}",
            fix="export the log with a clock of 24 hours, or with AM and PM",
        )  # fmt: skip
    near = _NEAR * _usual(wall)
    half = np.where(after == 1, 0, -1)  # of each date's first row; -1 where it is not known
    if start is not None and half[0] < 0:
        half[0] = int(start - day[0] * DAY - inside[0] > HALF // 2)
    for at in range(1, len(first)):
        before = int(inside[last[at - 1]] + day[last[at - 1]] * DAY) + HALF
        known = half[at - 1] >= 0 and half[at - 1] + after[at - 1] == 1
        if half[at] < 0 and known and 0 < int(inside[first[at]] + day[first[at]] * DAY) - before <= near:
            half[at] = 0
    for at in range(len(first) - 2, -1, -1):
        begins = int(inside[first[at + 1]] + day[first[at + 1]] * DAY)
        if half[at] < 0 and half[at + 1] == 0:
            reached = int(inside[last[at]] + day[last[at]] * DAY)
            half[at] = 1 if 0 < begins - reached - HALF <= near else -1
    if np.any(half < 0):
        at = int(np.flatnonzero(half < 0)[0])
        raise _unknown("a day's" if at else "the first day's", int(line[first[at]]), where, first=at == 0)
    rows = last - first + 1
    begun = np.repeat(half, rows) + turns - np.repeat(turns[first], rows)
    time = inside + day * DAY + begun * HALF
    if start is not None and abs(int(time[0]) - start) > HOUR:
        shown = str(np.datetime64(int(time[0]), "ns"))[:19]
        what = f"by the order of its rows the log begins at {shown} of its clock, and not at the start that was given"
        raise TimeError(what, where=f"{where}, line {line[0]}", fix="correct --start and --zone, or leave --start out")
    return time, (_finding(wall, line, "their order shows the half of the day"),)


def _usual(wall: NDArray[np.int64]) -> int:
    steps = np.diff(wall % HALF)
    return int(np.median(steps[steps > 0])) if np.any(steps > 0) else 0


def _unknown(whose: str, line: int, where: str, *, first: bool = True) -> TimeError:
    fix = (
        "give the instant of the first row, and no date: --start 2026-05-01T13:05:00+02:00"
        if first
        else "export the log with a clock of 24 hours, or with AM and PM"
    )
    return TimeError(
        f"the hours run from 1 to 12 without AM or PM, and the file does not say of which half of the day {whose} "
        "first rows are",
        where=f"{where}, line {line}", fix=fix,
    )  # fmt: skip


def _finding(wall: NDArray[np.int64], line: NDArray[np.int64], how: str) -> Finding:
    fall = int(np.flatnonzero((np.diff(wall) < 0) & (wall[1:] % DAY < HALF))[0]) + 1
    return Finding(
        kind="twelve-hours", severity=Severity.WARNING, count=len(wall), where=f"line {line[fall]}",
        what="the hours run from 1 to 12 without AM or PM, as where 12:59 is followed by 1:00 at line "
        f"{line[fall]}: {how}",
        fix="log with a clock of 24 hours, or with AM and PM",
    )  # fmt: skip
