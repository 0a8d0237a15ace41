"""Where a log's time does not go on: a clock that was set back or on, stamps that leave its course,
rows out of order.

Rows follow one another at the usual step p, the median of the steps forward. A step s that differs
from it says that rows are missing, or that the clock was set by s - p. Set back, time repeats
itself, which a log does for no other reason; set on, it leaves an interval that missing rows leave
as well. The size distinguishes the two: people and daylight saving set clocks by whole hours, and
an outage lasts a whole hour, to within p, with probability p / 1 h.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.stamp_text import DAY, HOUR
from flagdata.record.signals import Instants
from flagdata.timebase import NANOSECONDS, iso

ClockChoice: TypeAlias = Literal["first", "last", "sort"]
"""Whose stamps are right where they run back: those before the first jump, those after the last, or
all ("sort"), since no clock was set and the rows are out of order."""

JITTER = 2 * NANOSECONDS
"""Disorder that buffers of a computer explain; a clock that is set back jumps further."""
_LEAST, _AROUND, _APART = 5, 20, 1 / 3
"""Steady steps before and after a small step back, the most that are looked at, and the share of
the jump by which no row around it may be off the clock on its side."""
MOST = 4
"""Times a clock is set within one log; one that runs backwards more often is disordered, or
corrected all the time."""
_CHANCE = 0.5
"""Number of outages of such a length expected by chance below which an interval may be a clock set
on."""
_FARTHEST = 14 * HOUR
"""Zones differ by no more."""
_NEVER_SET = 1000 * DAY
"""A longer interval is that of a clock which began at its maker's date and was set later."""
CHOICES = "say whose stamps are right: --clock first (before it) or --clock last (after it)"
SORT = "if the rows are only out of order in the file, --clock sort"


@dataclass(frozen=True, kw_only=True)
class Jump:
    """The clock was set anew.

    Attributes:
        row: the first row after it.
        size: by which it was set [ns]: negative where it was set back.
        by_quarters: whether that is a multiple of a quarter of an hour; else it is the step less
            the usual one.
    """

    row: int
    size: int
    by_quarters: bool

    def text(self) -> str:
        """Writes the jump in words: "set back 1 h", "set on 30 min"."""
        return f"set {'back' if self.size < 0 else 'on'} {span(abs(self.size))}"


def usual(time: Instants) -> int:
    """Computes the median of the steps forward [ns]; 0 where there are none."""
    steps = np.diff(time)
    forward = steps[steps > 0]
    return int(np.median(forward)) if len(forward) else 0


def set_back(time: Instants) -> tuple[Jump, ...]:
    """Finds every step back by more than `JITTER`, as a jump; (n,) instants in the order of the
    rows."""
    steps, step = np.diff(time), usual(time)
    return tuple(
        _jump(row + 1, int(steps[row]), step) for row in np.flatnonzero(steps < -JITTER).tolist()
    )


def _jump(row: int, step: int, usual_step: int) -> Jump:
    """Finds the jump that a step amounts to: the multiple of a quarter of an hour that leaves most
    nearly the usual step."""
    sizes = [round((step - usual_step) / unit) * unit for unit in (HOUR, HOUR // 2, HOUR // 4)]
    most = max(3 * usual_step, 60 * NANOSECONDS)
    fitting = [size for size in sizes if size and usual_step // 2 <= step - size <= most]
    if not fitting:
        return Jump(row=row, size=step - usual_step, by_quarters=False)
    return Jump(
        row=row, size=min(fitting, key=lambda size: abs(step - size - usual_step)), by_quarters=True
    )


def set_back_a_little(time: Instants, choice: ClockChoice | None) -> tuple[Jump, ...]:
    """Steps back by no more than `JITTER` that no buffer explains: the rows before and after them
    come at the usual step, and none of those after makes up for it, as the row behind a late one
    does.

    Rows that share a stamp count as one, since a clock of whole seconds may stamp several; unless
    the user says that
    the clock was set: a stamp that comes twice in a steady log is then a clock set back by one
    step.
    """
    step = usual(time)
    rows = np.concatenate(([0], np.flatnonzero(np.diff(time)) + 1))
    if choice is not None and len(time) - len(rows) <= MOST and step >= NANOSECONDS:
        rows = np.arange(len(time))
    steps = np.diff(time[rows])
    steady = np.abs(steps - step) <= step / 2
    jumps: list[Jump] = []
    for at in np.flatnonzero((steps <= 0) & (steps >= -JITTER)).tolist():
        before = _length(steady[max(0, at - _AROUND) : at][::-1])
        after = _length(steady[at + 1 : at + 1 + _AROUND])
        if min(before, after) < _LEAST:
            continue
        position = np.arange(-before, after + 2.0)
        clock = (time[rows[at - before : at + after + 2]] - time[rows[at]]).astype(np.float64)
        # One step for both sides, by least squares, and the jump between them.
        sides = np.stack([position, np.ones(len(position)), position > 0], axis=1)
        solved = np.linalg.lstsq(sides, clock, rcond=None)[0]
        shift, behind = round(float(solved[2])), at + 1 + after
        undone = behind < len(steps) and abs(int(steps[behind]) - step + shift) <= _APART * abs(
            shift
        )
        if (
            shift < 0
            and not undone
            and float(np.abs(clock - sides @ solved).max()) <= _APART * abs(shift)
        ):
            jumps.append(Jump(row=int(rows[at + 1]), size=shift, by_quarters=False))
        if len(jumps) > MOST:
            return ()
    return tuple(jumps)


def _length(steady: BoolArray) -> int:
    """Counts how many of the first are true."""
    return len(steady) if steady.all() else int(np.argmin(steady))


def set_on(time: Instants, *, returns: Sequence[Jump] = ()) -> tuple[Jump, ...]:
    """Intervals by which the clock may have been set on: whole hours that chance does not explain,
    or years.

    Of rows a day or more apart none is reported: they keep whole days between them whatever the
    clock does.

    Args:
        time: (n,) instants in the order of the rows.
        returns: jumps back; an interval of the same size as one of them undoes it, however many
            others there are.
    """
    steps, step = np.diff(time), usual(time)
    if step == 0 or step >= DAY:
        return ()
    undone = {-jump.size for jump in returns}
    wide = int((steps > 1.5 * step).sum())
    jumps: list[Jump] = []
    for row in np.flatnonzero(steps > HOUR // 2).tolist():
        jump = _jump(row + 1, int(steps[row]), step)
        rest = int(steps[row]) - jump.size
        by_chance = wide * step / HOUR * (1 if jump.size == HOUR else 5)
        by_hours = jump.by_quarters and step // 2 <= rest <= step + max(step // 2, JITTER // 2)
        if steps[row] > _NEVER_SET:
            jumps.append(Jump(row=row + 1, size=int(steps[row]) - step, by_quarters=False))
        elif (
            by_hours
            and steps[row] <= _FARTHEST + 2 * step
            and (jump.size in undone or (jump.size % HOUR == 0 and by_chance <= _CHANCE))
        ):
            jumps.append(jump)
    return tuple(jumps)


def excursions(time: Instants, *, most: int) -> BoolArray:
    """Rows whose stamps leave the log's time and come back to it: (n,), at most `most` rows at a
    time.

    Such a stretch lies outside the longest rise, between a step back and a step forward of half its
    size or more and no usual one, and the rows on both sides of it follow each other as rows do.
    Beside the log's first or last row only
    one side is known: a stretch there counts where it is more than a day off.
    """
    n, step = len(time), usual(time)
    wild = np.zeros(n, dtype=bool)
    if not np.any(np.diff(time) < -JITTER):
        return wild
    out = np.ones(n, dtype=bool)
    out[longest_rise(time)] = False
    edges = np.flatnonzero(np.diff(np.concatenate(([False], out, [False]))))
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        ways = [int(time[at] - time[at - 1]) for at in (first, end) if 0 < at < n]
        back, forward = -min(ways), max(ways)
        if len(ways) == 1:
            strays = back > DAY
        else:
            over = sum(ways) + int(time[end - 1] - time[first])
            strays = back > JITTER and 2 * forward >= max(back, 3 * step)
            strays = strays and 0 < over <= 3 * (end - first + 1) * step + JITTER
        wild[first:end] = strays and end - first <= most
    return wild


def longest_rise(time: Instants) -> IntArray:
    """Indices of a longest non-decreasing subsequence (Schensted 1961; patience sorting)."""
    tops: list[int] = []
    heads: list[int] = []
    previous = np.full(len(time), -1, dtype=np.int64)
    for index, value in enumerate(time.tolist()):
        pile = bisect_right(tops, value)
        previous[index] = heads[pile - 1] if pile else -1
        tops[pile : pile + 1], heads[pile : pile + 1] = [value], [index]
    chain = np.empty(len(tops), dtype=np.int64)
    at = heads[-1]
    for pile in range(len(tops) - 1, -1, -1):
        chain[pile], at = at, int(previous[at])
    return chain


def is_disordered(time: Instants) -> bool:
    """Checks whether rows that run back fill, once sorted, the intervals that they left: fewer
    steps are then unusual.

    Of a clock that was set back the sorted rows share stamps, or lie closer than the log's step.
    """
    ordered = np.diff(np.sort(time))
    step = float(np.median(ordered[ordered > 0])) if np.any(ordered > 0) else 0.0
    unusual = [int((np.abs(steps - step) > step / 2).sum()) for steps in (ordered, np.diff(time))]
    return unusual[0] < unusual[1]


def sorted_as_given(
    time: Instants, line: IntArray, choice: ClockChoice | None
) -> tuple[IntArray, Finding] | None:
    """Sorts rows that the user says to be out of order, with a finding; `None` where there are
    none.

    Rows of one stamp stay in the file's order.
    """
    if choice != "sort" or not np.any(np.diff(time) < 0):
        return None
    moved = np.ones(len(time), dtype=bool)
    moved[longest_rise(time)] = False
    count = int(moved.sum())
    message = (
        f"{count} of {len(time)} rows are out of order in the file; sorted by their stamps, as "
        "given"
    )
    where = f"line {line[moved][0]}"
    finding = Finding.of("rows-sorted", message, count=count, where=where)
    return np.argsort(time, kind="stable"), finding


def continue_clock(
    time: Instants, jumps: Sequence[Jump], choice: ClockChoice | None
) -> tuple[Instants, BoolArray]:
    """Puts all rows on one clock through all jumps; also says which rows were shifted for it: (n,)
    both.

    Args:
        choice: whose stamps stay; `None` those of the first rows.
    """
    shift = np.zeros(len(time), dtype=np.int64)
    for jump in jumps:
        shift[jump.row :] -= jump.size
    if choice == "last" and len(shift):
        shift -= shift[-1]
    return time + shift, shift != 0


def report(
    time: Instants,
    jumps: Sequence[Jump],
    line: IntArray,
    choice: ClockChoice | None,
    *,
    stamps_stay: bool = False,
    sortable: bool = False,
) -> tuple[Finding, ...]:
    """Reports clocks that were set anew and continued: the jump, its line, and what remains
    uncertain.

    Args:
        time: (n,) as the clock showed it.
        stamps_stay: whether the stamps stay as they are, since so many rows may be missing instead.
        sortable: whether rows have stamps of their own, so that they may be sorted.
    """
    findings: list[Finding] = []
    for jump in jumps:
        at = int(line[jump.row])
        follow = f"{iso(int(time[jump.row - 1]))} is followed by {iso(int(time[jump.row]))}"
        rows = len(time) - jump.row
        message = f"clock {jump.text()} at line {at}: {follow}; "
        if stamps_stay and jump.size > _NEVER_SET:
            message = f"the clock of the {jump.row} rows before line {at} was not set yet: {follow}"
        elif stamps_stay:
            message = (
                f"an interval is longer than usual by {span(jump.size)}: either the clock was "
                f"{jump.text()} at line "
            )
            message += (
                f"{at} ({follow}) and what follows is off by that much, or so many rows are missing"
            )
        elif choice is None:
            message += (
                f"all rows are kept, and the {rows} from there on continue the clock of those "
                "before; the log does "
            )
            message += "not say which of the two clocks is right, so either may be off by that much"
        else:
            right = "before it" if choice == "first" else "after the last jump"
            message += f"as given, the stamps {right} are right, and the others continue them"
        fix = f"if the clock was set, {CHOICES}"
        if jump.size > _NEVER_SET:
            fix = "to let those rows end where the others begin: --clock last"
        elif abs(jump.size) == HOUR:
            fix += (
                "; if it is daylight saving, and the stamps state no offset, name the place by "
                "--zone Region/City"
            )
        fix += f"; {SORT}" if sortable and jump.size < 0 else ""
        findings.append(
            Finding(
                kind=f"clock-set-{'back' if jump.size < 0 else 'on'}",
                value=jump.size / NANOSECONDS,
                where=f"line {at}",
                severity=Severity.WARNING if choice is None else Severity.NOTE,
                count=1 if stamps_stay else rows,
                what=message,
                fix=fix if choice is None else None,
            )
        )
    return tuple(findings)


def span(length: int) -> str:
    """Writes a length of time [ns] in words: "1 h", "1 h 30 min", "37.2 s", "9618 days"."""
    if length > 100 * DAY:
        return f"{length / DAY:.0f} days"
    if length % (60 * NANOSECONDS) == 0 and length:
        hours, minutes = divmod(length // (60 * NANOSECONDS), 60)
        return " ".join(
            f"{number} {unit}" for number, unit in ((hours, "h"), (minutes, "min")) if number
        )
    return f"{length / NANOSECONDS:.4g} s"
