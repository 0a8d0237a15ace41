"""Frames in time: repeated ones, loops, and a motion that stops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from measure.gate.clip_statistics import ClipStatistics

_LEAST = 0.02
"""Gray levels of mean change that count as none."""
_SHORTEST_LOOP = 4


def held(clip: ClipStatistics) -> float:
    """Common logarithm of the lower quartile of the changes from frame to frame over their 90 % quantile.

    Near 0 where each frame differs from the last; very low where at least a quarter of them repeat it.
    """
    low, high = np.quantile(_changes(clip), (0.25, 0.9))
    return float(np.log10((low + _LEAST) / (high + _LEAST)))


def uneven(clip: ClipStatistics) -> float:
    """How far each change is from the mean of its neighbours, over the mean change: 0 for smooth motion."""
    change = _changes(clip)
    if len(change) < 3:
        return 0.0
    middle = 0.5 * (change[2:] + change[:-2])
    return float(np.abs(change[1:-1] - middle).mean() / (change.mean() + _LEAST))


def stopped(clip: ClipStatistics) -> float:
    """Common logarithm of the mean change over the last third of the clip over that of the whole clip."""
    change = _changes(clip)
    return float(np.log10((change[-(len(change) // 3) :].mean() + _LEAST) / (change.mean() + _LEAST)))


def loop(clip: ClipStatistics) -> float:
    """Common logarithm of the smallest mean difference of frames a lag apart over the median lag's.

    Lags are 4 frames to two thirds of the clip. Flutter comes near its shape of a period ago, a loop repeats it.
    """
    lags = range(_SHORTEST_LOOP, 2 * len(clip.gray) // 3)
    pixels = clip.gray[:, clip.moving] if clip.moving.any() else clip.gray.reshape(len(clip.gray), -1)
    if not lags:
        return 0.0
    apart = np.array([np.abs(pixels[lag:] - pixels[:-lag]).mean() for lag in lags])
    return float(np.log10((apart.min() + _LEAST) / (np.median(apart) + _LEAST)))


def _changes(clip: ClipStatistics) -> NDArray[np.float64]:
    """(n − 1,), mean absolute change from frame to frame over the moving pixels, or over all if none moves."""
    pixels = clip.gray[:, clip.moving] if clip.moving.any() else clip.gray.reshape(len(clip.gray), -1)
    return np.abs(np.diff(pixels, axis=0)).mean(axis=1).astype(np.float64)
