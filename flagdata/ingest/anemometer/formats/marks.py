"""Time marks of a stream: times of day at some lines, made into instants for all lines between.

Sentences that come in bursts, one time sentence in each, with long silence between: whose burst a
line is of.

A burst of n sentences takes n × 82 characters at 4800 baud at most. Where marks are much farther
apart than that, and each kind of wind comes once between two of them, a sentence is of its burst's
mark, and not of an instant between.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field

import numpy as np

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding
from flagdata.errors import TimeError, UsageError
from flagdata.ingest.anemometer.formats.nmea_sentences import TimeMark
from flagdata.ingest.anemometer.instants import log_clock as clocks
from flagdata.ingest.anemometer.instants.log_clock import ClockChoice
from flagdata.record.signals import Instants
from flagdata.timebase import NANOSECONDS

SENTENCE = 82 * 10 * NANOSECONDS // 4800
"""Time that the longest sentence takes at 4800 baud [ns]."""
_SILENT = 10
"""Marks are this many times as far apart as a burst may last."""
_LEAST = 10 * NANOSECONDS
"""Distance of marks [ns] below which lines come as a stream."""
_MARKS, _SHARE = 3, 0.9
"""Marks from which bursts are recognised, and the share of times between them with each wind once
at most."""
_ORDER = 1_000_000
"""What gives the order of the winds of one burst [ns]: they have one mark."""


@dataclass
class Bursts:
    """What shows where bursts begin: the kind of a stream's first sentence, and the lines with that
    kind."""

    first: str = ""
    starts: list[int] = field(default_factory=list)
    begins: int = 0
    ends: int = 0

    def sentence(self, kind: str, line: int) -> None:
        """Adds a sentence, in the order of the lines."""
        if not self.first:
            self.first, self.begins = kind, line
        self.ends = line
        if kind == self.first:
            self.starts.append(line)

    def placed(
        self, lines: IntArray, winds: Sequence[Hashable], at: IntArray, marks: Instants
    ) -> Instants | None:
        """Instants of lines by the marks of their bursts; `None` where the stream shows no bursts.

        Args:
            lines: (n,) of the winds.
            winds: (n,) which wind each line holds.
            at: (m,) lines of the marks.
            marks: (m,) their instants, rising.
        """
        if len(marks) < _MARKS or not _are_bursts(lines, winds, at, marks):
            return None
        edges = self._edges(at)
        # Of the burst before the first mark only the end may be there.
        starts_of_bursts = np.concatenate(
            ([marks[0] - int(np.median(np.diff(marks)))], marks)
        ).astype(np.int64)
        burst = np.searchsorted(edges, lines, side="right")
        distinct = np.unique(np.stack([burst, _marks_of_lines(winds)]), axis=1).shape[1] == len(
            lines
        )
        if not distinct or at[0] - self.begins > 2 * np.median(np.diff(at)):
            return None
        time = starts_of_bursts[burst]
        first = np.searchsorted(burst, burst)
        return time + (np.arange(len(lines)) - first) * _ORDER

    def _edges(self, at: IntArray) -> IntArray:
        """Finds (m,) the first line of each burst: that of its mark, or the first after the last
        mark that begins a burst.

        The stream is taken to begin with a whole burst, unless it ends with as many lines behind
        its last mark as
        there are between marks: then a burst begins with its mark.
        """
        between = int(np.median(np.diff(at)))
        if self.begins == at[0] or self.ends - int(at[-1]) >= between - 1:
            return at
        starts = np.array(self.starts, dtype=np.int64)
        after = np.concatenate(([self.begins], at[:-1] + 1))
        indices = np.searchsorted(starts, after)
        first_lines = np.where(
            indices < len(starts), starts[np.minimum(indices, len(starts) - 1)], at
        )
        return np.where(first_lines <= at, first_lines, at)


def _marks_of_lines(winds: Sequence[Hashable]) -> IntArray:
    kinds = {kind: number for number, kind in enumerate(dict.fromkeys(winds))}
    return np.array([kinds[kind] for kind in winds], dtype=np.int64)


def _are_bursts(lines: IntArray, winds: Sequence[Hashable], at: IntArray, marks: Instants) -> bool:
    """Checks whether marks are far apart for the lines between them, and each kind of wind comes
    once between them."""
    spacing, between = float(np.median(np.diff(marks))), float(np.median(np.diff(at)))
    if spacing < max(_LEAST, _SILENT * between * SENTENCE):
        return False
    interval = np.searchsorted(at, lines)
    pairs = np.stack([interval, _marks_of_lines(winds)])
    _, counts = np.unique(pairs, axis=1, return_counts=True)
    return float((counts == 1).mean()) >= _SHARE


DAY = 86_400 * NANOSECONDS
# The receiver sends ZDA at the second itself; RMC, GGA and GLL state the time of a fix and may come
# late.
_TRUST = ("ZDA", "RMC", "GGA", "GLL")
NO_TIME = "the stream carries no time"
_STEADY_FIX = (
    "if its wind came at a steady rate that is known: --start TIME --rate HZ, with the instant of "
    "the first"
)
NO_TIME_FIX = (
    "record ZDA, RMC, GGA or GLL sentences too, or log with a stamp before each line; "
    f"{_STEADY_FIX}"
)
_STILL_FIX = (
    "check that the receiver has a fix: the times of its ZDA, RMC, GGA or GLL go on with one; "
    f"{_STEADY_FIX}"
)
BURST = 4
"""Lines about a single mark that are of its second: 4800 baud carry five sentences of 82
characters, the mark too."""
FEW = 10
"""Marks, or a hundredth of all if that is more, that may leave the stream's time and come back to
it."""
DISORDER = 2 * NANOSECONDS
"""A mark this much behind the one before it is reported; less is the order of sentences within a
second."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Instants of the lines asked for.

    Attributes:
        time: (n,) UTC nanoseconds.
        spacing: median distance of the marks [s].
        marks: number of marks used.
        kind: sentence they come from.
        findings: about midnight and marks that run backwards.
        bursts: whether each line has the time of its burst's mark, and none is interpolated.
    """

    time: Instants
    spacing: float
    marks: int
    kind: str
    findings: tuple[Finding, ...]
    bursts: bool = False


@dataclass
class TimeLine:
    """Marks as they come in, by the kind of sentence."""

    line: dict[str, list[int]] = field(default_factory=dict)
    clock: dict[str, list[int]] = field(default_factory=dict)
    bursts: Bursts = field(default_factory=Bursts)
    dated: tuple[int, int, dt.date] | None = None
    """First date the stream states: its line, time of day [ns] and date."""

    def add(self, kind: str, line: int, mark: TimeMark) -> None:
        """Adds a time sentence. Dates that no calendar has are left out."""
        self.line.setdefault(kind, []).append(line)
        self.clock.setdefault(kind, []).append(mark.clock)
        if mark.date is not None and self.dated is None:
            try:
                self.dated = (line, mark.clock, dt.date(*mark.date))
            except ValueError:
                return

    def place(
        self,
        lines: IntArray,
        *,
        date: dt.date | None,
        where: str,
        choice: ClockChoice | None = None,
        winds: Sequence[Hashable] = (),
    ) -> Placed:
        """Instants of `lines`, by interpolation between the marks and at their usual pace outside
        them.

        Lines that come in bursts have the time of the mark of their burst instead.

        Args:
            date: day (UTC) of the first mark, for a stream that states none.
            choice: whose marks are right where the stream's clock was set back and stays so; `None`
                where nobody said.
            winds: which wind each line holds, where bursts are to be looked for.

        Raises:
            TimeError: fewer than two marks, unless all lines are close to the one, or no date.
            UsageError: a date given that the stream contradicts.
        """
        single = self._single()
        if single is not None and _reach(lines, self.line[single][0]) <= BURST:
            return self._of_one(single, lines, date=date, where=where)
        kind = self._kind(where)
        at = np.array(self.line[kind], dtype=np.int64)
        clock = np.array(self.clock[kind], dtype=np.int64)
        findings: list[Finding] = []
        # More than half a day back is midnight; less is disorder.
        day = np.cumsum(np.concatenate(([0], np.diff(clock) < -DAY // 2)).astype(np.int64))
        if day[-1]:
            text = f"{day[-1]} times the clock passes midnight: the day is counted on"
            findings.append(Finding.of("midnight", text, count=int(day[-1])))
        marks = (self._start(at, clock, day, date, where) + day) * DAY + clock
        marks, reported = _one_clock(marks, at, choice)
        findings.extend(reported)
        rising = marks > np.concatenate(
            ([np.iinfo(np.int64).min], np.maximum.accumulate(marks)[:-1])
        )
        behind = np.concatenate(([False], np.diff(marks) < -DISORDER))
        if behind.any():
            count = int(behind.sum())
            message = (
                f"{count} times the stream's clock runs backwards; marks behind earlier ones are "
                "not used"
            )
            findings.append(_backwards(count, f"line {at[behind][0]}", message))
        at, marks = at[rising], marks[rising]
        if len(marks) < 2:
            raise TimeError(
                "the stream's clock stands still",
                where=f"{where}, line {at[0]}",
                fix=_STILL_FIX,
            )
        spacing = float(np.median(np.diff(marks))) / NANOSECONDS
        time = self.bursts.placed(lines, winds, at, marks) if winds else None
        return Placed(
            time=_interpolate(lines, at, marks) if time is None else time,
            spacing=spacing,
            marks=len(marks),
            kind=kind,
            findings=tuple(findings),
            bursts=time is not None,
        )

    def _single(self) -> str | None:
        """Returns the kind of the one mark of the stream; `None` where there are more or none."""
        if any(len(lines) > 1 for lines in self.line.values()):
            return None
        return next((kind for kind in _TRUST if kind in self.line), None)

    def _of_one(self, kind: str, lines: IntArray, *, date: dt.date | None, where: str) -> Placed:
        """Dates a few lines about one mark: within the second before or behind it, in their
        order."""
        at = np.array(self.line[kind], dtype=np.int64)
        clock = np.array(self.clock[kind], dtype=np.int64)
        mark = self._start(at, clock, np.zeros(1, dtype=np.int64), date, where) * DAY + int(
            clock[0]
        )
        pace = NANOSECONDS // (_reach(lines, int(at[0])) + 1)
        message = (
            f"the stream carries one time, in line {at[0]}: {len(lines)} wind sentences are taken "
            "as of the second "
            "about it, in their order"
        )
        findings = (Finding.of("one-time", message, count=len(lines), fix=_STEADY_FIX),)
        return Placed(
            time=mark + (lines - at[0]) * pace, spacing=1.0, marks=1, kind=kind, findings=findings
        )

    def _kind(self, where: str) -> str:
        counts = {kind: len(lines) for kind, lines in self.line.items()}
        most = max(counts.values(), default=0)
        if most < 2:
            raise TimeError(
                NO_TIME if not counts else "the stream carries only one time",
                where=where,
                fix=NO_TIME_FIX,
            )
        return next(kind for kind in _TRUST if 2 * counts.get(kind, 0) >= most)

    def _start(
        self, at: IntArray, clock: IntArray, day: IntArray, date: dt.date | None, where: str
    ) -> int:
        """Days since 1970 of the first mark."""
        epoch = dt.date(1970, 1, 1).toordinal()
        if self.dated is None:
            if date is None:
                raise TimeError(
                    "the stream carries the time of day, but no date",
                    where=f"{where}, line {at[0]}",
                    fix="give the date (UTC) of its first sentence: --date 2026-05-01",
                )
            return date.toordinal() - epoch
        line, time, date_of_mark = self.dated
        nearest = int(np.argmin(np.abs(at - line)))
        # The dated sentence may lie across midnight from its nearest mark.
        across = round((int(clock[nearest]) - time) / DAY)
        start = date_of_mark.toordinal() - epoch - int(day[nearest]) - across
        if date is not None and date.toordinal() - epoch != start:
            raise UsageError(
                f"the date {date} was given, but the stream begins on "
                f"{dt.date.fromordinal(start + epoch)}",
                where=where,
                fix="leave out --date",
            )
        return start


def _reach(lines: IntArray, mark: int) -> int:
    """Counts how many lines the farthest of `lines` is from a mark."""
    return int(np.abs(lines - mark).max()) if len(lines) else 0


def _one_clock(
    marks: Instants, at: IntArray, choice: ClockChoice | None
) -> tuple[Instants, tuple[Finding, ...]]:
    """Marks on one clock where it was set back for good; those that leave its time for a moment do
    not rise."""
    most = max(FEW, len(marks) // 100)
    stray = (
        clocks.excursions(marks, most=most)
        if len(clocks.set_back(marks)) <= most
        else np.zeros(len(marks), bool)
    )
    settled = np.flatnonzero(~stray)
    jumps = clocks.set_back(marks[settled])
    jumps = jumps if len(jumps) <= clocks.MOST else ()
    out = marks.copy()
    out[settled], _ = clocks.continue_clock(marks[settled], jumps, choice)
    findings = clocks.report(marks[settled], jumps, at[settled], choice)
    if stray.any():
        out[stray] = out[
            settled[np.maximum(np.searchsorted(settled, np.flatnonzero(stray)) - 1, 0)]
        ]
        message = (
            f"{int(stray.sum())} times of the stream leave its course and come back to it; not used"
        )
        findings = (*findings, _backwards(int(stray.sum()), f"line {at[stray][0]}", message))
    return out, findings


def _backwards(count: int, where: str, what: str) -> Finding:
    return Finding.of("time-backwards", what, count=count, where=where)


def _interpolate(lines: IntArray, at: IntArray, marks: IntArray) -> Instants:
    """Instants of lines between marks, exact to a nanosecond relative to the marks' first."""
    base = int(marks[0])
    relative = (marks - base).astype(np.float64)
    pace = float(np.median(np.diff(relative) / np.diff(at)))
    position = lines.astype(np.float64)
    out = np.interp(position, at.astype(np.float64), relative)
    out = np.where(lines < at[0], (position - at[0]) * pace, out)
    out = np.where(lines > at[-1], relative[-1] + (position - at[-1]) * pace, out)
    return base + np.round(out).astype(np.int64)
