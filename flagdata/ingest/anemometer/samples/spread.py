"""Rows that share a stamp, given instants of their own by the rate at which they came.

Five causes, distinguished by the stamps themselves:

- The stamps are coarse or held: nearly every stamp stands for several rows. It may be written to the second only, or
  come from a clock that is read less often than the sensor (a GPS fix once a minute). The sensor's own period is the
  median over the stamps of the time to the next one, divided by the rows between. Rows are spread evenly from one stamp
  to the next; where the next is farther than the period explains, rows are missing and the period alone counts. Stamps
  held for longer than their own resolution could also be those of bursts, with nothing between. Then the readings would
  differ more from the last row of one stamp to the first of the next than from row to row within a stamp: where the
  mean square of those differences, by von Neumann's ratio, is `BURST` times as large over `ENOUGH` stamps or more, the
  rows are spread within the resolution.
- Few rows share a stamp and their neighbours leave room: they waited in a buffer, or the clock stopped for a moment.
  They are spread over that room. So are rows of a fast logger that leave none, within half a period.
- Rows come when something happens, and their stamps are coarse: stamps lie unevenly, or stand for more or fewer rows
  than the time to the next one explains, and no period shows when a row came. Rows are spread within the resolution of
  their own stamp.
- Rows of one stamp of a slow log hold the same readings: they are one reading, said again. The first is kept.
- Few rows of a slow, even logger share a stamp and there is no room: two rows claim one instant. The first is kept.

All rows that are moved, and those of coarse or held stamps altogether, are flagged TIME_UNSURE.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import WIND_CHANNELS, Reading
from flagdata.ingest.anemometer.text.source import RATE_GIVEN
from flagdata.schema import SampleFlag
from flagdata.signals import Instants
from flagdata.timebase import NANOSECONDS

FAST = NANOSECONDS
"""Period below which two rows of one stamp are two samples, and not two records that claim one instant [ns]."""
COARSE = NANOSECONDS
"""Stamps to a second or finer that stand for several rows are coarse; others are held [ns]."""
BURST = 4.0
_REGULAR = 0.7
"""Share of the stamps that must follow a period for the rows to come at one."""
ENOUGH = 10
_EVEN = 0.9
"""Share of the stamps whose rows must fit a period for the rows to have come evenly."""


PAIRS, _TIMES, _ALIKE, _SHARED = 5, 3, 0.95, 0.5
"""Rows that repeat a stamp, and rows of one, from and up to which they may be one reading said again; the shares of
them that hold the same readings, and at most of the rows of stamps that follow each other."""
_OF_STAMPS = frozenset({"coarse-stamps", "held-stamps", "uneven-stamps", "equal-stamps"})
"""Findings about the stamps of a log, in words of what its clock did."""
_SLOW = 60 * NANOSECONDS
"""Time between stamps of a slow log, whose readings change from one to the next [ns]."""
_APART = (
    "log a stamp with every row; if the rows of one stamp are of several stations, read one by a recipe: "
    "[rows] column = its column, value = its name"
)


@dataclass(frozen=True, kw_only=True)
class _Runs:
    """Rows in runs of one stamp: index of each run's first row, its rows, its stamp, time to the next stamp [ns]."""

    start: NDArray[np.int64]
    rows: NDArray[np.int64]
    stamp: Instants
    room: NDArray[np.int64]

    @classmethod
    def of(cls, time: Instants) -> _Runs:
        start = np.flatnonzero(np.concatenate(([True], np.diff(time) != 0)))
        stamp = time[start]
        return cls(start=start, rows=np.diff(np.append(start, len(time))), stamp=stamp, room=np.diff(stamp))


def distinct(reading: Reading) -> Reading:
    """Rows in non-decreasing time as rows in strictly increasing time, by the rules above.

    Of stamps that were counted at a rate which the user gave, that alone is said: the log has none of its own.
    """
    found = _distinct(reading)
    if all(finding.kind != RATE_GIVEN for finding in reading.findings):
        return found
    spread = [finding for finding in found.findings if finding.kind in _OF_STAMPS]
    if not spread:
        return found
    count = int((np.diff(reading.time) == 0).sum())
    what = f"{count} readings stand between two that were counted, and have no time of their own: all are spread "
    what += "evenly up to the next that was counted, and unsure by as much"
    own = Finding(kind="counted-together", severity=Severity.WARNING, count=count, where=spread[0].where, what=what)
    return replace(found, findings=(*(item for item in found.findings if item not in spread), own))


def _distinct(reading: Reading) -> Reading:
    if len(reading.time) < 2:
        return reading
    again = np.concatenate(([False], np.diff(reading.time) == 0))
    if not again.any():
        return reading
    if _irregular(reading):
        return _without_rest(_within(reading))
    if _said_twice(reading, again):
        return _once(reading, again)
    shared = again | np.concatenate((again[1:], [False]))
    if float(shared.mean()) < 0.5:
        return _few(reading, again)
    return _without_rest(_spread(reading, again))


def _said_twice(reading: Reading, again: NDArray[np.bool_]) -> bool:
    """Whether rows of one stamp of a slow log hold the same readings, as those of stamps that follow do not.

    They are one reading, written again when another cell of its row was filled or corrected.
    """
    runs = _Runs.of(reading.time)
    if len(runs.room) < PAIRS or int(again.sum()) < PAIRS or int(runs.rows.max()) > _TIMES:
        return False
    if int(np.median(runs.room)) < _SLOW:
        return False
    same = np.ones(len(again) - 1, dtype=bool)
    for values in reading.channels.values():
        same &= (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    return float(same[again[1:]].mean()) >= _ALIKE and float(same[~again[1:]].mean()) <= _SHARED


def _once(reading: Reading, again: NDArray[np.bool_]) -> Reading:
    """The first row of each stamp."""
    finding = Finding(
        kind="readings-repeated", severity=Severity.WARNING, count=int(again.sum()),
        where=f"line {reading.line[again][0]}",
        what=f"{int(again.sum())} rows hold the stamp and the readings of the row before them, and differ only in "
        "cells that are not read: taken as the same readings, and left out",
        fix=_APART,
    )  # fmt: skip
    return reading.take(~again).with_findings((finding,))


def _irregular(reading: Reading) -> bool:
    """Whether neither the stamps of a slow logger nor the rows that they stand for come at any period."""
    runs = _Runs.of(reading.time)
    if len(runs.room) < ENOUGH or reading.step <= COARSE or int(np.median(runs.room)) < FAST:
        return False
    room, rows = runs.room[1:].astype(np.float64), runs.rows[1:-1]
    period = float(np.median(room / rows))
    held = np.abs(room / rows - period) <= period / 2
    even = np.abs(room - np.median(room)) <= np.median(room) / 2
    return float(held.mean()) < _REGULAR and float(even.mean()) < _REGULAR


def _within(reading: Reading) -> Reading:
    """The rows of each stamp spread within its resolution, or within what the next stamp leaves of it."""
    runs = _Runs.of(reading.time)
    room = np.append(np.minimum(runs.room, reading.step), reading.step)
    time = reading.time + np.repeat(room, runs.rows) * _place(runs) // np.repeat(runs.rows, runs.rows)
    moved = np.repeat(runs.rows > 1, runs.rows)
    step, low, high = reading.step / NANOSECONDS, int(runs.room.min()), int(runs.room.max())
    finding = Finding(
        kind="uneven-stamps", severity=Severity.WARNING, count=int(moved.sum()), value=step,
        where=f"line {reading.line[moved][0]}",
        what=f"stamps to {step:g} s stand for 1 to {int(runs.rows.max())} rows each and lie {low / NANOSECONDS:g} to "
        f"{high / NANOSECONDS:g} s apart, at no steady rate: {int(moved.sum())} rows that share theirs are spread "
        f"within {step:g} s of it and unsure by as much",
        fix="log a stamp to the second with every row",
    )  # fmt: skip
    flags = np.where(moved, reading.flags | SampleFlag.TIME_UNSURE, reading.flags).astype(np.uint16)
    return replace(reading, time=time).with_findings((finding,), flags=flags)


def _few(reading: Reading, again: NDArray[np.bool_]) -> Reading:
    """Runs here and there: spread over the room that the neighbours leave."""
    runs = _Runs.of(reading.time)
    period = int(np.median(runs.room)) if len(runs.room) else 0
    if period == 0:
        return _without(reading, again)
    time = reading.time.copy()
    moved = np.zeros(len(time), dtype=bool)
    for run in np.flatnonzero(runs.rows > 1).tolist():
        first, count = int(runs.start[run]), int(runs.rows[run])
        free = (count - 1) * period
        beyond = free + period if period < FAST else 0  # what lies beyond the log's ends leaves a slow one no room
        after = int(runs.room[run]) if run < len(runs.room) else beyond
        before = int(runs.stamp[run] - time[first - 1]) if first else beyond
        place = np.arange(count)
        if after >= free + period // 2:
            step, start = min(period, after // count), int(runs.stamp[run])
        elif before >= free + period // 2:
            step = min(period, before // count)
            start = int(runs.stamp[run]) - (count - 1) * step
        elif period < FAST:
            step, start = min(after, period) // (2 * count), int(runs.stamp[run])
        else:
            continue
        time[first : first + count] = start + place * step
        moved[first : first + count] = time[first : first + count] != reading.time[first : first + count]
    if moved.any():
        worst = int(np.abs(time - reading.time).max()) / NANOSECONDS
        finding = Finding(
            kind="equal-stamps", severity=Severity.WARNING, count=int(moved.sum()), value=worst,
            where=f"line {reading.line[moved][0]}",
            what=f"{int(moved.sum())} rows share a stamp with a neighbour, as rows do that waited in a buffer or whose "
            f"clock stopped for a moment: kept, spread between their neighbours by up to {worst:.4g} s, and unsure by "
            "as much",
        )  # fmt: skip
        flags = np.where(moved, reading.flags | SampleFlag.TIME_UNSURE, reading.flags)
        reading = replace(reading, time=time).with_findings((finding,), flags=flags)
    return _without(reading, np.concatenate(([False], np.diff(reading.time) <= 0)))


def _without(reading: Reading, again: NDArray[np.bool_]) -> Reading:
    if not again.any():
        return reading
    finding = Finding(
        kind="duplicate-stamps", severity=Severity.ERROR, count=int(again.sum()),
        where=f"line {reading.line[again][0]}",
        what=f"{int(again.sum())} rows carry the stamp of the row before them and other values; left out",
        fix="if the file holds several sensors or heights, ingest each by a recipe of its own",
    )  # fmt: skip
    return reading.take(~again).with_findings((finding,))


def _spread(reading: Reading, again: NDArray[np.bool_]) -> Reading:
    """Runs all over: spread from stamp to stamp."""
    runs = _Runs.of(reading.time)
    inner = slice(1, -1) if len(runs.rows) > 3 else slice(0, -1)
    ratio = runs.room[inner] / runs.rows[:-1][inner] if len(runs.room) else np.zeros(0)
    period = float(np.median(ratio)) if len(ratio) else float(reading.step / max(1, int(runs.rows.max())))
    usual = max(1, int(np.median(runs.rows[inner] if len(runs.rows) > 3 else runs.rows)))
    hold = round(float(np.median(runs.room))) if len(runs.room) else reading.step
    continuity = _continuity(reading, again)
    if len(runs.room) < 2:  # how long a stamp stands is not known
        hold = min(hold, reading.step)
    burst = continuity is not None and continuity > BURST and hold > 1.5 * reading.step
    if burst:
        period, hold = reading.step / usual, reading.step
    room = np.round(period * runs.rows).astype(np.int64)
    near = runs.room <= 1.5 * np.maximum(room[:-1], hold if not burst else 0)
    room[:-1] = np.where(near, runs.room, np.minimum(room[:-1], runs.room))
    time = reading.time + np.repeat(room, runs.rows) * _place(runs) // np.repeat(runs.rows, runs.rows)
    # The log may begin and end within a stamp: those rows keep the period, the first ones before the next stamp.
    if len(runs.room) and near[0]:
        first = min(period, int(runs.room[0]) / int(runs.rows[0]))  # no row comes before its stamp
        time[: runs.rows[0]] = runs.stamp[1] - np.round(first * np.arange(runs.rows[0], 0, -1)).astype(np.int64)
    last = int(runs.start[-1])
    time[last:] = runs.stamp[-1] + np.round(period * np.arange(int(runs.rows[-1]))).astype(np.int64)
    if not burst and hold <= 1.5 * reading.step and hold <= COARSE:
        found = _coarse(reading, again, usual)
    else:
        found = _held(reading, runs, period=period, burst=burst, continuity=continuity)
    flags = (reading.flags | SampleFlag.TIME_UNSURE).astype(np.uint16)
    return replace(reading, time=time).with_findings((found,), flags=flags)


def _place(runs: _Runs) -> NDArray[np.int64]:
    """Each row's place within its run, from 0."""
    return np.arange(int(runs.rows.sum())) - np.repeat(runs.start, runs.rows)


def _coarse(reading: Reading, again: NDArray[np.bool_], usual: int) -> Finding:
    step = reading.step / NANOSECONDS
    return Finding(
        kind="coarse-stamps", severity=Severity.WARNING, count=len(again), value=step,
        where=f"line {reading.line[again][0]}",
        what=f"stamps to {step:g} s for about {usual} rows each: spread evenly within the step, so each time is unsure "
        "by up to that much",
    )  # fmt: skip


def _held(reading: Reading, runs: _Runs, *, period: float, burst: bool, continuity: float | None) -> Finding:
    """What is said of stamps that stand for longer than a second, or than they are written to."""
    counts = runs.rows[1:-1] if len(runs.rows) > 3 else runs.rows
    low, high = int(counts.min()), int(counts.max())
    step = period / NANOSECONDS
    every = float(np.median(runs.room)) / NANOSECONDS if len(runs.room) else step * high
    what = f"one every {step:.4g} s ({1 / step:.4g} Hz)"
    spread = max(float(np.abs(counts - np.median(counts)).max()) * step, step)
    sure = f"each time is sure to about {spread:.3g} s beside the delay of the clock itself"
    even = _even(runs, period)
    if not even:
        sure = f"their number a stamp does not follow the time to the next, so each time is unsure by up to {every:g} s"
    if continuity is None:
        why = f"the readings do not show whether rows came evenly or in bursts; {'if evenly, ' if even else ''}{sure}"
    elif continuity <= BURST:
        came = "came evenly and" if even else "came in no bursts, but"
        why = (
            f"the readings run on across the stamps ({continuity:.3g} times the mean square difference within), so "
            f"rows {came} {sure}"
        )
    else:
        why = (
            f"the readings jump from stamp to stamp ({continuity:.3g} times the mean square difference within): rows "
            f"came in bursts, whose place within {every:g} s is not known"
        )
    return Finding(
        kind="held-stamps", severity=Severity.WARNING, count=len(reading.time), value=step,
        where=f"line {reading.line[1]}",
        what=f"a stamp stands for {low if low == high else f'{low} to {high}'} rows and is renewed every {every:g} s: "
        f"the rows are spread {f'within {reading.step / NANOSECONDS:g} s, ' if burst else 'evenly, '}{what}; {why}",
        fix=None if continuity is not None and continuity <= BURST else _APART,
    )  # fmt: skip


def _even(runs: _Runs, period: float) -> bool:
    """Whether nearly every stamp stands for as many rows as a period [ns] puts between it and the next, but for one."""
    room, rows = runs.room.astype(np.float64), runs.rows[:-1]
    inner = slice(1, None) if len(room) > 2 else slice(None)  # the log may begin within a stamp
    return bool((np.abs(room - rows * period) <= period)[inner].mean() >= _EVEN) if len(room) else True


def _continuity(reading: Reading, again: NDArray[np.bool_]) -> float | None:
    """Mean square difference of the wind across a change of stamp over that within a stamp; `None` for few."""
    ratios: list[float] = []
    for name in sorted(WIND_CHANNELS & set(reading.channels)):
        square = np.diff(reading.channels[name]) ** 2
        known = np.isfinite(square)
        across, within = square[~again[1:] & known], square[again[1:] & known]
        if len(across) < ENOUGH or len(within) < ENOUGH or not float(within.mean()) > 0:
            continue
        ratios.append(float(across.mean() / within.mean()))
    return max(ratios) if ratios else None


def _without_rest(reading: Reading) -> Reading:
    rising = np.concatenate(([True], np.diff(reading.time) > 0))
    if rising.all():
        return reading
    lost = Finding(
        kind="duplicate-stamps", severity=Severity.ERROR, count=int((~rising).sum()),
        where=f"line {reading.line[~rising][0]}",
        what=f"{int((~rising).sum())} rows too many for their stamp; left out",
    )  # fmt: skip
    return reading.take(rising).with_findings((lost,))
