"""Air that seeps through the cloth in proportion to the pressure across it (Darcy)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import torch
from torch import Tensor

from sim.effects.effect import PressureEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength


@dataclass(frozen=True, kw_only=True)
class Permeability(PressureEffect):
    """Through the cloth seeps κ Δp; the push is that of the rest, Δp = ρ s² with s = |w_n| − κ Δp.

    The positive root of κ ρ s² + s = |w_n| is s = 2 |w_n| / (1 + √(1 + 4 κ ρ |w_n|)), and the force
    is multiplied by (s / |w_n|)²: 1 at low speed, falling as 1/|w_n| at high speed.

    Attributes:
        permeability: κ, face velocity per pressure difference.
    """

    effect_class: ClassVar[str] = "dynamic-pressure"
    permeability: Annotated[
        Value,
        strength(
            unit="m/(s Pa)",
            prior=(0.0, 0.02),
            weighed=(1e-3, 5e-2),
            step=0.005,
            admissible=NOT_NEGATIVE,
            source="ISO 9237 at 100 Pa: 10–100 mm/s for dense weaves, 500–2,000 mm/s for open "
            "knits, divided by 100 Pa",
        ),
    ] = 0.0

    def factor(self, density: float, across: Tensor) -> Tensor:
        return (2 / (1 + torch.sqrt(1 + 4 * density * self.permeability * across.abs()))) ** 2
