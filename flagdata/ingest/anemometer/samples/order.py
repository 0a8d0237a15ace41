"""Rows into strictly increasing time; what is out of order, repeated or too coarse is reported, flagged or left out.

Rules, in order:
1. Rows without any value whose stamps run back are left out, and rows that the file lists out of order are sorted
   (`disorder`), by evidence or by the user's word.
2. A stretch that comes again with the same stamps and values, as when downloads overlap, is left out.
3. Few rows whose stamps leave the log's time and come back to it are left out.
4. Where time runs back and stays there, the clock was set back (`clock`): the rows are kept and continue the clock of
   those before, or those before are made to fit the ones after, as the user says; without a word of the user it is
   reported as a doubt, and the rows that were shifted are flagged TIME_UNSURE. So it is where the clock was set on,
   except that without a word of the user nothing is changed, and where one row of a steady log repeats the stamp before
   it, since the clock may have been set back by one step. Refused: time that runs back again and again, or by no
   whole hour to where the log never was, as in files that were joined.
5. Rows less than `JITTER` late are sorted in and flagged TIME_UNSURE, unless all that follow stay late: then 4 holds.
6. Rows equal in stamp and values, and in every cell that is not read, are the same row written several times: one is
   kept.
7. Rows that share a stamp are given instants of their own (`spread`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants import clock, disorder
from flagdata.ingest.anemometer.instants.clock import DAY, JITTER, ClockChoice, Jump
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.samples.spread import FAST, PAIRS, distinct
from flagdata.ingest.anemometer.samples.written import written_otherwise
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.timebase import NANOSECONDS, iso

FEW, SHARE = 10, 4
"""Rows, or a thousandth of all if that is more, that may be left out for wild stamps; no more than one in four."""
SMALL = 60 * NANOSECONDS
"""A clock may be set back by any constant up to this where nothing else speaks for it."""
AGAIN = 0.9
"""Share of a stretch's rows that must come with the stamps and values of earlier ones to be taken for a repetition."""
DATES_SHARED = 0.5
"""Share of the rows that share a date without a time of day, from which they are refused."""
ISOLATED = 0.2
"""Share of the pairs of neighbours that share a stamp, up to which the alike among them are taken for copies."""
_JOINED = 3
"""Places where time runs backwards from which on the rows are in no order, and no clock was set back."""
_FINE = 60
"""Steps of the stamps' resolution that lie between two readings where it cannot be the reason that they share one."""
COPIES, COPIED = 2.0, 0.1
"""Changes of the values within stamps that readings would have shown, and the share of them that copies may show."""


def in_order(
    reading: Reading, *, where: str, choice: ClockChoice | None = None, source: TextFile | None = None
) -> Reading:
    """Apply the rules above.

    Args:
        source: the file, whose lines show whether rows are equal in the cells that are not read.
        choice: whose stamps are right where the clock was set anew, or that the rows are out of order; `None` where
            nobody said.

    Raises:
        TimeError: time runs back in a way that no rule explains, or most rows share a date without a time of day.
    """
    reading = _put_in_order(_without_empty_twins(_without_empty_rows(reading)), choice)
    reading = _without_repeated_stretches(reading)
    reading = _sorted(reading, where, None if choice == "sort" else choice)
    reading = _without_repeats(reading, source)
    _refuse_bare_dates(reading, where)
    return distinct(reading)


def _refuse_bare_dates(reading: Reading, where: str) -> None:
    """Refuse rows whose stamps are dates alone, and are shared by most.

    Raises:
        TimeError: the file does not say when within its day a row was read.
    """
    again = np.diff(reading.time) == 0
    shared = np.concatenate(([False], again)) | np.concatenate((again, [False]))
    if reading.step < DAY or len(again) == 0 or float(shared.mean()) < DATES_SHARED:
        return
    raise TimeError(
        f"the stamps are dates without a time of day, and {int(shared.sum())} of {len(shared)} rows share theirs with "
        f"others: the file does not say when within {iso(int(reading.time[shared][0]))[:10]} each was read",
        where=f"{where}, line {reading.line[shared][0]}",
        fix="name the column of the time of day beside that of the date; if the rows came at a steady rate, read the "
        "wind alone (--columns) with --start TIME --rate HZ; else export the log with the time of each row",
    )  # fmt: skip


def _empty(reading: Reading) -> NDArray[np.bool_]:
    """Rows that hold no value."""
    return np.logical_and.reduce([np.isnan(values) for values in reading.channels.values()])


def _without_empty_twins(reading: Reading) -> Reading:
    """The rows without those that hold no value and have the stamp of a row that does: a summary beside a report."""
    empty = _empty(reading)
    if not reading.stamped or not empty.any():
        return reading
    twins = empty & np.isin(reading.time, reading.time[~empty])
    if not twins.any():
        return reading
    which = "hold no value that is read, beside a row of the same stamp that does"
    return _without(reading, twins, which, Severity.NOTE)


def _without_empty_rows(reading: Reading) -> Reading:
    """The rows without those that hold no value, where these run back and the others do so less."""
    back = int((np.diff(reading.time) < 0).sum())
    empty = _empty(reading)
    if not back or not empty.any() or empty.all() or int((np.diff(reading.time[~empty]) < 0).sum()) >= back:
        return reading
    return _without(reading, empty, "hold no value, some of them with stamps that run back", Severity.WARNING)


def _without(reading: Reading, empty: NDArray[np.bool_], which: str, severity: Severity) -> Reading:
    """The rows without these empty ones, and what is said of them."""
    finding = Finding(
        kind="empty-rows", severity=severity, count=int(empty.sum()), where=f"line {reading.line[empty][0]}",
        what=f"{int(empty.sum())} rows {which}; left out",
    )  # fmt: skip
    return reading.take(~empty).with_findings((finding,))


def _put_in_order(reading: Reading, choice: ClockChoice | None) -> Reading:
    found = disorder.sorting(reading.time, choice)
    if found is not None:
        return reading.with_findings((found.finding(reading.line),)).take(found.order)
    if choice == "sort" and disorder.KIND not in {finding.kind for finding in reading.findings}:
        text = "the rows are in the order of their stamps: --clock sort is not used"
        return reading.with_findings((Finding(kind="clock-not-set", severity=Severity.NOTE, what=text),))
    return reading


def _sorted(reading: Reading, where: str, choice: ClockChoice | None) -> Reading:
    lag = np.maximum.accumulate(reading.time) - reading.time
    if len(lag) == 0 or int(lag.max()) <= JITTER:
        return _late_rows_sorted(_steady(reading, choice))
    few = max(min(FEW, len(reading.time) // SHARE), len(reading.time) // 1000)
    jumps = clock.set_back(reading.time)
    wild = clock.excursions(reading.time, most=few) if len(jumps) <= few else np.zeros(len(lag), dtype=bool)
    settled = reading.take(~wild)
    jumps = clock.set_back(settled.time)
    many = int(wild.sum()) > max(few, len(wild) // SHARE)
    if many or len(jumps) > clock.MOST or not all(_believable(settled, jump, choice) for jump in jumps):
        settable = choice is None and len(jumps) <= clock.MOST
        return _late_rows_sorted(_one_clock(_risen(reading, lag, few, where, settable=settable), (), choice))
    if wild.any():
        settled = settled.with_findings((_left_out(reading, wild, lag),))
    return _late_rows_sorted(_one_clock(settled, jumps, choice))


def _steady(reading: Reading, choice: ClockChoice | None) -> Reading:
    """Rows that run back by no more than buffers explain, on one clock where it was set back by so little."""
    differs = _differs(reading)
    stood = tuple(jump for jump in clock.stood(reading.time) if differs[jump.row - 1])
    if choice is None:
        reading = reading.with_findings(clock.doubt_where_it_stood(reading.time, stood, reading.line))
        stood = ()
    jumps = (*clock.stepped_back(reading.time), *stood)
    return _one_clock(reading, jumps, choice)


def _believable(reading: Reading, jump: Jump, choice: ClockChoice | None) -> bool:
    """Whether a step back is a clock that was set; else it may be files joined in another order."""
    if choice is not None:
        return True
    if jump.size < -DAY:
        return False
    passed_again = int(reading.time[jump.row :].max()) > int(reading.time[jump.row - 1])
    return jump.whole or jump.size >= -SMALL or passed_again


def _one_clock(reading: Reading, jumps: tuple[Jump, ...], choice: ClockChoice | None) -> Reading:
    """The rows on one clock: set back by `jumps`, or set on as `clock.set_on` finds."""
    on = clock.set_on(reading.time, returns=jumps)
    if choice is None:
        undone = {-jump.size for jump in jumps}
        doubtful = tuple(jump for jump in on if jump.size not in undone)
        reading = reading.with_findings(clock.doubt(reading.time, doubtful, reading.line))
        on = tuple(jump for jump in on if jump.size in undone)
    every = tuple(sorted((*jumps, *on), key=lambda jump: jump.row))
    if not every:
        if choice is None:
            return reading
        text = f"no place is left where the clock was set back or on: --clock {choice} is not used"
        return reading.with_findings((Finding(kind="clock-not-set", severity=Severity.NOTE, what=text),))
    time, shifted = clock.continued(reading.time, every, choice)
    flags = np.where(shifted, reading.flags | SampleFlag.TIME_UNSURE, reading.flags)
    found = clock.report(reading.time, every, reading.line, choice)
    if choice is None and jumps and _may_be_sorted(reading):
        found = tuple(replace(one, fix=f"{one.fix}; {disorder.SORT}") for one in found)
    return replace(reading, time=time).with_findings(found, flags=flags)


def _late_rows_sorted(reading: Reading) -> Reading:
    time = reading.time
    backwards = np.flatnonzero(np.diff(time) < 0) + 1
    if len(backwards) == 0:
        return reading
    lag = np.maximum.accumulate(time) - time
    late = lag > 0
    worst = float(lag.max()) / NANOSECONDS
    flags = np.where(late, reading.flags | SampleFlag.TIME_UNSURE, reading.flags).astype(np.uint16)
    finding = Finding(
        kind="time-backwards", severity=Severity.WARNING, count=int(late.sum()), value=worst,
        where=f"line {reading.line[backwards[0]]}",
        what=f"{int(late.sum())} rows come up to {worst:.3f} s after later ones; sorted and flagged",
    )  # fmt: skip
    return reading.with_findings((finding,), flags=flags).take(np.argsort(time, kind="stable"))


def _risen(reading: Reading, lag: NDArray[np.int64], few: int, where: str, *, settable: bool) -> Reading:
    """The rows without the fewest whose removal leaves time in order.

    Args:
        lag: (n,) how far each row lies before the latest above it [ns].
        few: rows that may go.
        settable: whether a word on whose stamps are right would have them read.

    Raises:
        TimeError: they are many.
    """
    time = reading.time
    keep = disorder.longest_rise(time)
    wild = np.ones(len(time), dtype=bool)
    wild[keep] = False
    count = int(wild.sum())
    if count > few:
        backwards = np.flatnonzero(np.diff(time) < 0) + 1
        at = int(backwards[np.argmax(lag[backwards])])
        sort = "if all stamps are right and only the rows are out of order: --clock sort"
        whose = "--clock first (before it) or --clock last (after it)"
        ways = [f"or, if one log's clock was set anew, say whose stamps are right: {whose}"] if settable else []
        why = "the logger's clock was set back, or files were joined"
        if disorder.turned_about(int(time[at] + lag[at]), int(time[at])):
            why = "day and month change places there, as where a spreadsheet read a part of the dates"
            ways = ["split the file there and ingest each part by itself, with its own --date-order"]
        elif len(backwards) > _JOINED:
            ways = [sort, *ways, "if rows of several stations are mixed, read one by a recipe with [rows]"]
            why = f"so it does in {len(backwards)} places, where rows are in no order or of several stations"
        else:
            ways = ["split the file there and ingest the parts by themselves", *ways, f"or, {sort}"]
        raise TimeError(
            f"time runs backwards by {lag[at] / NANOSECONDS:.1f} s, from {iso(int(time[at] + lag[at]))} to "
            f"{iso(int(time[at]))}, and {count} rows would have to go: {why}",
            where=f"{where}, line {reading.line[at]}",
            fix="; ".join(ways),
        )  # fmt: skip
    return reading.take(keep).with_findings((_left_out(reading, wild, lag),))


def _left_out(reading: Reading, wild: NDArray[np.bool_], lag: NDArray[np.int64]) -> Finding:
    first = int(np.flatnonzero(wild)[0])
    return Finding(
        kind="time-backwards", severity=Severity.ERROR, count=int(wild.sum()), where=f"line {reading.line[first]}",
        value=float(lag.max()) / NANOSECONDS,
        what=f"{int(wild.sum())} rows with stamps far from their neighbours' ({iso(int(reading.time[first]))}); "
        "left out",
        fix=disorder.SORT if _may_be_sorted(reading) else None,
    )  # fmt: skip


def _may_be_sorted(reading: Reading) -> bool:
    """Whether the user may say that the rows are out of order: they have stamps of their own, and fit where sorted."""
    return reading.stamped and disorder.in_blocks(reading.time)


def _without_repeated_stretches(reading: Reading) -> Reading:
    """The rows without stretches that go back to earlier stamps and bring the earlier values again."""
    time = reading.time
    backwards = np.flatnonzero(np.diff(time) < -JITTER) + 1
    if not 0 < len(backwards) <= 1000:
        return reading
    drop = np.zeros(len(time), dtype=bool)
    for at in backwards.tolist():
        reached = int(time[:at].max())
        beyond = np.flatnonzero(time[at:] > reached)
        stop = at + int(beyond[0]) if len(beyond) else len(time)
        earlier = np.argsort(time[:at], kind="stable")
        place = np.minimum(np.searchsorted(time[:at], time[at:stop], sorter=earlier), at - 1)
        source = earlier[place]
        again = time[source] == time[at:stop]
        varies = False
        for values in reading.channels.values():
            new, old = values[at:stop], values[source]
            again &= (new == old) | (np.isnan(new) & np.isnan(old))
            varies |= len(np.unique(new[np.isfinite(new)])) > 1
        if varies and float(again.mean()) >= AGAIN:
            drop[at:stop] |= again
    if not drop.any():
        return reading
    count, first = int(drop.sum()), int(np.flatnonzero(drop)[0])
    finding = Finding(
        kind="repeated-stretch", severity=Severity.WARNING, count=count, where=f"line {reading.line[first]}",
        what=f"{count} rows bring earlier stamps and values again, as when downloads of a logger overlap; left out",
    )  # fmt: skip
    return reading.take(~drop).with_findings((finding,))


def _without_repeats(reading: Reading, source: TextFile | None) -> Reading:
    """The rows without those that repeat the row before them in stamp and in all cells."""
    if len(reading.time) < 2:
        return reading
    differs = _differs(reading)
    same = _repeats(reading, differs)
    finely = False
    if same.any() and source is not None:
        otherwise = written_otherwise(source, reading.line[:-1][same], reading.line[1:][same])
        finely = 0 < int(otherwise.sum()) < PAIRS and _stamped_finely(reading)  # many are distinguished by `distinct`
        if not finely:
            differs[same] = otherwise
            same = _repeats(reading, differs)
    if not same.any():
        return reading
    twice = np.concatenate(([False], same))
    count, rows = int(twice.sum()), np.diff(np.flatnonzero(np.append(~twice, True)))
    most = int(rows.max())
    cells = "all values that are read" if finely else "all cells"
    what = f"{count} {'row repeats' if count == 1 else 'rows repeat'} the row before in stamp and in {cells}"
    what += f", up to {most} rows alike" if most > 2 else ""
    finding = Finding(
        kind="duplicate-rows", severity=Severity.WARNING, count=count, where=f"line {reading.line[twice][0]}",
        what=f"{what}; left out as copies",
    )  # fmt: skip
    return reading.take(~twice).with_findings((finding,))


def _stamped_finely(reading: Reading) -> bool:
    """Whether a log's stamps are far finer than its steps, so that two readings share none."""
    period = clock.usual(reading.time)
    return period >= SMALL and reading.step * _FINE <= period


def _repeats(reading: Reading, differs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n - 1,) whether a row repeats the one before it; `differs` whether it differs in something beside the stamp."""
    again = np.diff(reading.time) == 0
    same = again & ~differs
    if not _copied(again, differs):
        # Coarse stamps make equal rows too: isolated pairs alone are the same row written twice.
        same &= ~_with_room(reading)
        same &= int(again.sum()) <= max(1.0, ISOLATED * len(again))
    return same


def _differs(reading: Reading) -> NDArray[np.bool_]:
    """(n - 1,) whether a row has other values than the one before it."""
    differs = np.zeros(max(0, len(reading.time) - 1), dtype=bool)
    for values in reading.channels.values():
        differs |= ~((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1])))
    if reading.host_time is not None:
        differs |= np.diff(reading.host_time) != 0
    return differs


def _copied(again: NDArray[np.bool_], differs: NDArray[np.bool_]) -> bool:
    """Whether rows that share a stamp are copies, and not readings below a coarse stamp.

    Readings change from row to row as often within a stamp as from stamp to stamp; copies change with the stamp alone.
    Of a log of one stamp nothing is known but that its rows are alike.

    Args:
        again: (n - 1,) whether a row has the stamp of the one before.
        differs: (n - 1,) whether it has other values.
    """
    if again.all():
        return not differs.any()
    expected = float(differs[~again].mean()) * int(again.sum())
    return expected >= COPIES and int((differs & again).sum()) <= COPIED * expected


def _with_room(reading: Reading) -> NDArray[np.bool_]:
    """Pairs of neighbours, (n - 1,), beside which a fast logger left out a step: the second is a sample, come late."""
    steps = np.diff(reading.time)
    period = clock.usual(reading.time)
    if period >= FAST:
        return np.zeros(len(steps), dtype=bool)
    wide = steps > 1.5 * period
    return np.concatenate(([False], wide[:-1])) | np.concatenate((wide[1:], [False]))
