"""Clocks of containers: counters of 32 or 33 bits that pass their end, and clocks that start anew
within a file.

A transport stream counts to 2³³ at 90 kHz, which is 26.5 h (ISO/IEC 13818-1, 2.4.3.7). FFmpeg takes
a stamp that lies more than a minute before the first one for a wrap, so that two takes in one file
would be a day apart; its correction is switched off, and the stamps are judged here. A counter has
passed its end only where the step, modulo its length, is as short as between frames of one
recording. Any other jump back is a clock that started anew. Nothing states how long the
interruption was, so that the frames after it have no known time: in any container they are left out
and reported. They are ingested as a file of their own, whose start the user gives.
"""

from __future__ import annotations

from fractions import Fraction

import av
import numpy as np

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding

COUNTERS = {"mpegts": 1 << 33, "mpeg": 1 << 33, "flv": 1 << 32, "asf": 1 << 32}
"""Containers, by FFmpeg's names, whose stamps are counted modulo so many ticks."""
REORDER = 32
"""Packets within which the order of presentation differs from that of the file: no codec reorders
by more than 16."""
_RESET = 1  # s; a step back by more is a clock that started anew, not a slip
_ACROSS = (
    10  # s; the longest step across the end of a counter: a frame period, or a few lost packets
)


class Counter:
    """Makes the stamps of successive packets run on where their counter passes its end.

    Args:
        length: ticks after which the counter starts again; None for one that does not.
        tick: seconds of one stamp unit.
    """

    def __init__(self, *, length: int | None, tick: Fraction) -> None:
        self._length = length
        self._across = int(_ACROSS / tick)
        self._last: int | None = None
        self._shift = 0

    def run_on(self, packet: av.Packet) -> None:
        """Replaces the stamps of the next packet of the file."""
        if self._length is None:
            return
        packet.pts, packet.dts = (
            self._unwrapped_count(stamp, self._length) for stamp in (packet.pts, packet.dts)
        )

    def _unwrapped_count(self, stamp: int | None, length: int) -> int | None:
        if stamp is None:
            return None
        counted = stamp + self._shift
        if self._last is not None:
            step = (counted - self._last + length // 2) % length - length // 2
            if abs(step) <= self._across:
                counted = self._last + step
        self._last, self._shift = counted, counted - stamp
        return counted


def restart(stamps: IntArray, *, tick: Fraction) -> int | None:
    """Finds the first of some stamps whose clock started anew; None where it never did.

    A single stamp that is wrong, or a few, are no restart: the stamps around them agree with each
    other.

    Args:
        stamps: (n,) [ticks], in the order of the file.
    """
    if len(stamps) < 2:
        return None
    steps = np.diff(stamps)
    forward = steps[steps > 0]
    period = float(np.median(forward)) if len(forward) else 0.0
    # Presentation in another order than the file's steps back by up to half of `REORDER` frames.
    back = max(float(_RESET / tick), (REORDER // 2 + 1) * period)
    for index in np.flatnonzero(steps < -back) + 1:
        before, after = (
            stamps[max(0, index - REORDER // 2) : index],
            stamps[index : index + REORDER // 2],
        )
        if np.median(after) < np.median(before):
            return int(index)
    return None


def restarted_finding(*, frame: int, after: float, count: int) -> Finding:
    """Reports that the clock started anew.

    Args:
        frame: number of the first frame that is left out.
        after: time from the first frame to there [s].
        count: frames that are left out.
    """
    return Finding.of(
        "clock-reset",
        f"the camera's clock started anew after {after:.2f} s; nothing states how long it was "
        "interrupted, so "
        f"that the {count} frames after it have no known time and were left out",
        where=f"frame {frame}",
        count=count,
        fix="cut the file there and ingest the second part by itself, with the --start of its "
        "first frame",
    )
