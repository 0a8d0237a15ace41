"""Winds that samples describe: linear in time between them, one clamp at the ends that the caller
states.

An anemometer's log, a realisation of turbulence and the ways of attachments are read by the same
two functions: `place` finds an instant among times, `between` interpolates there.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from flagdata.core.arrays import FloatArray
from flagdata.core.schema import UNUSABLE
from flagdata.errors import InputError, UsageError
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS

_LONGEST_GAP = 5.0
"""Longest gap of a log that is bridged [s]: large eddies last a few seconds."""


class Beyond(StrEnum):
    """What an instant before the first sample or after the last one gets."""

    HOLD = "hold"
    """The first or the last sample."""
    REFUSE = "refuse"
    """A `UsageError`."""


@dataclass(frozen=True, kw_only=True)
class Even:
    """Times at equal distances.

    Attributes:
        start: the first [s].
        period: between two [s].
        count: how many there are.
    """

    start: float
    period: float
    count: int


Times: TypeAlias = Even | tuple[float, ...]
"""(n,) instants of samples, ascending [s]."""


def place(times: Times, time: float, beyond: Beyond, *, where: str = "wind") -> tuple[int, float]:
    """Returns the sample before an instant [s], and the share of the way from it to the next one,
    from 0 to 1.

    Raises:
        UsageError: an instant outside the times, where that is refused.
    """
    even = isinstance(times, Even)
    first, last = (
        (times.start, times.start + times.period * (times.count - 1))
        if even
        else (times[0], times[-1])
    )
    if beyond is Beyond.REFUSE and not first <= time <= last:
        raise UsageError(
            f"wind asked for at {time:g} s, known from {first:g} to {last:g} s",
            where=where,
            fix="give a series as long as the run, settling included",
        )
    if even:
        exact = min(max((time - times.start) / times.period, 0.0), times.count - 1.0)
        index = min(int(exact), times.count - 2)
        return index, exact - index
    inside = min(max(time, first), last)
    index = min(bisect_right(times, inside), len(times) - 1) - 1
    return index, (inside - times[index]) / (times[index + 1] - times[index])


def between(samples: Tensor, index: int, share: float) -> Tensor:
    """Returns samples (n, …) interpolated behind an index: (…)."""
    return torch.lerp(samples[index], samples[index + 1], share)


def check(times: Times, samples: Tensor, *, where: str) -> None:
    """Refuses times that do not ascend and samples (n, 3, batch or 1) that do not fit them.

    Raises:
        InputError: as said, fewer than two samples, or one that is not finite.
    """
    even = isinstance(times, Even)
    count = times.count if even else len(times)
    if count < 2 or (not times.period > 0 if even else any(b <= a for a, b in pairwise(times))):
        raise InputError(
            "times do not increase, or fewer than two",
            where=where,
            fix="give two or more, in order",
        )
    if samples.ndim != 3 or samples.shape[:2] != (count, 3):
        raise InputError(
            f"samples of shape {tuple(samples.shape)} for {count} times",
            where=where,
            fix="give (time, 3, batch)",
        )
    if not bool(torch.isfinite(samples).all()):
        raise InputError(
            "a sample is not finite",
            where=where,
            fix="leave gaps out; what is between is interpolated",
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledWind:
    """The wind that was sampled, the same everywhere.

    Attributes:
        times: (n,) since the start of the run [s].
        samples: (n, 3, batch) where the air goes to [m/s].
        beyond: what instants outside the times get.

    Raises:
        InputError: see `check`.
    """

    times: Times
    samples: Tensor
    beyond: Beyond

    def __post_init__(self) -> None:
        check(self.times, self.samples, where="sampled wind")

    def velocity(self, time: float) -> Tensor:
        """Returns the velocity (3, batch) [m/s] at a time since the start of the run [s].

        Raises:
            UsageError: see `place`.
        """
        return between(self.samples, *place(self.times, time, self.beyond, where="sampled wind"))


def usable(
    series: WindSeries, *, start: int, where: str
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Returns (n,) times [s], speeds [m/s] and, where logged, directions [rad] of the usable
    samples of a log.

    Args:
        start: instant that times count from, on the log's clock [UTC ns].

    Raises:
        InputError: a log without speeds.
    """
    if "wind_speed" not in series.channels:
        raise InputError(
            "there is no channel wind_speed", where=where, fix="give a log of a wind speed"
        )
    speed, direction = series.channels["wind_speed"], series.channels.get("wind_direction")
    good = ((series.flags & UNUSABLE) == 0) & np.isfinite(speed)
    if direction is not None:
        good &= np.isfinite(direction)
        direction = direction[good]
    return (series.time[good] - start) / NANOSECONDS, speed[good], direction


def about_mean(
    time: ArrayLike, speed: ArrayLike, direction: ArrayLike | None, *, where: str
) -> tuple[FloatArray, float, NDArray[np.complex128]]:
    """Returns times (n,) [s], the speed of the vector mean [m/s], and deviations from it as shares
    of it: (n,) complex, along the mean wind and, imaginary, to its left.

    Args:
        time: (n,) [s].
        speed: (n,) [m/s].
        direction: (n,) blowing from, clockwise from north [rad]; None to leave it constant.

    Raises:
        InputError: gaps of more than 5 s, a mean of 0, or shapes that do not fit.
    """
    t, s = np.asarray(time, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    from_north = np.zeros_like(s) if direction is None else np.asarray(direction, dtype=np.float64)
    if not (t.ndim == 1 and t.shape == s.shape == from_north.shape and len(t) > 1):
        raise InputError(
            f"shapes {t.shape}, {s.shape}, {from_north.shape}",
            where=where,
            fix="give (n,) each, n > 1",
        )
    widest = float(np.max(np.diff(t)))
    if widest > _LONGEST_GAP:
        raise InputError(
            f"the log has a gap of {widest:.1f} s",
            where=where,
            fix=f"choose a stretch without gaps of more than {_LONGEST_GAP:g} s",
        )
    mean = complex(np.mean(s * np.exp(1j * from_north)))
    if not abs(mean) > 0:
        raise InputError("the mean wind is zero", where=where, fix="choose a stretch with wind")
    # Clockwise from above is a turn to the right: the conjugate.
    return t, abs(mean), np.conj(s * np.exp(1j * from_north) / mean) - 1
