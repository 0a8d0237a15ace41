"""Rows that a file lists in another order than they were logged in: interleaved devices, blocks, shuffled exports.

Disorder and a clock that was set back both make the stamps run back. They are distinguished by what sorting does to the
steps between rows. A clock set back brings stamps again that the log had already, so that sorted rows share stamps or
lie closer than the logger's step. Rows out of order fill the intervals that they left: sorted, they follow each other
at the logger's step, and fewer steps differ from it than in the file.
"""

from __future__ import annotations

import datetime as dt
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.clock import JITTER, ClockChoice
from flagdata.signals import Instants
from flagdata.timebase import NANOSECONDS

KIND = "rows-sorted"
NEAR = 0.5
"""A step within this share of the usual one is regular."""
SORT = "if the stamps are right and the rows are only out of order in the file, sort them: --clock sort"
EDGES = 3
"""Changes from one block to another among sorted rows, for each fall of the stamps, up to which they are few."""
FITTING = 0.8
"""Share of the displaced rows that must lie a regular step from both their neighbours once sorted."""


@dataclass(frozen=True, kw_only=True)
class Sorting:
    """How rows are sorted.

    Attributes:
        order: (n,) indices of the rows by their stamps; rows of one stamp stay in the file's order.
        displaced: rows that are out of order in the file, the fewest that can be.
        first: index of the first of them in the file.
        irregular: steps that differ from the usual one, in the file and sorted.
        step: the usual one [ns].
        given: whether the user says that the rows are out of order.
    """

    order: NDArray[np.int64]
    displaced: int
    first: int
    irregular: tuple[int, int]
    step: int
    given: bool

    def finding(self, line: NDArray[np.int64]) -> Finding:
        """What is said of it; `line` (n,) in the order of the file."""
        n, (before, after) = len(self.order), self.irregular
        why = (
            "as given"
            if self.given
            else f"{after} steps then differ from the usual {self.step / NANOSECONDS:g} s, {before} do in the file: a "
            "clock that was set back would have brought stamps again"
        )
        return Finding(
            kind=KIND, severity=Severity.NOTE if self.given else Severity.WARNING, count=self.displaced,
            where=f"line {line[self.first]}",
            what=f"{self.displaced} of {n} rows are out of order in the file; sorted by their stamps ({why})",
            fix=None if self.given else "if the logger's clock was set anew all the same, say whose stamps are right: "
            "--clock first (before it) or --clock last (after it)",
        )  # fmt: skip


def sorting(time: Instants, choice: ClockChoice | None) -> Sorting | None:
    """How rows that are out of order are sorted; `None` where they are in order, or where their clock was set anew.

    Args:
        time: (n,) stamps in the order of the file.
        choice: "sort" where the user says that the rows are out of order; another word says that the clock was set.
    """
    steps = np.diff(time)
    given = choice == "sort"
    if choice not in (None, "sort") or not np.any(steps < (0 if given else -JITTER)):
        return None
    order = np.argsort(time, kind="stable")
    ordered = np.diff(time[order])
    step = int(np.median(ordered[ordered > 0])) if np.any(ordered > 0) else 0
    regular = np.abs(ordered - step) <= NEAR * step
    before = int((np.abs(steps - step) > NEAR * step).sum())
    after = int((~regular).sum())
    if not given and after >= before:
        return None
    displaced = np.ones(len(time), dtype=bool)
    displaced[longest_rise(time)] = False
    fitting = np.concatenate(([True], regular)) & np.concatenate((regular, [True]))
    if not given and float(fitting[displaced[order]].mean()) < FITTING:
        return None
    return Sorting(
        order=order, displaced=int(displaced.sum()), first=int(np.flatnonzero(displaced)[0]),
        irregular=(before, after), step=step, given=given,
    )  # fmt: skip


def in_blocks(time: Instants) -> bool:
    """Whether rows that run back may be blocks out of order: sorted, each fills a place that the others leave free.

    Of a clock that was set back the sorted rows lie among those before, row by row, or share their stamps; a stamp that
    is wrong lies by itself. Where rows come unevenly the stamps show no more, so the user decides.

    Args:
        time: (n,) stamps in the order of the file.
    """
    falls = int((np.diff(time) < 0).sum())
    order = np.argsort(time, kind="stable")
    cuts = np.flatnonzero(np.diff(order) != 1)
    steps = np.diff(time[order])
    if not 0 < len(cuts) <= EDGES * falls or not np.all(steps[cuts] > 0):
        return False
    kept = np.zeros(len(time), dtype=bool)
    kept[longest_rise(time)] = True
    usual = np.diff(time[kept])
    widest = int(usual.max()) if len(usual) else 0
    edges = np.concatenate(([0], cuts + 1, [len(time)]))
    for first, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        beside = [int(steps[at]) for at in (first - 1, end - 1) if 0 <= at < len(steps)]
        if not kept[order[first]] and min(beside) > widest:
            return False
    return True


def longest_rise(time: Instants) -> NDArray[np.int64]:
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


def turned_about(before: int, after: int) -> bool:
    """Whether the stamp after a fall follows the one before it by a day or less, once day and month of one change.

    Args:
        before: the latest stamp before the fall [UTC ns].
        after: the stamp behind it [UTC ns]. Both are tried in all zones of whole hours.
    """
    for hours in range(-12, 15):
        here, there = (_wall(stamp, hours) for stamp in (before, after))
        for first, second in ((_turned(here), there), (here, _turned(there))):
            if first is not None and second is not None and dt.timedelta(0) < second - first <= dt.timedelta(days=1):
                return True
    return False


def _wall(stamp: int, hours: int) -> dt.datetime:
    return dt.datetime.fromtimestamp(stamp / NANOSECONDS, dt.UTC) + dt.timedelta(hours=hours)


def _turned(wall: dt.datetime) -> dt.datetime | None:
    """A stamp with its month as its day; `None` where that is no date, or the same."""
    if wall.day > 12 or wall.day == wall.month:
        return None
    return wall.replace(month=wall.day, day=wall.month)
