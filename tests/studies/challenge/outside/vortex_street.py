"""The vortex street behind the pole."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import NOT_NEGATIVE, FlowEffect, Value, horizontal, left_of, norm, shape, strength

STROUHAL = 0.2
"""f D/U of a circular cylinder from Re 300 to 2e5 (Roshko, NACA TN 3169, 1954)."""
_CARRIED = 0.85
"""Speed of the vortices over that of the wind."""


@dataclass(frozen=True, kw_only=True)
class VortexStreet(FlowEffect):
    """The wind u gains q |u| sin 2π(f t − f x/(0.85 |u|)) e^(−(y/(3D))²) x/(x + D) to its left, f =
    0.2 |u|/D, where x > 0 is downstream of the middle of the attachments and y across.

    Attributes:
        share: q.
        diameter: D of the pole.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.05, 0.5),
            admissible=NOT_NEGATIVE,
            source="cross velocities near a cylinder's wake axis reach half the free stream "
            "(Cantwell and Coles 1983)",
        ),
    ] = 0.0
    diameter: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.08, 0.3),
            admissible=(1e-3, 5.0),
            source="masts and lamp posts: 80–300 mm",
        ),
    ] = 0.15

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        level = horizontal(wind, axis=-2)
        speed = norm(level, axis=-2)
        direction = level / speed.clamp(min=torch.finfo(wind.dtype).tiny)
        along = (offset * direction).sum(1, keepdim=True).clamp(min=0)
        across = (offset * left_of(direction, axis=-2)).sum(1, keepdim=True)
        phase = 2 * math.pi * STROUHAL / self.diameter * (speed * time - along / _CARRIED)
        near = torch.exp(-((across / (3 * self.diameter)) ** 2)) * along / (along + self.diameter)
        return wind + self.share * torch.sin(phase) * near * left_of(level, axis=-2)
