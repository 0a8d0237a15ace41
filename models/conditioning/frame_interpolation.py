"""Pictures at instants between the frames of a film, by motion-compensated interpolation.

Between frames A at 0 and B at 1 the optical flows F (A to B) and G (B to A) are found by dense
inverse search (Kroeger et al., Fast Optical Flow using Dense Inverse Search, ECCV 2016). The flows
from the instant t back to both frames follow from motion along straight lines (Jiang et al., Super
SloMo, CVPR 2018, equation 4),

    F_{t→0} = −(1 − t) t F + t² G,        F_{t→1} = (1 − t)² F − t (1 − t) G,

and the picture is (1 − t) A(x + F_{t→0}) + t B(x + F_{t→1}). Where nothing moves this is the mean
of both frames.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import Float32Array, UInt8Array

_FLOWS = 8
"""Pairs of frames whose flows are kept: windows at several sizes of flag meet the same pairs
again."""
NEAR = 0.25
"""Share of the time between two frames within which an instant is shown by the nearer one. A
nearest frame makes the motion uneven, an interpolated one smooths it, and the wind that the network
reads moves down with the one and up with the other; at this share films of 25, 30 and 60 frames a
second agree (decision 035)."""
NEAR_OF_SLOW = 0.4
"""The same of a film slower than the network's frames, between which more of the motion is lost."""
TimedFrame = tuple[float, UInt8Array]
"""Time from the film's first frame [s], and the picture, (height, width) gray."""


def at_instants(
    frames: Sequence[TimedFrame],
    instants: NDArray[np.floating],
    *,
    period: float,
    interpolator: Interpolator,
) -> tuple[UInt8Array, int]:
    """Resamples a film at n instants: (n, height, width) pictures, and how many of them were
    interpolated.

    Args:
        frames: two or more, in order.
        instants: [s], evenly; one before the first frame is shown by that, one beyond the last by
            the last.
        period: of the film [s].
    """
    tolerance = NEAR if period <= instants[1] - instants[0] else NEAR_OF_SLOW
    times = np.array([time for time, _ in frames])
    before = np.searchsorted(times, instants, side="right").clip(1, len(times) - 1) - 1
    fractions = ((instants - times[before]) / (times[before + 1] - times[before])).clip(0.0, 1.0)
    pictures, interpolated = [], 0
    for k, instant, fraction in zip(
        before.tolist(), instants.tolist(), fractions.tolist(), strict=True
    ):
        nearest = round(fraction)
        if abs(fraction - nearest) <= tolerance:
            pictures.append(frames[k + nearest][1])
        else:
            pictures.append(interpolator.between(frames[k], frames[k + 1], instant))
            interpolated += 1
    return np.stack(pictures), interpolated


class Interpolator:
    """Pictures between frames of one film. Flows of the last pairs are kept.

    Args:
        capacity: how many are kept.
    """

    def __init__(self, *, capacity: int = _FLOWS) -> None:
        self._kept = capacity
        # The search divides the picture among threads, and its result depends on how many there
        # are.
        cv2.setNumThreads(1)
        self._search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._flows: dict[tuple[float, float], tuple[Float32Array, Float32Array]] = {}

    def between(
        self, first: tuple[float, UInt8Array], second: tuple[float, UInt8Array], instant: float
    ) -> UInt8Array:
        """Interpolates a picture (height, width) gray at an instant from the first frame's to the
        second's.

        Args:
            first, second: (time [s], (height, width) gray) of frames that follow each other.
            instant: [s].
        """
        (begin, a), (end, b) = first, second
        t = (instant - begin) / (end - begin)
        forward, backward = self._flow(first, second)
        rows, columns = np.indices(a.shape, dtype=np.float32)
        to_first = t * t * backward - (1 - t) * t * forward
        to_second = (1 - t) ** 2 * forward - t * (1 - t) * backward
        from_first, from_second = (
            cv2.remap(
                picture,
                columns + flow[..., 0],
                rows + flow[..., 1],
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
            for picture, flow in ((a, to_first), (b, to_second))
        )
        return cv2.addWeighted(from_first, 1 - t, from_second, t, 0.0).astype(np.uint8)

    def _flow(
        self, first: tuple[float, UInt8Array], second: tuple[float, UInt8Array]
    ) -> tuple[Float32Array, Float32Array]:
        """Returns (height, width, 2) flows from the first frame to the second and back [px, x then
        y]."""
        key = (first[0], second[0])
        if key not in self._flows:
            while len(self._flows) >= self._kept:
                self._flows.pop(next(iter(self._flows)))
            self._flows[key] = (
                self._interpolate_between(first[1], second[1]),
                self._interpolate_between(second[1], first[1]),
            )
        return self._flows[key]

    def _interpolate_between(self, a: UInt8Array, b: UInt8Array) -> Float32Array:
        start = np.zeros((*a.shape, 2), dtype=np.float32)
        return np.asarray(
            self._search.calc(np.ascontiguousarray(a), np.ascontiguousarray(b), start), np.float32
        )
