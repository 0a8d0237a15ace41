"""A standing eddy about a vertical axis beside the flag, as in the corner of a yard."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import FlowEffect, Value, horizontal, left_of, norm, shape, strength

PLACE = (0.7, 0.4)
"""Its axis from the middle of the attachments: downstream, and to the left of the wind [m]."""


@dataclass(frozen=True, kw_only=True)
class Whirl(FlowEffect):
    """The wind gains Γ/(2π r) (1 − e^(−(r/c)²)) around the axis at a distance r from it: the vortex
    of Lamb and Oseen.

    Attributes:
        circulation: Γ, counter-clockwise seen from above.
        core: c.
    """

    circulation: Annotated[
        Value,
        strength(
            unit="m²/s",
            prior=(-5.0, 5.0),
            source="eddies as wide as the corner or parapet they stand behind, 0.5–2 m, that turn "
            "at a third to a half "
            "of the wind: π D U/2 of 1–10 m²/s (Oke, Boundary Layer Climates, 1987, ch. 8)",
        ),
    ] = 0.0
    core: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.1, 0.5),
            admissible=(1e-2, 10.0),
            source="a fifth to a half of the eddy's width",
        ),
    ] = 0.3

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        level = horizontal(wind, axis=-2)
        along = level / norm(level, axis=-2).clamp(min=torch.finfo(wind.dtype).tiny)
        arm = horizontal(offset, axis=1) - PLACE[0] * along - PLACE[1] * left_of(along, axis=-2)
        square = (arm * arm).sum(1, keepdim=True)
        share = (square / self.core**2).clamp(min=1e-12)
        rate = -self.circulation / (2 * math.pi * self.core**2) * torch.expm1(-share) / share
        return wind + rate * left_of(arm, axis=1)
