"""Where a logger's clock was set anew: back or on by a constant, once and for the rest of the log.

Rows follow one another at the usual step p, the median of the steps forward. A step s that differs from it says that
rows are missing, or that the clock was set by s - p. Set back, time repeats itself, which a log does for no other
reason; set on, it leaves an interval that missing rows leave as well. The size distinguishes the two: people and
daylight saving set clocks by whole hours, and an outage lasts a whole hour, to within p, with probability p / 1 h.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.signals import Instants
from flagdata.timebase import NANOSECONDS, iso

ClockChoice: TypeAlias = Literal["first", "last", "sort"]
"""Whose stamps are right where they run back: those before the first jump, those after the last, or all ("sort"), since
no clock was set and the rows are out of order."""

JITTER = 2 * NANOSECONDS
"""Disorder that buffers of a computer explain; a clock that is set back jumps further."""
_LEAST, _AROUND = 5, 20
"""Steps before and after a small step back that are looked at, and those of them that must be steady up to it."""
_APART = 1 / 3
"""Share of a small jump by which no row around it may be off the clock on its side."""
HOUR = 3600 * NANOSECONDS
DAY = 24 * HOUR
MOST = 4
"""Times a clock is set within one log; one that runs backwards more often is disordered, or corrected all the time."""
CHANCE = 0.5
"""Number of outages of such a length expected by chance below which an interval may be a clock set on."""
FARTHEST = 14 * HOUR
"""Zones differ by no more."""
NEVER_SET = 1000 * DAY
"""A longer interval is that of a clock which began at its maker's date and was set later."""


@dataclass(frozen=True, kw_only=True)
class Jump:
    """The clock was set anew.

    Attributes:
        row: the first row after it.
        size: by which it was set [ns]: negative where it was set back.
        whole: whether that is a multiple of a quarter of an hour; where it is not, it is the step less the usual one.
    """

    row: int
    size: int
    whole: bool

    def text(self) -> str:
        """ "set back 1 h", "set on 30 min"."""
        return f"set {'back' if self.size < 0 else 'on'} {span(abs(self.size))}"


def usual(time: Instants) -> int:
    """The median of the steps forward [ns]; 0 where there are none."""
    steps = np.diff(time)
    forward = steps[steps > 0]
    return int(np.median(forward)) if len(forward) else 0


def set_back(time: Instants) -> tuple[Jump, ...]:
    """Every step back by more than `JITTER`, as a jump; (n,) instants in the order of the rows."""
    step = usual(time)
    steps = np.diff(time)
    return tuple(_jump(int(row) + 1, int(steps[row]), step) for row in np.flatnonzero(steps < -JITTER))


def stepped_back(time: Instants) -> tuple[Jump, ...]:
    """Steps back by no more than `JITTER` that no buffer explains: the rows before and after them come at the usual
    step, and none of those after makes up for it, as the row behind a late one does. Rows that share a stamp count as
    one, since a clock of whole seconds may stamp several.

    Args:
        time: (n,) instants in the order of the rows.
    """
    rows = np.concatenate(([0], np.flatnonzero(np.diff(time)) + 1))
    steps = np.diff(time[rows])
    found = [_stepped(time[rows], at, rows) for at in np.flatnonzero((steps < 0) & (steps >= -JITTER)).tolist()]
    jumps = tuple(jump for jump in found if jump is not None)
    return jumps if len(jumps) <= MOST else ()


def stood(time: Instants) -> tuple[Jump, ...]:
    """Rows of a steady log that share the stamp of the row before: one too many, or the first behind a clock that was
    set back by one step. Where they are more than `MOST` it is the stamps that are coarse; of steps shorter than a
    second rows that waited in a buffer are likelier.

    Args:
        time: (n,) instants in the order of the rows.
    """
    at = np.flatnonzero(np.diff(time) == 0)
    if len(at) > MOST or usual(time) < NANOSECONDS:
        return ()
    every = np.arange(len(time))
    return tuple(jump for row in at.tolist() if (jump := _stepped(time, row, every)) is not None)


def _stepped(time: Instants, at: int, rows: NDArray[np.int64]) -> Jump | None:
    """The jump between the rows `at` and `at + 1` of (n,) instants, where both sides of it are steady.

    Args:
        rows: (n,) numbers of the rows in the log.
    """
    step, steps = usual(time), np.diff(time)
    near = np.abs(steps - step) <= step / 2
    before = _length(near[max(0, at - _AROUND) : at][::-1])
    after = _length(near[at + 1 : at + 1 + _AROUND])
    if min(before, after) < _LEAST:
        return None
    behind = at + 1 + after
    clock = [
        (time[side] - time[at]).astype(np.float64) for side in (slice(at - before, at + 1), slice(at + 1, behind + 1))
    ]
    place = [np.arange(-before, 1.0), np.arange(1.0, after + 2)]
    spread = [(row - row.mean(), since - since.mean()) for row, since in zip(place, clock, strict=True)]
    # One step for both sides, by least squares; what is left between their means is the jump.
    slope = sum(float(row @ since) for row, since in spread) / sum(float(row @ row) for row, _ in spread)
    shift = round(float(clock[1].mean() - clock[0].mean() - slope * (place[1].mean() - place[0].mean())))
    far = max(float(np.abs(since - slope * row).max()) for row, since in spread)
    undone = behind < len(steps) and abs(int(steps[behind]) - step + shift) <= _APART * abs(shift)
    if shift >= 0 or far > _APART * abs(shift) or undone:
        return None
    return Jump(row=int(rows[at + 1]), size=shift, whole=False)


def _length(steady: NDArray[np.bool_]) -> int:
    """How many of the first are true."""
    return len(steady) if steady.all() else int(np.argmin(steady))


def set_on(time: Instants, *, returns: Sequence[Jump] = ()) -> tuple[Jump, ...]:
    """Intervals by which the clock may have been set on: whole hours that chance does not explain, or years.

    Of rows a day or more apart none is reported: they keep whole days between them whatever the clock does.

    Args:
        time: (n,) instants in the order of the rows.
        returns: jumps back; an interval of the same size as one of them undoes it, however many others there are.
    """
    step = usual(time)
    steps = np.diff(time)
    if step == 0 or step >= DAY:
        return ()
    undone = {-jump.size for jump in returns}
    wide = np.flatnonzero(steps > 1.5 * step)
    found: list[Jump] = []
    for row in np.flatnonzero(steps > HOUR // 2):
        if steps[row] > NEVER_SET:
            found.append(Jump(row=int(row) + 1, size=int(steps[row]) - step, whole=False))
        if steps[row] > FARTHEST + 2 * step:
            continue
        jump = _jump(int(row) + 1, int(steps[row]), step)
        remainder = int(steps[row]) - jump.size
        if not jump.whole or not step // 2 <= remainder <= step + max(step // 2, JITTER // 2):
            continue
        expected = len(wide) * step / HOUR * (1 if jump.size == HOUR else 5)
        if jump.size in undone or (jump.size % HOUR == 0 and expected <= CHANCE):
            found.append(jump)
    return tuple(found)


def _jump(row: int, step: int, usual_step: int) -> Jump:
    """The jump that a step amounts to: the multiple of a quarter of an hour that leaves most nearly the usual step."""
    best: Jump | None = None
    nearest = 0
    for unit in (HOUR, HOUR // 2, HOUR // 4):
        size = round((step - usual_step) / unit) * unit
        left = step - size
        fits = size != 0 and usual_step // 2 <= left <= max(3 * usual_step, 60 * NANOSECONDS)
        if fits and (best is None or abs(left - usual_step) < nearest):
            best, nearest = Jump(row=row, size=size, whole=True), abs(left - usual_step)
    return best or Jump(row=row, size=step - usual_step, whole=False)


def excursions(time: Instants, *, most: int) -> NDArray[np.bool_]:
    """Rows whose stamps leave the log's time and come back to it: (n,), at most `most` rows at a time.

    Such a stretch lies between a step back and a step forward of half its size or more and no usual one, in either
    order, and the rows on both sides of it follow each other as rows do. Beside the log's first or last row only one
    side is noticed: a stretch there counts where it is more than a day off.
    """
    wild = np.zeros(len(time), dtype=bool)
    steps = np.diff(time)
    step = usual(time)
    for at in (np.flatnonzero(steps < -JITTER) + 1).tolist():
        if not wild[at - 1]:
            wild[_excursion(time, steps, at, step, most)] = True
    return wild


def _excursion(time: Instants, steps: NDArray[np.int64], at: int, step: int, most: int) -> slice:
    """The stretch that ends or begins with the step back to row `at`; an empty one where there is none."""
    n, back = len(time), -int(steps[at - 1])

    def follows(first: int, after: int, forward: int) -> bool:
        over = int(time[after] - time[first - 1])
        return 2 * forward >= max(back, 3 * step) and 0 < over <= 3 * (after - first + 1) * step + JITTER

    for first in range(at - 1, max(0, at - 1 - most), -1):
        if follows(first, at, int(steps[first - 1])):
            return slice(first, at)
    for after in range(at + 1, min(n - 1, at + most) + 1):
        if follows(at, after, int(steps[after - 1])):
            return slice(at, after)
    if back > DAY and min(at, n - at) <= most:
        return slice(0, at) if at <= n - at else slice(at, n)
    return slice(at, at)


def continued(time: Instants, jumps: Sequence[Jump], choice: ClockChoice | None) -> tuple[Instants, NDArray[np.bool_]]:
    """One clock through all jumps, and which rows were shifted for it: (n,) both.

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
    time: Instants, jumps: Sequence[Jump], line: NDArray[np.int64], choice: ClockChoice | None
) -> tuple[Finding, ...]:
    """What is said of clocks that were set anew and continued: the jump, its line, and what remains in doubt.

    Args:
        time: (n,) as the clock showed it.
    """
    found: list[Finding] = []
    for jump in jumps:
        before, after = iso(int(time[jump.row - 1])), iso(int(time[jump.row]))
        rows = len(time) - jump.row
        if choice is None:
            doubt = (
                f"all rows are kept, and the {rows} from there on continue the clock of those before; the log does not "
                "say which of the two clocks is right, so either may be off by that much"
            )
        elif choice == "first":
            doubt = f"as given, the clock before it is right: the {rows} rows from there on continue it"
        else:
            doubt = f"as given, the clock after the last jump is right: the {jump.row} rows before this one fit it"
        found.append(
            Finding(
                kind=f"clock-set-{'back' if jump.size < 0 else 'on'}",
                severity=Severity.WARNING if choice is None else Severity.NOTE,
                count=rows, value=jump.size / NANOSECONDS, where=f"line {line[jump.row]}",
                what=f"clock {jump.text()} at line {line[jump.row]}: {before} is followed by {after}; {doubt}",
                fix=_fix(jump) if choice is None else None,
            )
        )  # fmt: skip
    return tuple(found)


def doubt(time: Instants, jumps: Sequence[Jump], line: NDArray[np.int64]) -> tuple[Finding, ...]:
    """What is said of intervals that a clock set on would leave, and missing rows as well; nothing is changed."""
    found: list[Finding] = []
    for jump in jumps:
        before, after = iso(int(time[jump.row - 1])), iso(int(time[jump.row]))
        what = (
            f"an interval is longer than usual by {span(jump.size)}: the clock of the {jump.row} rows before line "
            f"{line[jump.row]} was not set yet ({before} is followed by {after}), so that their stamps say nothing"
            if jump.size > NEVER_SET
            else f"an interval is longer than usual by {span(jump.size)}, to within the rows' step: either the clock "
            f"was {jump.text()} at line {line[jump.row]} ({before} is followed by {after}) and what follows is off by "
            "that much, or so many rows are missing"
        )
        found.append(
            Finding(
                kind="clock-set-on", severity=Severity.WARNING, value=jump.size / NANOSECONDS,
                where=f"line {line[jump.row]}", what=what, fix=_fix(jump),
            )
        )  # fmt: skip
    return tuple(found)


def doubt_where_it_stood(time: Instants, jumps: Sequence[Jump], line: NDArray[np.int64]) -> tuple[Finding, ...]:
    """What is said of rows of a steady log that share the stamp of the row before (`stood`); nothing is changed."""
    return tuple(
        Finding(
            kind="clock-set-back", severity=Severity.WARNING, value=jump.size / NANOSECONDS,
            where=f"line {line[jump.row]}",
            what=f"the steady rows from line {line[jump.row]} on begin with the stamp of the row before them, "
            f"{iso(int(time[jump.row]))}: either the clock was {jump.text()} at line {line[jump.row]} and what comes "
            "before or after is off by that much, or there is one row too many; stamps are taken as written",
            fix=_fix(jump),
        )
        for jump in jumps
    )  # fmt: skip


def _fix(jump: Jump) -> str:
    if jump.size > NEVER_SET:
        return "to let those rows end where the others begin: --clock last"
    choice = "if the clock was set, say whose stamps are right: --clock first (before it) or --clock last (after it)"
    if abs(jump.size) != HOUR:
        return choice
    place = "if it is daylight saving, and the stamps state no offset, name the place by --zone Region/City"
    return f"{place}; {choice}"


def span(length: int) -> str:
    """A length of time [ns] in words: "1 h", "1 h 30 min", "37.2 s", "9618 days"."""
    if length > 100 * DAY:
        return f"{length / DAY:.0f} days"
    if length % (60 * NANOSECONDS) == 0 and length:
        hours, minutes = divmod(length // (60 * NANOSECONDS), 60)
        return " ".join(f"{number} {unit}" for number, unit in ((hours, "h"), (minutes, "min")) if number)
    return f"{length / NANOSECONDS:.4g} s"
