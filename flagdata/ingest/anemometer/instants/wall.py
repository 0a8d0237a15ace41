"""From the wall clock of a place to UTC for a whole log, with the hours that daylight saving repeats or skips.

A wall time in the repeated hour is settled only by evidence in the log itself: its rows run through the hour twice, or
follow without a gap from before it, or lead without a gap to after it. Without evidence the log is refused.

Loggers follow daylight saving late: when they next hear from their server, or when somebody comes by. A jump of the
log's own clock that is as large as a change of the zone, and within `REACH` of it, is that change: the rows before the
jump are on the old offset, those after it on the new one, whatever the zone's own clocks did between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants import clock
from flagdata.ingest.anemometer.instants.clock import DAY, Jump
from flagdata.timebase import NANOSECONDS

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_HOUR = 3600 * NANOSECONDS
_FIX = "give the fixed offset the logger's clock ran on, e.g. +01:00 (many loggers stay on winter time)"
REACH = {"back": (DAY, 31 * DAY), "on": (DAY, 8 * DAY)}
"""How long before and after a zone's change a jump of the same size is taken for it: a clock is set back for nothing
else, while an interval that a clock set on would leave may be an outage."""


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
    offset = np.full(len(wall), offset_at(place, first), dtype=np.int64)
    found: list[Finding] = []
    jumps = _whole_jumps(wall) if changes else ()
    for change in changes:
        late_jump = _followed(change, wall, jumps)
        if late_jump is not None:
            offset[late_jump.row :] = change.after
            found.append(_late(change, late_jump, wall, lines, place))
            continue
        low, high = sorted((change.before, change.after))
        start, end = change.instant + low, change.instant + high
        inside = (wall >= start) & (wall < end)
        if change.after > change.before:
            if inside.any():
                at = int(np.flatnonzero(inside)[0])
                raise TimeError(
                    f"{_show(int(wall[at]))} does not exist in {place}: the clocks were set forward over it",
                    where=f"{where}, line {lines[at]}", fix=_with_jumps(_FIX, jumps, lines),
                )  # fmt: skip
            offset[wall >= end] = change.after
            continue
        offset[wall >= end] = change.after
        if inside.any():
            late = _second_pass(wall, start, end, place, lines, where, jumps)
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


def zone_advice(wall: NDArray[np.int64], lines: NDArray[np.int64]) -> str:
    """What to say to a user who named no zone: a place, where a fixed offset would leave some of the rows wrong."""
    jumps = [jump for jump in _whole_jumps(wall) if jump.size == -_HOUR]
    if not jumps:
        return "name the zone of the logger's clock, e.g. --zone Europe/Amsterdam or --zone +01:00"
    changes = ", ".join(f"{jump.text()} at line {lines[jump.row]}" for jump in jumps)
    return (
        f"the log's clock was {changes}, as for daylight saving: name the place whose clocks it followed, e.g. --zone "
        "Europe/Amsterdam; with a fixed offset some of its rows would be off"
    )


def _second_pass(
    wall: NDArray[np.int64],
    start: int,
    end: int,
    place: tzinfo,
    lines: NDArray[np.int64],
    where: str,
    jumps: Sequence[Jump],
) -> NDArray[np.bool_]:
    """Which rows of the repeated interval [start, end) are of its second pass."""
    inside = (wall >= start) & (wall < end)
    rows = np.flatnonzero(inside)
    late = np.zeros(len(wall), dtype=bool)
    steps = np.diff(wall[rows[0] : rows[-1] + 1])
    usual = clock.usual(wall)
    back = np.flatnonzero((steps < -(end - start) // 2) | ((steps == 0) & (usual >= end - start)))
    if len(back) == 1:
        late[rows[rows > rows[0] + back[0]]] = True
        return late
    if len(back) > 1:
        raise TimeError(
            f"the log goes back more than once within the hour that occurs twice in {place}",
            where=f"{where}, line {lines[rows[0] + back[1] + 1]}", fix=_with_jumps(_FIX, jumps, lines),
        )  # fmt: skip
    reach = max(10 * usual, 2 * NANOSECONDS)
    before = rows[0] > 0 and wall[rows[0]] - wall[rows[0] - 1] <= reach
    after = rows[-1] + 1 < len(wall) and wall[rows[-1] + 1] - wall[rows[-1]] <= reach
    if before == after:
        reason = (
            "the log runs through it once without a break, so its clock was not set back"
            if before
            else "nothing in the log says which pass it is"
        )
        raise TimeError(
            f"{_show(int(wall[rows[0]]))} occurs twice in {place} and {reason}",
            where=f"{where}, line {lines[rows[0]]}",
            fix=_with_jumps("give a fixed offset, e.g. +02:00 for summer time or +01:00 for winter time", jumps, lines),
        )
    late[rows] = after
    return late


def _whole_jumps(wall: NDArray[np.int64]) -> tuple[Jump, ...]:
    """Jumps of the log's own clock by whole quarters of an hour; none where it is out of order all over."""
    back = clock.set_back(wall)
    if len(back) > max(clock.MOST, len(wall) // 1000):
        return ()
    wild = clock.excursions(wall, most=max(10, len(wall) // 1000))
    kept = np.flatnonzero(~wild)
    back = clock.set_back(wall[kept])
    found = [Jump(row=int(kept[jump.row]), size=jump.size, whole=jump.whole) for jump in back]
    found += [
        Jump(row=int(kept[jump.row]), size=jump.size, whole=jump.whole)
        for jump in clock.set_on(wall[kept], returns=back)
    ]
    return tuple(jump for jump in found if jump.whole)


def _followed(change: _Change, wall: NDArray[np.int64], jumps: Sequence[Jump]) -> Jump | None:
    """The jump by which the log's clock followed a change of its zone at another time than the zone; `None` if none."""
    size = change.after - change.before
    early, late = REACH["back" if size < 0 else "on"]
    usual = clock.usual(wall)
    nearest: Jump | None = None
    least = 0
    for jump in jumps:
        delay = int(wall[jump.row - 1]) + usual - (change.instant + change.before)
        if jump.size != size or not -early <= delay <= late:
            continue
        if nearest is None or abs(delay) < least:
            nearest, least = jump, abs(delay)
    # A clock that was set with the zone's, to within a step, shows in the hour itself.
    return None if nearest is None or least <= max(2 * usual, 2 * clock.JITTER) else nearest


def _late(change: _Change, jump: Jump, wall: NDArray[np.int64], lines: NDArray[np.int64], place: tzinfo) -> Finding:
    zone_change = change.instant + change.before
    last = int(wall[jump.row - 1])
    delay = last + clock.usual(wall) - zone_change
    return Finding(
        kind=f"clock-set-{'back' if jump.size < 0 else 'on'}", severity=Severity.WARNING,
        count=len(wall) - jump.row, value=jump.size / NANOSECONDS, where=f"line {lines[jump.row]}",
        what=f"clock {jump.text()} at line {lines[jump.row]}, {clock.span(abs(delay) // NANOSECONDS * NANOSECONDS)} "
        f"{'after' if delay > 0 else 'before'} the clocks of {place} were ({_show(zone_change)}): taken for the same "
        "change, so that the rows before that line are on the old offset and the others on the new one",
        fix="if the logger's clock was set for another reason, give the fixed offset of its first rows and say whose "
        "stamps are right: --clock first or --clock last",
    )  # fmt: skip


def _with_jumps(fix: str, jumps: Sequence[Jump], lines: NDArray[np.int64]) -> str:
    """Advice that names an offset, for a log whose own clock was set: then no one offset is right for all of it."""
    back = [jump for jump in jumps if jump.size < 0]
    if not back:
        return fix
    changes = ", ".join(f"{jump.text()} at line {lines[jump.row]}" for jump in back)
    return (
        f"the log's own clock was {changes}, so that no one offset is right for all its rows: give the fixed offset of "
        "the first rows and --clock first, or that of the last rows and --clock last"
    )


def offset_at(place: tzinfo, instant: int) -> int:
    """How far a zone's clocks are east of UTC at an instant [ns]."""
    moment = (_EPOCH + timedelta(seconds=instant // NANOSECONDS)).astimezone(place)
    delta = moment.utcoffset()
    return 0 if delta is None else (delta.days * 86_400 + delta.seconds) * NANOSECONDS


def _changes(place: tzinfo, low: int, high: int) -> Sequence[_Change]:
    """Offset jumps of the zone between two instants, each found to the second by bisection of steps of a day."""
    found: list[_Change] = []
    step = 24 * _HOUR
    edge, known = low, offset_at(place, low)
    while edge < high:
        upper = min(edge + step, high)
        value = offset_at(place, upper)
        if value != known:
            left, right = edge // NANOSECONDS, upper // NANOSECONDS
            while right - left > 1:
                middle = (left + right) // 2
                left, right = (middle, right) if offset_at(place, middle * NANOSECONDS) == known else (left, middle)
            found.append(_Change(instant=right * NANOSECONDS, before=known, after=value))
        edge, known = upper, value
    return found


def _show(wall: int) -> str:
    return (_EPOCH + timedelta(seconds=wall // NANOSECONDS)).strftime("%Y-%m-%d %H:%M:%S")
