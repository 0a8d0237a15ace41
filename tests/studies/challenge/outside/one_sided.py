"""Cloth whose two sides meet the wind differently: coated, flocked or with pockets on one side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects import Value, strength
from sim.effects.effect import PressureEffect


@dataclass(frozen=True, kw_only=True)
class OneSided(PressureEffect):
    """The normal force is multiplied by 1 + q where the wind blows along the normals, by 1 − q
    where against them.

    Attributes:
        share: q.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(-0.5, 0.5),
            admissible=(-1.0, 1.0),
            source="hollow against convex sides of curved plates: drag coefficients 1.4 and "
            "0.7–1.2 (Hoerner 1965)",
        ),
    ] = 0.0

    def factor(self, density: float, across: Tensor) -> Tensor:
        return across.new_tensor(1.0) + self.share * across.sign()
