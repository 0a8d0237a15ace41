"""Rows into strictly increasing time; what is out of order, repeated or too coarse is reported,
flagged or left out.

Rules, in order:
1. Rows without any value that do not follow the row before them are left out. Rows are sorted where
   the user says so.
2. Copies are left out: rows equal in stamp and values to the row before, and a stretch that comes
   again with the same stamps and values, as when downloads overlap. Stamps that several readings
   share are no sign of a copy: those change as often within a stamp as from one to the next.
3. Few rows whose stamps leave the log's time and come back to it are left out.
4. Where time runs back and stays there, the clock was set back (`clock`): the rows are kept and
   continue the clock of those before, or those before are made to fit the ones after, as the user
   says; without a word of the user it is reported as a warning, and the rows that were shifted are
   flagged TIME_UNSURE. Where the clock may have been set on, nothing is changed without a word of
   the user. Refused: rows that sorting would put in their place, and time that runs back again and
   again, or by no whole hour to where the log never was.
5. Rows less than `JITTER` late are sorted in and flagged TIME_UNSURE, unless all that follow stay
   late: then 4 holds.
6. Rows that share a stamp are given instants of their own. Where most do and stamps are a second
   apart or less, or stand for rows at one rate, rows are spread evenly from one stamp to the next;
   a longer time that rows share is refused, since they may have come in bursts. Where few do, they
   waited in a buffer: they are spread over the room that their neighbours leave; of a slow log that
   leaves none the first is kept. All that are moved are flagged TIME_UNSURE.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import SampleFlag
from flagdata.core.shell import command_line
from flagdata.errors import TimeError
from flagdata.ingest.anemometer.instants import log_clock
from flagdata.ingest.anemometer.instants.log_clock import JITTER, ClockChoice, Jump
from flagdata.ingest.anemometer.instants.stamp_text import DAY
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.text.text_file import RATE_GIVEN
from flagdata.timebase import NANOSECONDS, iso

_FEW, _SHARE = 10, 4
"""Rows, or a thousandth of all if that is more, that may be left out for wild stamps; no more than
one in four."""
_SMALL = 60 * NANOSECONDS
"""A clock may be set back by any constant up to this where nothing else speaks for it."""
_AGAIN = 0.9
"""Share of the rows that go back which must come with the stamps and values of earlier ones to be a
repetition."""
_ISOLATED = 0.2
"""Share of the pairs of neighbours that share a stamp, up to which the alike among them are taken
for copies."""
_CHANGES, _COPIED = 2.0, 0.1
"""Changes of the values within stamps that readings would have shown, and the share of them that
copies may show."""
_FAST = NANOSECONDS
"""Period below which two rows of one stamp are two samples, and not two records that claim one
instant [ns]."""
_COARSE = NANOSECONDS
"""Time between stamps within which rows may be spread, however they came [ns]."""
_EVEN = 0.9
"""Share of the stamps whose rows must fit a period for the rows to have come evenly."""
_STATIONS = (
    "if they are of several stations, read one by a recipe: [rows] column = its column, value = "
    "its name"
)


def in_order(reading: Reading, *, where: str, choice: ClockChoice | None = None) -> Reading:
    """Apply the rules above.

    Args:
        choice: whose stamps are right where the clock was set anew, or that the rows are out of
            order; `None` where nobody said.

    Raises:
        TimeError: time runs back in a way that no rule explains, or rows share a stamp for too
            long.
    """
    reading = _without_empty(reading)
    sorting = log_clock.sorted_as_given(reading.time, reading.line, choice)
    if sorting is not None:
        reading = reading.with_findings((sorting[1],)).take(sorting[0])
    reading = _on_one_clock(_without_copies(reading), where, None if choice == "sort" else choice)
    lag = np.maximum.accumulate(reading.time) - reading.time
    late = (
        f"{{n}} rows come up to {lag.max() / NANOSECONDS:.3f} s after later ones; sorted and "
        "flagged"
    )
    worst = float(lag.max()) / NANOSECONDS
    reading = reading.marked(
        lag > 0, "time-backwards", late, flag=SampleFlag.TIME_UNSURE, value=worst
    )
    reading = reading.take(np.argsort(reading.time, kind="stable")) if lag.any() else reading
    if choice is not None and {"rows-sorted", "clock-set-back", "clock-set-on"}.isdisjoint(
        finding.kind for finding in reading.findings
    ):
        unused = command_line("--clock", choice)
        message = (
            f"the rows are in the order of their stamps, and no clock was set: {unused} is not used"
        )
        reading = reading.with_findings((Finding.of("clock-not-set", message),))
    return _distinct(reading, where)


def _without_empty(reading: Reading) -> Reading:
    empty = np.logical_and.reduce([np.isnan(values) for values in reading.channels.values()])
    steps = np.diff(reading.time)
    stuck = (steps < 0) | (reading.stamped & (steps == 0))
    adjacent = np.concatenate(([False], stuck)) | np.concatenate((stuck, [False]))
    message = "{n} empty rows dropped, whose stamps are not after that of the row before"
    rows = empty & adjacent if not empty.all() else np.zeros(len(empty), dtype=bool)
    return reading.without(rows, "empty-rows", message, severity=Severity.NOTE)


def _without_copies(reading: Reading) -> Reading:
    """Drops the rows that come again with the stamp and the values of another."""
    time, steps = reading.time, np.diff(reading.time)
    if not np.any(steps <= 0):
        return reading
    if np.any(steps < 0):
        order = np.argsort(time, kind="stable")
        at = np.flatnonzero(np.diff(time[order]) == 0)
        at = at[order[at + 1] != order[at] + 1]
        again = np.zeros(len(time), dtype=bool)
        again[order[at + 1][~_differ(reading, order[at], order[at + 1])]] = True
        back = (time[1:] <= np.maximum.accumulate(time)[:-1]) & (steps != 0)
        varied = any(
            len(np.unique(values[again & np.isfinite(values)])) > 1
            for values in reading.channels.values()
        )
        if varied and int(again.sum()) >= _AGAIN * int(back.sum()):
            message = (
                "{n} rows bring earlier stamps and values again, as when downloads of a logger "
                "overlap"
            )
            return _without_copies(reading.without(again, "repeated-stretch", message))
    shared, differ = steps == 0, _differ(reading, slice(None, -1), slice(1, None))
    twice = np.concatenate(([False], shared & ~differ))
    changes = float(differ[~shared].mean()) * int(shared.sum()) if not shared.all() else 0.0
    copied = changes >= _CHANGES and int((differ & shared).sum()) <= _COPIED * changes
    if not (copied or (shared.all() and not differ.any())):
        # Coarse stamps make equal rows too: isolated pairs alone are the same row written twice,
        # and not those beside which a fast logger left out a step: there the second is a sample
        # that came late.
        period = log_clock.usual(time)
        wide = np.concatenate(([False], (steps > 1.5 * period) & (period < _FAST), [False, False]))
        twice &= ~(wide[:-2] | wide[2:]) & (int(shared.sum()) <= max(1.0, _ISOLATED * len(shared)))
    message = "{n} rows repeat the row before in stamp and in all values that are read: copies"
    return reading.without(twice, "duplicate-rows", message)


def _differ(reading: Reading, rows: IntArray | slice, other_rows: IntArray | slice) -> BoolArray:
    """Checks (m,) whether rows have other values than others."""
    differ = np.zeros(len(reading.line[rows]), dtype=bool)
    for values in reading.channels.values():
        first, second = values[rows], values[other_rows]
        differ |= ~((first == second) | (np.isnan(first) & np.isnan(second)))
    return (
        differ
        if reading.host_time is None
        else differ | (reading.host_time[rows] != reading.host_time[other_rows])
    )


def _on_one_clock(reading: Reading, where: str, choice: ClockChoice | None) -> Reading:
    """Puts the rows on one clock and drops those of wild stamps.

    Raises:
        TimeError: time runs back, and no clock was set.
    """
    time, n = reading.time, len(reading.time)
    lag = np.maximum.accumulate(time) - time
    if not np.any(lag > JITTER):
        return _continue_clock(reading, log_clock.set_back_a_little(time, choice), choice)
    few = max(min(_FEW, n // _SHARE), n // 1000)
    scattered = int((np.diff(time) < -JITTER).sum()) > max(few, log_clock.MOST)
    wild = np.zeros(n, dtype=bool) if scattered else log_clock.excursions(time, most=few)
    jumps = () if scattered else log_clock.set_back(time[~wild])
    scattered |= len(jumps) > log_clock.MOST
    was_set = choice is not None or all(_believable(time[~wild], jump) for jump in jumps)
    if scattered or not was_set or int(wild.sum()) > max(few, n // _SHARE):
        wild = np.ones(n, dtype=bool)
        wild[log_clock.longest_rise(time)] = False
        if int(wild.sum()) > few:
            raise _runs_back(reading, where, settable=choice is None and not scattered)
        jumps = ()
    elif jumps and choice is None and log_clock.is_disordered(time[~wild]):
        raise _runs_back(reading, where, settable=True)
    first = iso(int(time[np.argmax(wild)]))
    message = f"{{n}} rows with stamps far from their neighbours' ({first})"
    worst = float(lag.max()) / NANOSECONDS
    settled = reading.without(
        wild,
        "time-backwards",
        message,
        severity=Severity.ERROR,
        value=worst,
        fix=log_clock.SORT if reading.stamped else None,
    )
    return _continue_clock(settled, jumps, choice)


def _believable(time: IntArray, jump: Jump) -> bool:
    """Checks whether a step back is a clock that was set; else it may be files joined in another
    order."""
    passed_again = int(time[jump.row :].max()) > int(time[jump.row - 1])
    return jump.size >= -DAY and (jump.by_quarters or jump.size >= -_SMALL or passed_again)


def _runs_back(reading: Reading, where: str, *, settable: bool) -> TimeError:
    """Builds the error that time runs back, with the ways out; `settable` whether one is to say
    whose stamps are right."""
    time = reading.time
    reached = np.maximum.accumulate(time)
    falls = np.flatnonzero(np.diff(time) < 0) + 1
    at = int(falls[np.argmax((reached - time)[falls])])
    out = len(time) - len(log_clock.longest_rise(time))
    places = f"in {len(falls)} places, the farthest " if len(falls) > 1 else ""
    ways = [log_clock.SORT] if reading.stamped else []
    ways += [f"if one log's clock was set anew, {log_clock.CHOICES}"] if settable else []
    ways += [
        "if files were joined, split the file there and ingest the parts by themselves",
        _STATIONS,
    ]
    return TimeError(
        f"time runs backwards {places}by {(reached - time)[at] / NANOSECONDS:.1f} s, from "
        f"{iso(int(reached[at]))} to "
        f"{iso(int(time[at]))}, and {out} rows would have to go",
        where=f"{where}, line {reading.line[at]}",
        fix="; ".join(ways),
    )


def _continue_clock(
    reading: Reading, jumps: tuple[Jump, ...], choice: ClockChoice | None
) -> Reading:
    """Puts the rows on one clock: set back by `jumps`, or set on as `clock.set_on` finds."""
    on = log_clock.set_on(reading.time, returns=jumps)
    if choice is None:
        undone = {-jump.size for jump in jumps}
        doubtful = tuple(jump for jump in on if jump.size not in undone)
        reading = reading.with_findings(
            log_clock.report(reading.time, doubtful, reading.line, choice, stamps_stay=True)
        )
        on = tuple(jump for jump in on if jump.size in undone)
    all_jumps = tuple(sorted((*jumps, *on), key=lambda jump: jump.row))
    if not all_jumps:
        return reading
    time, shifted = log_clock.continue_clock(reading.time, all_jumps, choice)
    flags = np.where(shifted, reading.flags | SampleFlag.TIME_UNSURE, reading.flags)
    findings = log_clock.report(
        reading.time, all_jumps, reading.line, choice, sortable=reading.stamped
    )
    return replace(reading, time=time).with_findings(findings, flags=flags)


@dataclass(frozen=True, kw_only=True)
class _Runs:
    """Runs of rows of one stamp: rows, time from each stamp to the next [ns], each row's index in
    its run."""

    rows: IntArray
    room: IntArray
    index: IntArray

    @classmethod
    def of(cls, time: IntArray) -> _Runs:
        start = np.flatnonzero(np.concatenate(([True], np.diff(time) != 0)))
        rows = np.diff(np.append(start, len(time)))
        return cls(
            rows=rows,
            room=np.diff(time[start]),
            index=np.arange(len(time)) - np.repeat(start, rows),
        )


def _distinct(reading: Reading, where: str) -> Reading:
    """Rows in non-decreasing time as rows in strictly increasing time.

    Raises:
        TimeError: most rows share a stamp, for more than a second, and do not come at one rate.
    """
    again = np.diff(reading.time) == 0
    if not again.any():
        return reading
    shared = np.concatenate(([False], again)) | np.concatenate((again, [False]))
    runs = _Runs.of(reading.time)
    if float(shared.mean()) < 0.5:
        time, kind = _in_room(reading.time, runs), "equal-stamps"
        moved, value = time != reading.time, float(np.abs(time - reading.time).max()) / NANOSECONDS
        message = (
            "{n} rows share a stamp with a neighbour, as rows do that waited in a buffer or whose "
            "clock stopped for "
        )
        message += (
            f"a moment: spread between their neighbours by up to {value:.4g} s, and unsure by as "
            "much"
        )
    else:
        time, period, hold = _evenly(reading, runs)
        counted = any(finding.kind == RATE_GIVEN for finding in reading.findings)
        if (
            hold > _COARSE
            and not counted
            and (hold > 1.5 * reading.step or reading.step >= DAY or not _even(runs, period))
        ):
            raise _shared_stamp_error(
                reading, runs, hold, f"{where}, line {reading.line[shared][0]}"
            )
        held_stamps, moved = (
            hold > 1.5 * reading.step or hold > _COARSE,
            np.ones(len(time), dtype=bool),
        )
        kind = "counted-together" if counted else "held-stamps" if held_stamps else "coarse-stamps"
        value = (period if held_stamps and not counted else reading.step) / NANOSECONDS
        message = (
            f"stamps {hold / NANOSECONDS:g} s apart for about {int(np.median(runs.rows))} rows "
            "each: spread evenly, "
        )
        message += (
            f"one every {period / NANOSECONDS:.4g} s, so each time is unsure by up to "
            f"{hold / NANOSECONDS:g} s"
        )
    flags = np.where(moved, reading.flags | SampleFlag.TIME_UNSURE, reading.flags)
    rows = np.concatenate(([False], again)) if kind == "counted-together" else moved
    reading = replace(reading.marked(rows, kind, message, value=value), time=time).with_findings(
        (), flags=flags
    )
    stuck = np.concatenate(([False], np.diff(time) <= 0))
    message = "{n} rows carry the stamp of the row before them and other values"
    return reading.without(
        stuck, "duplicate-stamps", message, severity=Severity.ERROR, fix=_STATIONS
    )


def _in_room(time: IntArray, runs: _Runs) -> IntArray:
    """Runs here and there, spread over the room that the neighbours leave: behind the stamp, else
    before it; of a fast logger that leaves none, within half a period."""
    period, rows = int(np.median(runs.room)) if len(runs.room) else 0, runs.rows
    free = (rows - 1) * period
    # What lies beyond the log's ends leaves a slow one no room.
    end = period if period < _FAST else 0
    after = np.append(runs.room, end * rows[-1])
    forward = after >= free + period // 2
    half = (
        np.minimum(after, period) // (2 * rows)
        if period < _FAST
        else np.zeros(len(rows), dtype=np.int64)
    )
    step = np.where(forward, np.minimum(period, after // rows), half)
    before = np.concatenate(([end * rows[0]], runs.room - ((rows - 1) * step)[:-1]))
    backward = ~forward & (before >= free + period // 2)
    step = np.where(backward, np.minimum(period, before // rows), step)
    start = np.where(backward, -(rows - 1) * step, 0)
    return time + np.repeat(start, rows) + runs.index * np.repeat(step, rows)


def _evenly(reading: Reading, runs: _Runs) -> tuple[IntArray, float, int]:
    """Runs all over, spread from stamp to stamp; the period of the rows and the usual time between
    stamps [ns].

    The period is the median over the stamps of the time to the next one, divided by the rows
    between. Where the next is farther than that explains, rows are missing and the period alone
    counts.
    """
    rows, room = runs.rows, runs.room
    inner = slice(1, -1) if len(rows) > 3 else slice(0, -1)
    period = (
        float(np.median(room[inner] / rows[:-1][inner]))
        if len(room)
        else float(reading.step / max(1, rows.max()))
    )
    hold = round(float(np.median(room))) if len(room) else reading.step
    hold = (
        min(hold, reading.step) if len(room) < 2 else hold
    )  # how long a stamp stands is not known
    length = np.round(period * rows).astype(np.int64)
    adjoining = room <= 1.5 * np.maximum(length[:-1], hold)
    length[:-1] = np.where(adjoining, room, np.minimum(length[:-1], room))
    time = reading.time + np.repeat(length, rows) * runs.index // np.repeat(rows, rows)
    # The log may begin and end within a stamp: those rows keep the period, the first ones before
    # the next stamp.
    first, last = int(rows[0]), len(time) - int(rows[-1])
    if len(room) and adjoining[0]:
        pace = min(period, int(room[0]) / first)  # no row comes before its stamp
        time[:first] = reading.time[first] - np.round(pace * np.arange(first, 0, -1)).astype(
            np.int64
        )
    time[last:] = reading.time[-1] + np.round(period * runs.index[last:]).astype(np.int64)
    return time, period, hold


def _even(runs: _Runs, period: float) -> bool:
    """Checks whether nearly every stamp stands for as many rows as a period [ns] puts between it
    and the next, but for one."""
    off = np.abs(runs.room - runs.rows[:-1] * period) <= period
    return bool(off[1 if len(off) > 2 else 0 :].mean() >= _EVEN) if len(off) else True


def _shared_stamp_error(reading: Reading, runs: _Runs, hold: int, where: str) -> TimeError:
    low, high = int(runs.rows.min()), int(runs.rows.max())
    number, dates = f"{low}" if low == high else f"{low} to {high}", reading.step >= DAY
    message = (
        "the stamps are dates without a time of day, and stand"
        if dates
        else (f"the stamps are {hold / NANOSECONDS:g} s apart, and stand")
    )
    fix = (
        "name the column of the time of day beside that of the date; "
        if dates
        else "log a stamp with every row; "
    )
    fix += (
        "if the rows came at a steady rate, read the wind alone (--columns) with --start TIME "
        "--rate HZ; "
    )
    return TimeError(
        f"{message} for {number} rows each: the file does not say when each was read",
        where=where,
        fix=fix + _STATIONS,
    )
