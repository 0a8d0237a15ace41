"""What conditioning leaves: motion of the cloth's part of the picture that is not the cloth's own.

A camera that is held by hand, before conditioning steadies the film.
"""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray
from models.training.augment.augment import Disturbance, Drawn, Film

_SLOWEST_TURN, _FASTEST_TURN = 0.3, 8.0
"""Frequencies of a hand's motion [Hz]."""
_WAVES = 6
_TURN = 0.002
"""Turn about the optical axis for each pixel of shake [rad]."""


def course(rng: np.random.Generator, times: FloatArray, axes: int) -> FloatArray:
    """Draws paths (n, axes) of mean 0 and root mean square 1: waves of random frequencies, the
    slower the larger."""
    frequency = np.geomspace(_SLOWEST_TURN, _FASTEST_TURN, _WAVES) * rng.uniform(
        0.8, 1.25, (axes, _WAVES)
    )
    phase = rng.uniform(0, 2 * np.pi, (axes, _WAVES))
    waves = np.sin(2 * np.pi * frequency * times[:, None, None] + phase) / np.sqrt(frequency)
    path = waves.sum(axis=2)
    path -= path.mean(axis=0)
    return path / np.maximum(np.sqrt(np.square(path).mean(axis=0)), 1e-9)


def _shake(drawn: Drawn) -> Film:
    """Shakes the camera; the strength is the root mean square shift along each axis [px]."""
    height, width = drawn.film.shape[1:]
    path = drawn.strength * course(drawn.rng, drawn.times, 3)
    shaken = []
    for frame, (x, y, turn) in zip(drawn.film, path, strict=True):
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), np.degrees(_TURN * turn), 1.0)
        matrix[:, 2] += (x, y)
        shaken.append(
            cv2.warpAffine(
                frame,
                matrix,
                (width, height),
                flags=cv2.INTER_CUBIC,
                borderMode=cv2.BORDER_REPLICATE,
            )
        )
    return np.stack(shaken)


SHAKE = Disturbance(apply=_shake, unit="px", most=30.0)


_SLOWEST, _FASTEST = 0.4, 3.0
"""Natural frequencies of poles [Hz]: of a 20 m mast, and of a rod of 2 m."""


def _left_over_shake(drawn: Drawn) -> Film:
    """Moves the film by a camera's motion that was not removed; the strength is its root mean
    square along each axis [px]."""
    path = drawn.strength * course(drawn.rng, drawn.times, 2)
    return _move_frames(drawn, path, np.ones(drawn.film.shape[1:], dtype=np.float32))


def _pole_sway(drawn: Drawn) -> Film:
    """Sways the pole, and the cloth with it: to the sides, the more the higher; the strength is the
    amplitude at the top of the picture [px]."""
    height, width = drawn.film.shape[1:]
    frequency = np.exp(drawn.rng.uniform(np.log(_SLOWEST), np.log(_FASTEST)))
    sway = drawn.strength * np.sin(
        2 * np.pi * frequency * drawn.times + drawn.rng.uniform(0, 2 * np.pi)
    )
    up = np.linspace(1.0, 0.5, height, dtype=np.float32)[:, None]
    return _move_frames(drawn, np.stack([sway, 0 * sway], axis=1), np.repeat(up, width, axis=1))


def _move_frames(drawn: Drawn, path: FloatArray, share: Float32Array) -> Film:
    """Moves each frame by its row of the path times `share`, where it is not frozen."""
    rows, columns = np.indices(drawn.film.shape[1:], dtype=np.float32)
    share = share * drawn.weight
    moved = np.empty_like(drawn.film)
    for index, (x, y) in enumerate(path.astype(np.float32)):
        moved[index] = cv2.remap(
            drawn.film[index],
            columns - share * x,
            rows - share * y,
            cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_REPLICATE,
        )
    return moved


LEFT_OVER_SHAKE = Disturbance(apply=_left_over_shake, unit="px", most=30.0)
POLE_SWAY = Disturbance(apply=_pole_sway, unit="px", most=30.0)
