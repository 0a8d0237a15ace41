"""The mass of hems, tapes and seams around the cloth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import torch

from sim.cloth.cloth_batch import Cloth
from sim.effects.cloth_geometry import hem_lengths
from sim.effects.effect import ClothEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength


@dataclass(frozen=True, kw_only=True)
class HemMass(ClothEffect):
    """Every boundary edge carries λ times its length, half of it at each end.

    Attributes:
        line_density: λ, on top of the cloth.
    """

    effect_class: ClassVar[str] = "hem"
    line_density: Annotated[
        Value,
        strength(
            unit="kg/m",
            prior=(0.0, 0.02),
            weighed=(4e-3, 8e-2),
            step=0.005,
            admissible=NOT_NEGATIVE,
            source="two more layers over 10–25 mm of cloth of 0.1–0.3 kg/m²: 0.002–0.015 kg/m; "
            "thread and tape on top",
        ),
    ] = 0.0

    def cloth(self, cloth: Cloth) -> Cloth:
        lengths = torch.as_tensor(hem_lengths(cloth.mesh), dtype=cloth.dtype, device=cloth.device)
        return replace(cloth, mass=cloth.mass + lengths[:, None] * self.line_density)
