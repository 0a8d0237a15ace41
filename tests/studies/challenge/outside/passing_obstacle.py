"""Something that passes upwind, again and again, and takes the wind away from a part of the
flag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import FlowEffect, Value, left_of, norm, shape, strength

PERIOD = 3.7
"""Between passages [s]."""


@dataclass(frozen=True, kw_only=True)
class PassingObstacle(FlowEffect):
    """The wind is multiplied by 1 − q e^(−((y − y₀)² + (z + 0.3 m)²)/(2 s²)), y to its left and z
    above the middle of the attachments; y₀ runs from −1.5 m to 1.5 m once in 3.7 s.

    Attributes:
        share: q.
        size: s.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 0.8),
            admissible=(0.0, 1.0),
            source="velocity deficits of near wakes: 0.3 to 0.8",
        ),
    ] = 0.0
    size: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.2, 0.8),
            admissible=(1e-2, 10.0),
            source="persons, signs, small vehicles",
        ),
    ] = 0.4

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        left = left_of(wind, axis=-2)
        left = left / norm(left, axis=-2).clamp(min=torch.finfo(wind.dtype).tiny)
        across = (offset * left).sum(1, keepdim=True)
        place = 3.0 * (time / PERIOD % 1.0) - 1.5
        square = (across - place) ** 2 + (offset[:, 2:] + 0.3) ** 2
        return wind * (1.0 - self.share * torch.exp(-square / (2 * self.size**2)))
