"""A balloon on a cord from the upper fly corner."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.effects import NOT_NEGATIVE, ForceEffect, Value, norm, strength

NET = 10.4
"""What helium lifts beyond its weight [N/m³]: 9.81 m/s² of 1.225 less 0.169 kg/m³."""
DRAG = 0.47
"""Drag coefficient of a sphere below its crisis (Hoerner, Fluid-Dynamic Drag, 1965, ch. 3)."""
_AIR = 1.225


@dataclass(frozen=True, kw_only=True)
class Balloon(ForceEffect):
    """At one corner the lift F upward and the drag ½ ρ C_D S |u| u of the sphere that has it, S its
    cross section. The
    cord is long: the wind u is not that relative to the cloth.

    Attributes:
        lift: F, of the helium, less its weight and that of the skin.
    """

    lift: Annotated[
        Value,
        strength(
            unit="N",
            prior=(0.0, 0.5),
            admissible=NOT_NEGATIVE,
            source="a balloon of 0.28 m lifts 0.1 N, one of 0.45 m or a bunch of five 0.5 N",
        ),
    ] = 0.0

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        rest = cloth.mesh.rest
        corner = torch.tensor([int((rest[:, 0] + rest[:, 1]).argmax())], device=position.device)
        air = wind if wind.ndim == 2 else wind[int(corner)]
        section = math.pi / 4 * (6 / (math.pi * NET) * self.lift) ** (2 / 3)
        up = torch.zeros_like(air).index_fill(0, torch.tensor(2, device=position.device), 1.0)
        pull = self.lift * up + 0.5 * _AIR * DRAG * section * norm(air, axis=0) * air
        return torch.zeros_like(position).index_add(0, corner, pull.unsqueeze(0))
