"""Stamps of a file's frames: what their rate is, and a strictly increasing sequence out of
imperfect ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Generic, TypeVar

import numpy as np

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from flagdata.ingest.camera.container_clock import REORDER
from flagdata.timebase import NANOSECONDS

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Timing:
    """The stamps of a whole file, as its packets state them, before any frame is decoded.

    Attributes:
        tick: seconds of one stamp unit.
        origin: stamp of the first frame; instants are counted from it.
        period: ticks from frame to frame: the mean where the rate is constant, the median where it
            varies.
        variable: more than one frame in a hundred is off that rate by more than the stamps' own
            rounding.
        span: ticks from the first to the last stamp.
        shortest, longest: steps between neighbouring stamps [ticks].
        count: frames with a stamp.
        missing: frames without one.
        end: packets of the file that belong to it, from the first on; None for all. The clock
            starts anew after them.
    """

    tick: Fraction
    origin: int
    period: Fraction
    variable: bool
    span: int
    shortest: int
    longest: int
    count: int
    missing: int
    end: int | None = None

    @property
    def rate(self) -> Fraction:
        """Frames a second as the container states them."""
        return 1 / (self.period * self.tick)

    @property
    def mean_rate(self) -> Fraction:
        """Frames a second over the whole, which is the `rate` where that is constant."""
        return (
            Fraction(self.count - 1) / (self.span * self.tick)
            if self.variable and self.span
            else self.rate
        )

    @property
    def duration(self) -> float:
        """From the first stamp to the last [s]."""
        return float(self.span * self.tick)


def survey(
    stamps: IntArray,
    *,
    tick: Fraction,
    missing: int,
    fallback_rate: Fraction | None,
    where: str | None = None,
) -> Timing:
    """Reads what the stamps say, (n,) in the order of the file.

    The period of a constant-rate file is the mean step, steps over missing frames left aside: exact
    where single steps are rounded to the container's ticks (33 or 34 ms in Matroska).

    Args:
        fallback_rate: frames a second where there are fewer than two different stamps.

    Raises:
        InputError: fewer than two different stamps and no `fallback_rate`.
    """
    ordered = np.unique(stamps)
    steps = np.diff(ordered)
    if len(steps) == 0:
        if fallback_rate is None:
            raise InputError(
                "fewer than two time stamps: no frame rate",
                where=where,
                fix="give a longer recording",
            )
        period = 1 / (fallback_rate * tick)
        origin = int(ordered[0]) if len(ordered) else 0
        return Timing(
            tick=tick,
            origin=origin,
            period=period,
            variable=False,
            span=0,
            shortest=0,
            longest=0,
            count=len(stamps),
            missing=missing,
        )
    median = float(np.median(steps))
    counts = np.maximum(np.rint(steps / median), 1)
    mean = Fraction(int(steps[counts == 1].sum()), int((counts == 1).sum()))
    off = np.abs(steps - np.rint(steps / float(mean)) * float(mean))
    # Two stamps, each rounded to a tick, put a step off by less than a whole one.
    allowed = max(1.0, 0.01 * float(mean))
    variable = bool(np.mean(off > allowed) > 0.01)
    period = Fraction(round(median)) if variable else mean
    origin, end = int(stamps[:REORDER].min()), int(stamps[-REORDER:].max())
    return Timing(
        tick=tick,
        origin=origin,
        period=period,
        variable=variable,
        span=end - origin if end > origin else int(ordered[-1]) - origin,
        shortest=int(steps.min()),
        longest=int(steps.max()),
        count=len(stamps),
        missing=missing,
    )


class StampRepair(Generic[T]):
    """Makes strictly increasing instants of the stamps of decoded frames; reports what it had to
    do.

    - no stamp: one period after its predecessor;
    - the same stamp as before: two frames cannot share an instant, the later is left out;
    - a single stamp out of order: the frame that lies farther from where the period puts it is left
      out;
    - a jump forward is a gap, and kept as such.

    Holds one frame, to know whether its successor agrees with it.

    Args:
        period: expected step [ns].
    """

    def __init__(self, *, period: int) -> None:
        self._period = period
        self._last: int | None = None
        self._held: tuple[int, T] | None = None
        self._seen = 0
        self._where: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def push(self, stamp: int | None, item: T) -> Iterator[tuple[int, T]]:
        """Offers the next decoded frame; yields the frame before it once its stamp is settled."""
        index = self._seen
        self._seen += 1
        if self._held is None:
            if stamp is None:
                self._note("stamps-missing", index)
                stamp = 0 if self._last is None else self._last + self._period
            self._held = (stamp, item)
            return
        held_stamp, _ = self._held
        if stamp is None:
            self._note("stamps-missing", index)
            stamp = held_stamp + self._period
        if stamp > held_stamp:
            yield from self.finish()
            self._held = (stamp, item)
        elif stamp == held_stamp:
            self._note("stamps-duplicate", index)
        elif self._held_is_the_odd_one(stamp):
            self._note("stamps-disordered", index - 1)
            self._held = (stamp, item)
        else:
            self._note("stamps-disordered", index)

    def finish(self) -> Iterator[tuple[int, T]]:
        """Yields the frame still held."""
        if self._held is not None:
            self._last = self._held[0]
            yield self._held
            self._held = None

    def _held_is_the_odd_one(self, stamp: int) -> bool:
        if self._held is None or self._last is None or stamp <= self._last:
            return False
        return abs(self._held[0] - self._last - self._period) > abs(
            stamp - self._last - 2 * self._period
        )

    def _note(self, kind: str, index: int) -> None:
        self._where.setdefault(kind, index)
        self._counts[kind] = self._counts.get(kind, 0) + 1

    def findings(self) -> list[Finding]:
        kinds = {
            "stamps-missing": (
                Severity.WARNING,
                "frames have no time stamp; each was put one frame period after its predecessor",
            ),
            "stamps-duplicate": (
                Severity.WARNING,
                "frames repeat the time stamp of their predecessor and were left out",
            ),
            "stamps-disordered": (
                Severity.WARNING,
                "frames have a time stamp out of order and were left out",
            ),
        }
        return [
            Finding(
                kind=kind,
                severity=severity,
                what=f"{self._counts[kind]} {text}",
                where=f"frame {self._where[kind]}",
                count=self._counts[kind],
            )
            for kind, (severity, text) in kinds.items()
            if kind in self._counts
        ]


def nanoseconds(ticks: int, *, tick: Fraction, scale: Fraction) -> int:
    """Converts `ticks` × `tick` × `scale` to nanoseconds, rounded to the nearest, half up."""
    factor = tick * scale * NANOSECONDS
    return (2 * ticks * factor.numerator + factor.denominator) // (2 * factor.denominator)
