"""Warm air that rises below the flag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import FlowEffect, Value, shape, strength


@dataclass(frozen=True, kw_only=True)
class Updraft(FlowEffect):
    """The wind gains W/(1 + e^(z/s)) upward, z the height above the middle of the attachments.

    Attributes:
        speed: W, far below.
        thickness: s of the layer between.
    """

    speed: Annotated[
        Value,
        strength(
            unit="m/s", prior=(-2.0, 2.0), source="plumes over sunlit roofs and vents: 0.3–2 m/s"
        ),
    ] = 0.0
    thickness: Annotated[
        Value,
        shape(
            unit="m", prior=(0.05, 0.3), admissible=(1e-3, 10.0), source="of the edge of a plume"
        ),
    ] = 0.15

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        rising = self.speed * torch.sigmoid(-offset[:, 2:] / self.thickness)
        field = wind.expand(offset.shape) if wind.ndim == 2 else wind
        up = torch.zeros_like(field).index_fill(1, torch.tensor(2, device=wind.device), 1.0)
        return field + rising * up
