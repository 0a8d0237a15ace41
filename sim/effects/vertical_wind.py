"""A wind that blows upward or downward, as on a slope or over a roof."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects.cloth_geometry import horizontal, norm
from sim.effects.effect import WindEffect
from sim.effects.parameter import Value, strength

_QUARTER = 1.5707963267948966


@dataclass(frozen=True, kw_only=True)
class VerticalWind(WindEffect):
    """The wind's horizontal part, of speed u, becomes u cos i along itself and u sin i upward.

    Attributes:
        inclination: i, upward.
    """

    inclination: Annotated[
        Value,
        strength(
            unit="rad",
            prior=(-0.2, 0.2),
            weighed=(-0.4, 0.4),
            step=0.05,
            admissible=(-_QUARTER, _QUARTER),
            source="terrain slopes of up to 10°; IEC 61400-1 asks for 8° of mean flow inclination",
        ),
    ] = 0.0

    def velocity(self, time: float, wind: Tensor) -> Tensor:
        angle = torch.as_tensor(self.inclination, dtype=wind.dtype, device=wind.device)
        level = horizontal(wind, axis=0)
        up = torch.zeros_like(wind).index_fill(0, torch.tensor(2, device=wind.device), 1.0)
        return wind + (torch.cos(angle) - 1) * level + torch.sin(angle) * norm(level, axis=0) * up
