"""What moves in a clip: how much, where, in how many places, and whether the picture's edge cuts
it."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import ndimage

from flagdata.core.arrays import BoolArray, Float32Array, FloatArray
from measure.gate.clip_statistics import SIDE, ClipStatistics

_EDGE = 3
"""Width [px] of the strip along a side in which motion is called cut off."""
_SMOOTHING = 3.0
"""σ [px] by which the motion is smoothed before its regions are separated: folds of one flag are
one region. Less takes folds for regions; more joins two flags to one."""
_REGION = 0.15
"""Share of the strongest smoothed motion above which a pixel belongs to a region. Lower joins what
moves faintly to the flag; higher breaks a flag with a calm part in two."""
LEAST_AREA = 1 / SIDE**2


def area(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the share of the picture that moves."""
    return float(np.log10(max(float(clip.moving.mean()), LEAST_AREA)))


def energy(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the mean variance in time beyond noise over the variance of
    the mean picture."""
    return float(np.log10(max(float(clip.excess.mean()), 1e-4) / max(clip.contrast, 1e-2) ** 2))


def strength(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the strongest deviation in time (99.5 % of the pixels' lie
    below) over the noise's."""
    return float(
        np.log10(max(float(np.quantile(clip.deviation, 0.995)), 1e-2) / max(clip.still, 0.1))
    )


def at_edge(clip: ClipStatistics) -> float:
    """Computes the root mean deviation in a strip along the side where it is largest, over that of
    the moving part."""
    if not clip.moving.any():
        return 0.0
    inside = float(clip.excess[clip.moving].mean())
    amplitude = np.sqrt(clip.excess)
    strips = (amplitude[:_EDGE], amplitude[-_EDGE:], amplitude[:, :_EDGE], amplitude[:, -_EDGE:])
    return max(float(strip.mean()) for strip in strips) / np.sqrt(inside)


def around(clip: ClipStatistics) -> float:
    """Computes the share of the outermost eighth of the picture, on all four sides, that moves."""
    ring = np.ones_like(clip.moving)
    width = SIDE // 8
    ring[width:-width, width:-width] = False
    return float(clip.moving[ring].mean())


def off_centre(clip: ClipStatistics) -> float:
    """Computes the distance of the motion's centre of mass from the picture's middle, in sides of
    the picture."""
    if not clip.moving.any():
        return 0.0
    amplitude = np.sqrt(clip.excess)
    places = (np.arange(SIDE) - (SIDE - 1) / 2) / SIDE
    y, x = (float(amplitude.sum(axis=axis) @ places / amplitude.sum()) for axis in (1, 0))
    return float(np.hypot(y, x))


def width(clip: ClipStatistics) -> float:
    """Computes the width with 90 % of the motion, in sides of the picture."""
    return _extent(np.sqrt(clip.excess).sum(axis=0))


def height(clip: ClipStatistics) -> float:
    """Computes the height with 90 % of the motion, in sides of the picture."""
    return _extent(np.sqrt(clip.excess).sum(axis=1))


def second_region(clip: ClipStatistics) -> float:
    """Computes the motion of the second strongest separate region over that of the strongest, 0 to
    1."""
    amplitude = np.asarray(
        ndimage.gaussian_filter(np.sqrt(clip.excess), _SMOOTHING), dtype=np.float32
    )
    if amplitude.max() <= 0:
        return 0.0
    masses = _masses(amplitude > _REGION * amplitude.max(), amplitude)
    return float(masses[-2] / masses[-1]) if len(masses) > 1 else 0.0


def scatter(clip: ClipStatistics) -> float:
    """Computes the share of the motion outside of the largest region of moving pixels that
    touch."""
    masses = _masses(clip.moving, np.sqrt(clip.excess))
    return 1 - float(masses[-1] / masses.sum()) if len(masses) else 0.0


def edges_moving(clip: ClipStatistics) -> float:
    """Computes the share of the mean picture's edges, its steepest tenth, that move: all of them
    where the camera does."""
    steep = clip.slope >= np.quantile(clip.slope, 0.9)
    return float(clip.moving[steep].mean())


def _masses(inside: BoolArray, amplitude: Float32Array) -> FloatArray:
    """Sums the amplitude over the connected regions, ascending."""
    labelling: Any = ndimage.label(inside)
    labels, count = labelling
    return np.sort(
        np.asarray(ndimage.sum_labels(amplitude, labels, np.arange(1, count + 1)), dtype=np.float64)
    )


def _extent(profile: Float32Array) -> float:
    total = np.cumsum(profile, dtype=np.float64)
    if total[-1] <= 0:
        return 0.0
    low, high = np.searchsorted(total / total[-1], (0.05, 0.95))
    return float(high - low + 1) / SIDE
