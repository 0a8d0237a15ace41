"""Rows into strictly increasing time; what is out of order, repeated or too coarse is reported, flagged or left out.

Rules, in order:
1. Rows whose removal (the fewest possible) leaves time in order are late. Less than `JITTER` late: they are sorted in
   and flagged TIME_UNSURE. More, and few: they are left out. More, and many: the clock was set back; refused, since two
   stretches would claim the same time.
2. Rows equal in stamp and values are the same row written twice: one is kept.
3. Stamps too coarse for the rate (several rows share nearly every stamp): the rows are spread evenly over the stamp's
   step and flagged TIME_UNSURE. Otherwise the first row of a stamp is kept.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import Reading
from flagdata.schema import SampleFlag
from flagdata.timebase import NANOSECONDS, iso

JITTER = 2 * NANOSECONDS
"""Disorder that buffers of a computer explain; a clock that is set back jumps further."""
FEW = 10
"""Rows, or a thousandth of all if that is more, that may be left out for wild stamps."""


def in_order(reading: Reading, *, where: str) -> Reading:
    """Apply the rules above.

    Raises:
        TimeError: the clock was set back within the log.
    """
    reading = _sorted(reading, where)
    reading = _without_repeats(reading)
    return _distinct(reading)


def _sorted(reading: Reading, where: str) -> Reading:
    time = reading.time
    steps = np.diff(time)
    if not np.any(steps < 0):
        return reading
    backwards = np.flatnonzero(steps < 0) + 1
    lag = np.maximum.accumulate(time) - time
    if int(lag.max()) <= JITTER:
        late = lag > 0
        worst = float(lag.max()) / NANOSECONDS
        flags = np.where(late, reading.flags | SampleFlag.TIME_UNSURE, reading.flags).astype(np.uint16)
        finding = Finding(
            kind="time-backwards", severity=Severity.WARNING, count=int(late.sum()), value=worst,
            where=f"line {reading.line[backwards[0]]}",
            what=f"{int(late.sum())} rows come up to {worst:.3f} s after later ones; sorted and flagged",
        )  # fmt: skip
        return reading.with_findings((finding,), flags=flags).take(np.argsort(time, kind="stable"))
    keep = _longest_rise(time)
    wild = np.ones(len(time), dtype=bool)
    wild[keep] = False
    count = int(wild.sum())
    first = int(np.flatnonzero(wild)[0])
    if count > max(FEW, len(time) // 1000):
        at = int(backwards[np.argmax(lag[backwards])])
        raise TimeError(
            f"time runs backwards by {lag[at] / NANOSECONDS:.1f} s, from {iso(int(time[at - 1]))} to "
            f"{iso(int(time[at]))}, and {count} rows overlap: the logger's clock was set back",
            where=f"{where}, line {reading.line[at]}", fix="split the file there and ingest the parts by themselves",
        )  # fmt: skip
    finding = Finding(
        kind="time-backwards", severity=Severity.ERROR, count=count, where=f"line {reading.line[first]}",
        value=float(lag.max()) / NANOSECONDS,
        what=f"{count} rows with stamps far from their neighbours' ({iso(int(time[first]))}); left out",
    )  # fmt: skip
    return reading.take(keep).with_findings((finding,))


def _longest_rise(time: NDArray[np.int64]) -> NDArray[np.int64]:
    """Indices of a longest non-decreasing subsequence (Schensted 1961; patience sorting)."""
    tops: list[int] = []
    heads: list[int] = []
    previous = np.full(len(time), -1, dtype=np.int64)
    for index, value in enumerate(time.tolist()):
        place = bisect_right(tops, value)
        if place:
            previous[index] = heads[place - 1]
        if place == len(tops):
            tops.append(value)
            heads.append(index)
        else:
            tops[place] = value
            heads[place] = index
    chain = np.empty(len(tops), dtype=np.int64)
    at = heads[-1]
    for place in range(len(tops) - 1, -1, -1):
        chain[place] = at
        at = int(previous[at])
    return chain


def _without_repeats(reading: Reading) -> Reading:
    if len(reading.time) < 2:
        return reading
    same = np.diff(reading.time) == 0
    for values in reading.channels.values():
        equal = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
        same &= equal
    if reading.host_time is not None:
        same &= np.diff(reading.host_time) == 0
    # Coarse stamps make equal rows too: only isolated pairs are the same row written twice.
    shared = float((np.diff(reading.time) == 0).mean())
    if not same.any() or shared > 0.2:
        return reading
    twice = np.concatenate(([False], same))
    finding = Finding(
        kind="duplicate-rows", severity=Severity.WARNING, count=int(twice.sum()),
        where=f"line {reading.line[twice][0]}", what=f"{int(twice.sum())} rows repeat the one before them; left out",
    )  # fmt: skip
    return reading.take(~twice).with_findings((finding,))


def _distinct(reading: Reading) -> Reading:
    if len(reading.time) < 2:
        return reading
    again = np.concatenate(([False], np.diff(reading.time) == 0))
    if not again.any():
        return reading
    shared = again | np.concatenate((again[1:], [False]))
    if float(shared.mean()) < 0.5:
        finding = Finding(
            kind="duplicate-stamps", severity=Severity.ERROR, count=int(again.sum()),
            where=f"line {reading.line[again][0]}",
            what=f"{int(again.sum())} rows carry the stamp of the row before them and other values; left out",
        )  # fmt: skip
        return reading.take(~again).with_findings((finding,))
    return _spread(reading, again)


def _spread(reading: Reading, again: NDArray[np.bool_]) -> Reading:
    """Rows of one stamp spread evenly over the stamp's step, or to the next stamp when that is nearer."""
    starts = np.flatnonzero(~again)
    counts = np.diff(np.append(starts, len(again)))
    stamps = reading.time[starts]
    room = np.full(len(stamps), reading.step, dtype=np.int64)
    room[:-1] = np.minimum(room[:-1], np.diff(stamps))
    # The log may begin and end within a step: those rows keep the usual spacing, the first ones before the next stamp.
    usual = max(1, int(np.median(counts[1:-1]) if len(counts) > 2 else counts.max()))
    slots = counts.copy()
    slots[[0, -1]] = np.maximum(slots[[0, -1]], usual)
    place = np.arange(len(again)) - np.repeat(starts, counts)
    place[: counts[0]] += slots[0] - counts[0]
    time = reading.time + np.repeat(room, counts) * place // np.repeat(slots, counts)
    moved = (reading.flags | SampleFlag.TIME_UNSURE).astype(np.uint16)
    finding = Finding(
        kind="coarse-stamps", severity=Severity.WARNING, count=len(again), value=reading.step / NANOSECONDS,
        where=f"line {reading.line[again][0]}",
        what=f"stamps to {reading.step / NANOSECONDS:g} s for about {usual} rows each: spread evenly within the step, "
        f"so each time is unsure by up to that much",
    )  # fmt: skip
    spread = replace(reading, time=time).with_findings((finding,), flags=moved)
    rising = np.concatenate(([True], np.diff(time) > 0))
    if rising.all():
        return spread
    lost = Finding(
        kind="duplicate-stamps", severity=Severity.ERROR, count=int((~rising).sum()),
        where=f"line {reading.line[~rising][0]}",
        what=f"{int((~rising).sum())} rows too many for their stamp; left out",
    )  # fmt: skip
    return spread.take(rising).with_findings((lost,))
