"""From the wall clock of a place to UTC for a whole log, with the hours that daylight saving repeats or skips.

A wall time in the repeated hour is settled only by evidence in the log itself: its rows run through the hour twice, or
follow without a gap from before it, or lead without a gap to after it. Without evidence the log is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.timebase import NANOSECONDS

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_HOUR = 3600 * NANOSECONDS
_FIX = "give the fixed offset the logger's clock ran on, e.g. +01:00 (many loggers stay on winter time)"


@dataclass(frozen=True, kw_only=True)
class _Change:
    """A jump of the zone's offset: instant [UTC ns], offsets before and after [ns east of UTC]."""

    instant: int
    before: int
    after: int


def to_utc(
    wall: NDArray[np.int64], place: tzinfo, *, lines: NDArray[np.int64], where: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
    """UTC nanoseconds of wall-clock nanoseconds, in the order of the rows.

    Args:
        wall: (n,) nanoseconds since 1970 as the wall clock shows them.
        lines: (n,) line numbers, for messages.

    Raises:
        TimeError: a wall time that never occurred there, or one that occurred twice without evidence which.
    """
    if len(wall) == 0:
        return wall.copy(), ()
    first, last = int(wall.min()) - 26 * _HOUR, int(wall.max()) + 26 * _HOUR
    changes = _changes(place, first, last)
    offset = np.full(len(wall), _offset(place, first), dtype=np.int64)
    found: list[Finding] = []
    for change in changes:
        low, high = sorted((change.before, change.after))
        start, end = change.instant + low, change.instant + high
        inside = (wall >= start) & (wall < end)
        if change.after > change.before:
            if inside.any():
                at = int(np.flatnonzero(inside)[0])
                raise TimeError(
                    f"{_show(int(wall[at]))} does not exist in {place}: the clocks were set forward over it",
                    where=f"{where}, line {lines[at]}", fix=_FIX,
                )  # fmt: skip
            offset[wall >= end] = change.after
            continue
        offset[wall >= end] = change.after
        if inside.any():
            late = _second_pass(wall, start, end, place, lines, where)
            offset[late] = change.after
            found.append(
                Finding(
                    kind="clocks-set-back", severity=Severity.NOTE, count=int(inside.sum()),
                    where=f"line {lines[np.flatnonzero(inside)[0]]}",
                    what=f"the hour from {_show(start)} occurs twice in {place}; by their order "
                    f"{int((inside & ~late).sum())} rows are of its first pass, "
                    f"{int((inside & late).sum())} of its second",
                )
            )  # fmt: skip
    return wall - offset, tuple(found)


def _second_pass(
    wall: NDArray[np.int64], start: int, end: int, place: tzinfo, lines: NDArray[np.int64], where: str
) -> NDArray[np.bool_]:
    """Which rows of the repeated interval [start, end) are of its second pass."""
    inside = (wall >= start) & (wall < end)
    rows = np.flatnonzero(inside)
    late = np.zeros(len(wall), dtype=bool)
    steps = np.diff(wall[rows[0] : rows[-1] + 1])
    back = np.flatnonzero(steps < -(end - start) // 2)
    if len(back) == 1:
        late[rows[rows > rows[0] + back[0]]] = True
        return late
    if len(back) > 1:
        raise TimeError(
            f"the log goes back more than once within the hour that occurs twice in {place}",
            where=f"{where}, line {lines[rows[0] + back[1] + 1]}", fix=_FIX,
        )  # fmt: skip
    usual = float(np.median(np.abs(np.diff(wall)))) if len(wall) > 1 else 0.0
    reach = max(10 * usual, 2 * NANOSECONDS)
    before = rows[0] > 0 and wall[rows[0]] - wall[rows[0] - 1] <= reach
    after = rows[-1] + 1 < len(wall) and wall[rows[-1] + 1] - wall[rows[-1]] <= reach
    if before == after:
        reason = (
            "the log runs through it once without a break, so its clock was not set back"
            if before
            else "nothing in the log tells which pass it is"
        )
        raise TimeError(
            f"{_show(int(wall[rows[0]]))} occurs twice in {place} and {reason}",
            where=f"{where}, line {lines[rows[0]]}",
            fix="give a fixed offset, e.g. +02:00 for summer time or +01:00 for winter time",
        )
    late[rows] = after
    return late


def _offset(place: tzinfo, instant: int) -> int:
    moment = (_EPOCH + timedelta(seconds=instant // NANOSECONDS)).astimezone(place)
    delta = moment.utcoffset()
    return 0 if delta is None else (delta.days * 86_400 + delta.seconds) * NANOSECONDS


def _changes(place: tzinfo, low: int, high: int) -> Sequence[_Change]:
    """Offset jumps of the zone between two instants, each found to the second by bisection of steps of a day."""
    found: list[_Change] = []
    step = 24 * _HOUR
    edge, known = low, _offset(place, low)
    while edge < high:
        upper = min(edge + step, high)
        value = _offset(place, upper)
        if value != known:
            left, right = edge // NANOSECONDS, upper // NANOSECONDS
            while right - left > 1:
                middle = (left + right) // 2
                left, right = (middle, right) if _offset(place, middle * NANOSECONDS) == known else (left, middle)
            found.append(_Change(instant=right * NANOSECONDS, before=known, after=value))
        edge, known = upper, value
    return found


def _show(wall: int) -> str:
    return (_EPOCH + timedelta(seconds=wall // NANOSECONDS)).strftime("%Y-%m-%d %H:%M:%S")
