"""Light: how bright a clip is, what contrast it has, and how much of it is noise."""

from __future__ import annotations

import numpy as np

from measure.gate.seen import Seen


def level(seen: Seen) -> float:
    """Mean gray level, 0 to 255."""
    return float(seen.mean.mean())


def highlights(seen: Seen) -> float:
    """Gray level below which 99 % of the mean picture lies."""
    return float(np.quantile(seen.mean, 0.99))


def contrast(seen: Seen) -> float:
    """Common logarithm of the standard deviation of the mean picture [gray levels]."""
    return float(np.log10(max(seen.contrast, 1e-2)))


def noise(seen: Seen) -> float:
    """Common logarithm of the noise's deviation over the contrast of the mean picture."""
    return float(np.log10(max(seen.still, 1e-2) / max(seen.contrast, 1e-2)))
