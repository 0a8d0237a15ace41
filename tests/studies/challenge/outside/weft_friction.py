"""Friction of the air along one direction of the weave: cloth with a pile, ribs or fringes across
it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.air import face_wind
from sim.effects import NOT_NEGATIVE, ForceEffect, Value, norm, strength


@dataclass(frozen=True, kw_only=True)
class WeftFriction(ForceEffect):
    """On a face of rest area a with unit tangent t along the weft: f = c a (w·t) t for a relative
    wind w.

    Attributes:
        coefficient: c.
    """

    coefficient: Annotated[
        Value,
        strength(
            unit="kg/(m² s)",
            prior=(0.0, 0.5),
            admissible=NOT_NEGATIVE,
            source="ribs and pile have up to ten times the friction of a smooth plate, 0.01–0.06 "
            "at 2–10 m/s",
        ),
    ] = 0.0

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        corners = cloth.at_corners(position)
        weft = sum(
            (cloth.gradients[:, 1, c, None, None] * corners[c] for c in range(3)),
            torch.zeros_like(corners[0]),
        )
        tangent = weft / norm(weft).clamp(min=torch.finfo(position.dtype).tiny)
        along = (face_wind(cloth, position, velocity, wind).relative * tangent).sum(1, keepdim=True)
        push = (cloth.areas / 3)[:, None, None] * (self.coefficient * along * tangent)
        return cloth.shared_out(push)
