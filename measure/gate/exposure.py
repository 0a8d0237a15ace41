"""Light: how bright a clip is, what contrast it has, and how much of it is noise."""

from __future__ import annotations

import numpy as np

from measure.gate.clip_statistics import ClipStatistics


def level(clip: ClipStatistics) -> float:
    """Mean gray level, 0 to 255."""
    return float(clip.mean.mean())


def highlights(clip: ClipStatistics) -> float:
    """Gray level below which 99 % of the mean picture lies."""
    return float(np.quantile(clip.mean, 0.99))


def contrast(clip: ClipStatistics) -> float:
    """Common logarithm of the standard deviation of the mean picture [gray levels]."""
    return float(np.log10(max(clip.contrast, 1e-2)))


def noise(clip: ClipStatistics) -> float:
    """Common logarithm of the noise's deviation over the contrast of the mean picture."""
    return float(np.log10(max(clip.still, 1e-2) / max(clip.contrast, 1e-2)))
