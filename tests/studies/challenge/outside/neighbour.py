"""A larger flag or sign upwind that swings at its own frequency and throws the wind from side to
side."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import NOT_NEGATIVE, FlowEffect, Value, horizontal, left_of, norm, shape, strength


@dataclass(frozen=True, kw_only=True)
class Neighbour(FlowEffect):
    """The wind u gains q |u| sin 2π f (t − x/|u|) to its left, x downstream of the middle of the
    attachments.

    Attributes:
        share: q.
        frequency: f, whatever the wind is.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 0.4),
            admissible=NOT_NEGATIVE,
            source="vortices behind a pitching foil: some tenths of the free stream "
            "(Koochesfahani, AIAA J. "
            "27:1200, 1989)",
        ),
    ] = 0.0
    frequency: Annotated[
        Value,
        shape(
            unit="Hz",
            prior=(0.8, 3.0),
            admissible=(1e-2, 50.0),
            source="hanging signs of 0.1–0.4 m swing as pendulums at 0.8–1.6 Hz, banners on spring "
            "arms at 1–3 Hz",
        ),
    ] = 1.4

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        level = horizontal(wind, axis=-2)
        speed = norm(level, axis=-2).clamp(min=torch.finfo(wind.dtype).eps)
        along = (offset * level).sum(1, keepdim=True) / speed
        phase = 2 * math.pi * self.frequency * (time - along / speed)
        return wind + self.share * torch.sin(phase) * left_of(level, axis=-2)
