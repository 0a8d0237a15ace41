"""Air that is denser or thinner than the base model's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from torch import Tensor

from sim.effects.effect import PressureEffect
from sim.effects.parameter import Value, strength


@dataclass(frozen=True, kw_only=True)
class AirDensityChange(PressureEffect):
    """The normal force is multiplied by 1 + δ.

    Attributes:
        change: δ, relative to the base model's density.
    """

    effect_class: ClassVar[str] = "dynamic-pressure"
    change: Annotated[
        Value,
        strength(
            unit="1",
            prior=(-0.25, 0.3),
            weighed=(-0.4, 0.8),
            step=0.1,
            admissible=(-1.0, 10.0),
            source="1.225 kg/m³ ± 15 % for −20 to 40 °C and 0 to 1,000 m (U.S. Standard Atmosphere "
            "1976), around a "
            "base of 1.0 to 1.3 kg/m³",
        ),
    ] = 0.0

    def factor(self, density: float, across: Tensor) -> Tensor:
        return across.new_tensor(1.0) + self.change
