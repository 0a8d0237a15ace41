"""Which part of a film a network sees: the paper's augmentation (supplement, "Data Augmentation")
and the plain view.

A random run of successive frames, a square of one of several sizes at a random place, resized to
the network's, and a mirror image half of the time. A mirrored clip has the same wind speed and
cloth, and networks estimate nothing that has a side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from flagdata.core.arrays import UInt8Array
from flagdata.errors import InputError

LEAST_SCALE = 0.05
"""Least side of a crop, as a share of the picture's."""


@dataclass(frozen=True, kw_only=True)
class Crop:
    """A part of a film.

    Attributes:
        first: frame it begins with.
        top, left, side: of the square [px].
        mirrored: left and right exchanged.
    """

    first: int
    top: int
    left: int
    side: int
    mirrored: bool


@dataclass(frozen=True, kw_only=True)
class Cropping:
    """How parts of films are chosen.

    Attributes:
        frames: of a clip.
        size: it is resized to [px].
        scales: sides of the squares, as shares of the film's shorter side; one is drawn each time.
        mirror: whether half of the crops are mirror images.
        conditioned: whether films are conditioned before (`models.conditioning`), and shown at the
            network's instants whatever their rate.

    Raises:
        InputError: no scale, or one outside of [`LEAST_SCALE`, 1].
    """

    frames: int = 30
    size: int = 224
    scales: tuple[float, ...] = (1.0, 0.9, 0.8)
    mirror: bool = True
    conditioned: bool = False
    JSON_OPTIONAL: ClassVar = frozenset({"conditioned"})

    def __post_init__(self) -> None:
        if not self.scales or not all(LEAST_SCALE <= scale <= 1 for scale in self.scales):
            raise InputError(
                f"the scales of crops are {self.scales}",
                fix=f"give shares of the picture, from {LEAST_SCALE:g} to 1",
            )

    def draw(self, rng: np.random.Generator, shape: tuple[int, int, int]) -> Crop:
        """Draws a random part of a film of (frames, height, width).

        Raises:
            InputError: the film is shorter than a clip.
        """
        count, height, width = self._check_shape(shape)
        side = round(float(rng.choice(self.scales)) * min(height, width))
        return Crop(
            first=int(rng.integers(count - self.frames + 1)),
            top=int(rng.integers(height - side + 1)),
            left=int(rng.integers(width - side + 1)),
            side=side,
            mirrored=bool(self.mirror and rng.integers(2)),
        )

    def whole(self, shape: tuple[int, int, int], *, first: int = 0) -> Crop:
        """Returns the largest square about the middle of a film of (frames, height, width), from
        frame `first` on.

        Raises:
            InputError: the film ends before the clip does.
        """
        count, height, width = self._check_shape(shape)
        if first + self.frames > count:
            raise InputError(
                f"{count} frames end before frame {first + self.frames}", fix="begin earlier"
            )
        side = min(height, width)
        return Crop(
            first=first,
            top=(height - side) // 2,
            left=(width - side) // 2,
            side=side,
            mirrored=False,
        )

    def cut(self, film: UInt8Array, crop: Crop) -> Tensor:
        """Cuts the part out of a film (frames, height, width): (1, frames, size, size), uint8 where
        nothing was resized, else float32 (bilinear; averaging where it shrinks)."""
        part = film[
            crop.first : crop.first + self.frames,
            crop.top : crop.top + crop.side,
            crop.left : crop.left + crop.side,
        ]
        clip = torch.from_numpy(np.ascontiguousarray(part[..., ::-1] if crop.mirrored else part))
        if crop.side == self.size:
            return clip[None]
        size = (self.size, self.size)
        return functional.interpolate(
            clip[None].float(), size, mode="bilinear", antialias=True, align_corners=False
        )

    def _check_shape(self, shape: tuple[int, int, int]) -> tuple[int, int, int]:
        if shape[0] < self.frames:
            raise InputError(f"the film has {shape[0]} frames", fix=f"give at least {self.frames}")
        return shape
