"""Motion and wind on one grid of bins, so that every trial offset is a choice of samples."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from flagdata.align.film_motion import MotionSeries
from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from flagdata.record.signals import Instants, Series, WindAverage
from flagdata.timebase import NANOSECONDS

STEPS = 10
"""Trial offsets per wind bin."""

_OFF_GRID = 0.05  # of a bin
_COVERED = 0.5  # of the frames a bin should hold


@dataclass(frozen=True, kw_only=True)
class LagBins:
    """Normal scores of wind and motion, arranged for trial offsets.

    With `m` trial offsets, wind bin k at trial offset i belongs to motion sample `STEPS · k + (m −
    1 − i)`.

    Attributes:
        offsets: (m,) trial offsets, to be added to the camera's clock [s].
        wind: (n,) normal scores of the binned wind speed, NaN in gaps.
        motion: (STEPS · (n − 1) + m,) normal scores of the motion, averaged over a bin that ends at
            each step; NaN where too few frames cover it.
        first: instant of motion sample 0 on the camera's clock [UTC ns].
        period: length of a bin [s].
        gustiness: standard deviation over mean of the wind speed, over the bins that the recording
            can touch.
    """

    offsets: Series
    wind: Series
    motion: Series
    first: int
    period: float
    gustiness: float

    @classmethod
    def of(
        cls, motion: MotionSeries, wind: WindAverage, *, centre: float, window: float
    ) -> LagBins:
        """Bins `motion` like `wind`, for offsets from centre − window to centre + window [s].

        Raises:
            InputError: nothing to bin, wind bins that are not on one grid, or fewer than two motion
                values a bin.
        """
        period = round(wind.period * NANOSECONDS)
        step = round(period / STEPS)
        if len(wind.time) == 0 or np.count_nonzero(np.isfinite(motion.energy)) < 2:
            raise InputError(
                "there are no wind bins or no motion to compare",
                fix="check both inputs; see their reports",
            )
        spacing = float(np.median(np.diff(motion.time)))
        if spacing * 2 > period:
            raise InputError(
                f"motion comes every {spacing / NANOSECONDS:g} s, which is too slow for wind bins "
                f"of {wind.period:g} s",
                fix="average the wind over longer bins",
            )
        lowest = round((centre - window) * NANOSECONDS / step)
        count = 2 * math.ceil(window * NANOSECONDS / step) + 1
        highest = lowest + count - 1
        in_reach = (wind.time >= motion.time[0] + lowest * step) & (
            wind.time <= motion.time[-1] + highest * step + period
        )
        if not np.any(in_reach):
            raise InputError(
                "the wind log and the film do not overlap at any offset searched",
                fix="check start times and zones, or give --centre and a wider --search",
            )
        time, speed = wind.time[in_reach], wind.speed[in_reach]
        index = np.rint((time - time[0]) / period).astype(np.int64)
        if np.any(np.abs(time - time[0] - index * period) > _OFF_GRID * period):
            raise InputError(
                "the wind bins are not on one regular grid", fix="average the wind series anew"
            )
        if np.any(np.diff(index) < 1):
            raise InputError("two wind bins are at one time", fix="average the wind series anew")
        scores = np.full(int(index[-1]) + 1, np.nan)
        scores[index] = normal_scores(speed)
        first = int(time[0]) - highest * step
        ends = first + step * np.arange(STEPS * (len(scores) - 1) + count, dtype=np.int64)
        finite = speed[np.isfinite(speed)]
        mean = float(np.mean(finite)) if len(finite) else 0.0
        return cls(
            offsets=np.asarray(
                (lowest + np.arange(count)) * (step / NANOSECONDS), dtype=np.float64
            ),
            wind=scores,
            motion=normal_scores(_means(motion, ends, period, period / spacing)),
            first=first,
            period=period / NANOSECONDS,
            gustiness=float(np.std(finite)) / mean if mean > 0 else 0.0,
        )

    def index(self, trial: int) -> slice:
        """Selects the motion samples that belong to the wind bins at trial offset number
        `trial`."""
        start = len(self.offsets) - 1 - trial
        return slice(start, start + STEPS * (len(self.wind) - 1) + 1, STEPS)

    def middle(self, trial: int) -> int:
        """Computes the middle of what both cover at a trial offset, on the camera's clock [UTC
        ns]."""
        compared = np.flatnonzero(
            np.isfinite(self.wind) & np.isfinite(self.motion[self.index(trial)])
        )
        centre = (
            float(compared[0] + compared[-1]) / 2 if len(compared) else (len(self.wind) - 1) / 2
        )
        step = self.period * NANOSECONDS / STEPS
        return self.first + round((self.index(trial).start + STEPS * centre - STEPS / 2) * step)

    def windows(self, samples: FloatArray, trials: slice) -> FloatArray:
        """Views `samples` (as long as `motion`) as (trials, n): the row of each trial offset."""
        rows = np.lib.stride_tricks.sliding_window_view(samples, STEPS * (len(self.wind) - 1) + 1)[
            :, ::STEPS
        ]
        return rows[::-1][trials]


def normal_scores(values: Series) -> Series:
    """Computes Φ⁻¹((rank − ½) / n) of the finite values, ties sharing their mean rank; NaN stays
    NaN (van der Waerden, 1952)."""
    scores = np.full(values.shape, np.nan)
    finite = np.isfinite(values)
    count = int(np.count_nonzero(finite))
    if count:
        _, rank_index, ties = np.unique(values[finite], return_inverse=True, return_counts=True)
        rank = np.cumsum(ties) - (ties - 1) / 2
        scores[finite] = ndtri((rank[rank_index] - 0.5) / count)
    return scores


def _means(motion: MotionSeries, ends: Instants, period: int, expected: float) -> Series:
    """Computes the mean energy over a triangle of width 2 bins about the middle of the bin that
    ends at each instant.

    NaN where under half of the frames expected in the bin itself are. The triangle, a box drawn
    over a box, keeps what moves faster than the bins from folding down into them: it would ripple
    the score with the period of a bin.
    """
    finite = np.isfinite(motion.energy)
    time = motion.time[finite]
    total = np.concatenate([[0.0], np.cumsum(motion.energy[finite])])
    low, high = np.searchsorted(time, ends - period), np.searchsorted(time, ends)
    count = high - low
    enough = count >= max(1.0, _COVERED * expected)
    boxes = np.where(enough, (total[high] - total[low]) / np.maximum(count, 1), np.nan)
    # The box over the box: from half a bin before to half a bin after.
    is_present = enough.astype(np.float64)
    kernel = np.ones(STEPS + 1)
    kernel[[0, -1]] = 0.5
    weight = np.convolve(is_present, kernel, mode="same")
    sums = np.convolve(np.where(enough, boxes, 0.0), kernel, mode="same")
    return np.where(enough, sums / np.maximum(weight, 0.5), np.nan)
