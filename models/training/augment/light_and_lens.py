"""Light, lens and sensor: blur, the tone curve, too little light, noise."""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.core.arrays import Float32Array
from models.training.augment.augment import Disturbance, Drawn, Film


def _blur(drawn: Drawn) -> Film:
    """Blurs the film as out of focus; the strength is the standard deviation of a Gaussian [px]."""
    if drawn.strength == 0:
        return drawn.film
    return np.stack([cv2.GaussianBlur(frame, (0, 0), drawn.strength) for frame in drawn.film])


def _gamma(drawn: Drawn) -> Film:
    """Applies another tone curve; the strength is the power that gray levels are raised to."""
    curve = 255 * (np.arange(256) / 255) ** drawn.strength
    return np.rint(curve).astype(np.uint8)[drawn.film]


def _dusk(drawn: Drawn) -> Film:
    """Less light: all gray levels times the strength."""
    return np.rint(np.arange(256) * drawn.strength).astype(np.uint8)[drawn.film]


def _noise(drawn: Drawn) -> Film:
    """Adds a sensor's noise; the strength is its standard deviation [gray levels]."""
    noise: Float32Array = drawn.rng.standard_normal(drawn.film.shape, dtype=np.float32)
    return np.clip(np.rint(drawn.film + np.float32(drawn.strength) * noise), 0, 255).astype(
        np.uint8
    )


BLUR = Disturbance(apply=_blur, unit="px", most=10.0)
GAMMA = Disturbance(apply=_gamma, unit="", least=0.2, most=5.0)
DUSK = Disturbance(apply=_dusk, unit="", least=0.02, most=1.0)
NOISE = Disturbance(apply=_noise, unit="gray levels", most=64.0)
