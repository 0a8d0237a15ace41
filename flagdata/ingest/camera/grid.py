"""Resampling by time stamps: for each instant of an exact grid the nearest source frame, or none.

Nearest, not a blend: a frame stays one exposure of the scene. Blending neighbours would draw a
flapping flag twice, and its motion blur would depend on where the grid falls between them. The
price is a time error of up to half a source period (8.3 ms from 60 Hz), which is reported with each
frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Generic, Protocol, TypeVar

from flagdata.errors import UsageError
from flagdata.timebase import NANOSECONDS

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Pick(Generic[T]):
    """One output frame: its instant [ns], the source frame that stands for it, and its distance
    from it [ns]."""

    time: int
    source: T
    error: int


@dataclass
class GridReport:
    """What the resampling did; grows while it runs.

    Attributes:
        sources: source frames offered.
        used: source frames that stand for at least one instant.
        picks: output frames.
        left_out: grid instants without a source frame within tolerance.
        first_left_out: index of the first of them on the grid.
        gaps: runs of such instants.
        longest_gap: largest distance between the source frames around such a run, or from the start
            [ns].
        worst_error: largest distance of an output frame from its source frame [ns].
    """

    sources: int = 0
    used: int = 0
    picks: int = 0
    left_out: int = 0
    first_left_out: int | None = None
    gaps: int = 0
    longest_gap: int = 0
    worst_error: int = 0

    @property
    def repeats(self) -> int:
        """Output frames that show the same source frame as another one."""
        return self.picks - self.used

    @property
    def unused(self) -> int:
        """Source frames that no output frame shows."""
        return self.sources - self.used


class Sampler(Protocol[T]):
    """Turns source frames, offered in order of their stamps, into output frames."""

    report: GridReport

    def push(self, stamp: int, source: T) -> Iterator[Pick[T]]: ...

    def finish(self) -> Iterator[Pick[T]]: ...


class EveryFrame(Generic[T]):
    """Each source frame at its own stamp; counts what is missing between them.

    Args:
        period: expected step [ns].
        slack: steps up to `slack` periods are no gap: 1.5 where the rate is constant.
    """

    def __init__(self, *, period: int, slack: float) -> None:
        self._period = period
        self._slack = slack
        self._last: int | None = None
        self.report = GridReport()

    def push(self, stamp: int, source: T) -> Iterator[Pick[T]]:
        """Yields the source frame itself."""
        report = self.report
        step = 0 if self._last is None else stamp - self._last
        if step > self._slack * self._period:
            if report.first_left_out is None:
                report.first_left_out = report.sources
            report.left_out += max(1, round(step / self._period) - 1)
            report.gaps += 1
            report.longest_gap = max(report.longest_gap, step)
        self._last = stamp
        report.sources += 1
        report.used += 1
        report.picks += 1
        yield Pick(time=stamp, source=source, error=0)

    def finish(self) -> Iterator[Pick[T]]:
        """Yields nothing: no frame is held back."""
        yield from ()


class Resampler(Generic[T]):
    """Picks the nearest source frame for each instant `start + k / rate`, k = 0, 1, …, as stamps
    come in.

    An instant half-way between two source frames takes the earlier. Holds one source frame.

    Args:
        start: first instant of the grid [ns].
        rate: grid instants a second.
        tolerance: farthest a source frame may be from the instant it stands for [ns].
        tail: how far beyond the last source frame the grid goes on [ns]; half a source period keeps
            the errors at the end what they are elsewhere.
    """

    def __init__(self, *, start: int, rate: Fraction, tolerance: int, tail: int) -> None:
        if rate <= 0 or tolerance < 0 or tail < 0:
            raise UsageError(
                "a grid needs rate > 0, tolerance ≥ 0 and tail ≥ 0", fix="give such values"
            )
        self._start = start
        self.rate = rate
        self._tolerance = tolerance
        self._tail = tail
        self._next = 0
        self._held: tuple[int, T] | None = None
        self.report = GridReport()

    def instant(self, index: int) -> int:
        """Computes the instant of grid point `index` [ns], rounded to the nearest nanosecond, half
        up."""
        twice = 2 * index * NANOSECONDS * self.rate.denominator
        return self._start + (twice + self.rate.numerator) // (2 * self.rate.numerator)

    def push(self, stamp: int, source: T) -> Iterator[Pick[T]]:
        """Offers the next source frame; yields the output frames that are settled by it.

        Raises:
            UsageError: `stamp` is not after the one before.
        """
        self.report.sources += 1
        if self._held is None:
            self._held = (stamp, source)
            if self._skip_before(stamp - self._tolerance):
                self.report.gaps += 1
                self.report.longest_gap = stamp - self._start
            return
        held_stamp, held_frame = self._held
        if stamp <= held_stamp:
            raise UsageError("source stamps must increase", fix="repair them before resampling")
        yield from self._settle(held_stamp, held_frame, until=(held_stamp + stamp) // 2)
        if self._skip_before(stamp - self._tolerance):
            self.report.gaps += 1
            self.report.longest_gap = max(self.report.longest_gap, stamp - held_stamp)
        self._held = (stamp, source)

    def finish(self) -> Iterator[Pick[T]]:
        """Yields what the last source frame stands for."""
        if self._held is not None:
            stamp, source = self._held
            self._held = None
            yield from self._settle(stamp, source, until=stamp + self._tail)

    def _settle(self, stamp: int, source: T, *, until: int) -> Iterator[Pick[T]]:
        """Instants up to and with `until` that `source` is near enough to."""
        until = min(until, stamp + self._tolerance)
        is_used = False
        while (time := self.instant(self._next)) <= until:
            error = abs(time - stamp)
            self._next += 1
            self.report.picks += 1
            self.report.worst_error = max(self.report.worst_error, error)
            is_used = True
            yield Pick(time=time, source=source, error=error)
        self.report.used += is_used

    def _skip_before(self, time: int) -> int:
        """Leaves out the instants before `time`, without walking over them; returns how many."""
        index = self._next
        # Largest step that surely stays at or before `time`, then at most a few single ones for the
        # rounding.
        index = max(index, int(Fraction(time - self._start, NANOSECONDS) * self.rate) - 1)
        while self.instant(index) < time:
            index += 1
        skipped = index - self._next
        if skipped:
            if self.report.first_left_out is None:
                self.report.first_left_out = self._next
            self.report.left_out += skipped
            self._next = index
        return skipped
