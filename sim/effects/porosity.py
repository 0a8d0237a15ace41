"""Holes in the cloth that take part of the wind's push away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from torch import Tensor

from sim.effects.effect import PressureEffect
from sim.effects.parameter import Value, strength


@dataclass(frozen=True, kw_only=True)
class Porosity(PressureEffect):
    """The normal force is multiplied by 1 − φ at every speed: holes that jets pass freely.

    Under one steady speed this looks like another air density or wind gain; `Permeability` can, by
    its dependence on speed.

    Attributes:
        open_share: φ, the open share of the area.
    """

    unweighed: ClassVar[str] = "it does what an air-density below the base model's does"
    effect_class: ClassVar[str] = "dynamic-pressure"
    open_share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 0.3),
            admissible=(0.0, 1.0),
            source="open area of woven and knitted cloth 0–0.1, of mesh banners 0.2–0.35 (makers' "
            "data sheets)",
        ),
    ] = 0.0

    def factor(self, density: float, across: Tensor) -> Tensor:
        return across.new_tensor(1.0) - self.open_share
