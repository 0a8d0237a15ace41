"""A camera that is held by hand, before conditioning steadies the film."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.augment.augment import Disturbance, Drawn, Film

_SLOWEST, _FASTEST = 0.3, 8.0
"""Frequencies of a hand's motion [Hz]."""
_WAVES = 6
_TURN = 0.002
"""Turn about the optical axis for each pixel of shake [rad]."""


def course(rng: np.random.Generator, times: NDArray[np.float64], axes: int) -> NDArray[np.float64]:
    """(n, axes) of mean 0 and root mean square 1: waves of random frequencies, the slower the larger."""
    frequency = np.geomspace(_SLOWEST, _FASTEST, _WAVES) * rng.uniform(0.8, 1.25, (axes, _WAVES))
    phase = rng.uniform(0, 2 * np.pi, (axes, _WAVES))
    waves = np.sin(2 * np.pi * frequency * times[:, None, None] + phase) / np.sqrt(frequency)
    path = waves.sum(axis=2)
    path -= path.mean(axis=0)
    return path / np.maximum(np.sqrt(np.square(path).mean(axis=0)), 1e-9)


def _shake(drawn: Drawn) -> Film:
    """The strength is the root mean square shift along each axis [px]."""
    height, width = drawn.film.shape[1:]
    path = drawn.strength * course(drawn.rng, drawn.times, 3)
    shown = []
    for frame, (x, y, turn) in zip(drawn.film, path, strict=True):
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), np.degrees(_TURN * turn), 1.0)
        matrix[:, 2] += (x, y)
        shown.append(
            cv2.warpAffine(frame, matrix, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        )
    return np.stack(shown)


SHAKE = Disturbance(apply=_shake, unit="px", most=30.0)
