"""What else moves at the rim of a picture: a tree that sways, a second flag."""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.core.arrays import Float32Array
from models.training.augment.augment import Disturbance, Drawn, Film

_SLOWEST, _FASTEST = 0.3, 2.5
"""Frequencies at which twigs sway [Hz]."""
_WAVES = 3
_WIDE = (0.06, 0.16)
"""Width of a tree at the rim, in widths of the picture."""
_FEATHER = 0.02
"""Width over which a second flag's picture goes over into the film's, in widths of the picture."""


def _tree(drawn: Drawn) -> Film:
    """Leaves along one side of the picture, drawn anew; the strength is the amplitude of their
    motion [px]."""
    rng, film = drawn.rng, drawn.film
    quarters = int(rng.integers(4))
    turned = np.rot90(film, k=quarters, axes=(1, 2)).copy()
    height, width = turned.shape[1:]
    wide = max(4, round(width * rng.uniform(*_WIDE)))
    leaf = rng.uniform(0.006, 0.02) * height
    texture = _fields(rng, (1, height, wide), leaf)[0]
    level, contrast = rng.uniform(30, 160), rng.uniform(10, 45)
    leaves = np.clip(level + contrast * texture, 0, 255).astype(np.float32)
    edge = _fields(rng, (1, height, wide), 3 * leaf)[0] - np.linspace(
        -2.5, 2.5, wide, dtype=np.float32
    )
    cover = np.clip(2 * edge + 0.5, 0, 1).astype(np.float32)
    patterns = _fields(rng, (2 * _WAVES, height, wide), 4 * leaf).reshape(2, _WAVES, height, wide)
    phases = 2 * np.pi * _fields(rng, (1, height, wide), 12 * leaf)[0]
    turn = 2 * np.pi * np.exp(rng.uniform(np.log(_SLOWEST), np.log(_FASTEST), _WAVES))
    rows, columns = np.indices((height, wide), dtype=np.float32)
    for frame, time in zip(turned, drawn.times, strict=True):
        waves = np.sin(turn[:, None, None] * time + phases) * (drawn.strength / _WAVES**0.5)
        across, down = (patterns * waves).sum(axis=1).astype(np.float32)
        moved, covering = (
            cv2.remap(
                field,
                columns + across,
                rows + down,
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REFLECT,
            )
            for field in (leaves, cover)
        )
        part = frame[:, :wide]
        frame[:, :wide] = np.rint(part + covering * (moved - part))
    return np.ascontiguousarray(np.rot90(turned, k=-quarters, axes=(1, 2)))


def _second_flag(drawn: Drawn) -> Film:
    """Pastes another film's picture, small, at a corner; the strength is its side, in sides of the
    picture."""
    rng, film, other_film = drawn.rng, drawn.film.copy(), drawn.other()
    height, width = film.shape[1:]
    side = max(8, round(drawn.strength * min(height, width)))
    there_and_back = np.concatenate(
        [np.arange(len(other_film)), np.arange(len(other_film))[-2:0:-1]]
    )
    first = int(rng.integers(len(there_and_back)))
    feather = max(1, round(_FEATHER * width))
    ramp = np.minimum(np.arange(1, side + 1), np.arange(side, 0, -1)) / feather
    cover = np.clip(np.minimum(ramp[:, None], ramp[None]), 0, 1).astype(np.float32)
    top = 0 if rng.random() < 0.5 else height - side
    left = 0 if rng.random() < 0.5 else width - side
    for index, frame in enumerate(film):
        picture = other_film[there_and_back[(first + index) % len(there_and_back)]]
        small = cv2.resize(picture, (side, side), interpolation=cv2.INTER_AREA).astype(np.float32)
        part = frame[top : top + side, left : left + side]
        part[:] = np.rint(part + cover * (small - part))
    return film


def _fields(rng: np.random.Generator, shape: tuple[int, int, int], length: float) -> Float32Array:
    """Draws smooth random fields of variance 1 and a correlation length [px]."""
    fields = []
    for white in rng.standard_normal(shape, dtype=np.float32):
        smooth = cv2.GaussianBlur(white, (0, 0), length)
        fields.append((smooth - smooth.mean()) / max(float(smooth.std()), 1e-9))
    return np.stack(fields)


TREE = Disturbance(apply=_tree, unit="px", most=30.0)
SECOND_FLAG = Disturbance(apply=_second_flag, unit="sides of the picture", least=0.05, most=0.5)
