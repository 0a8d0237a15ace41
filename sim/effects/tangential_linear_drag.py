"""Friction of the air along the cloth, proportional to its speed (a laminar boundary layer of fixed
thickness)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from torch import Tensor

from sim.cloth.air import face_wind
from sim.cloth.cloth_batch import Cloth
from sim.effects.effect import ForceEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength


@dataclass(frozen=True, kw_only=True)
class TangentialLinearDrag(ForceEffect):
    """On a face of rest area a with tangential relative wind w_t: f = c a w_t, a third on each
    corner.

    Attributes:
        coefficient: c, both sides together.
    """

    effect_class: ClassVar[str] = "tangential-drag"
    coefficient: Annotated[
        Value,
        strength(
            unit="kg/(m² s)",
            prior=(0.0, 0.05),
            weighed=(0.03, 1.5),
            step=0.05,
            admissible=NOT_NEGATIVE,
            source="Blasius plate, two sides: 1.328 ρ U / √(U L/ν) is 0.009 to 0.06 at 2–10 m/s "
            "and 0.1–1 m",
        ),
    ] = 0.0

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        along = face_wind(cloth, position, velocity, wind).along
        push = (cloth.areas / 3)[:, None, None] * (self.coefficient * along)
        return cloth.shared_out(push)
