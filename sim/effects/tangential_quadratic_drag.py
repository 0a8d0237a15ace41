"""Friction of the air along the cloth, proportional to its squared speed (a rough, turbulent
boundary layer)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from torch import Tensor

from sim.cloth.air import face_wind
from sim.cloth.cloth_batch import Cloth
from sim.effects.cloth_geometry import norm
from sim.effects.effect import ForceEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.quantities import AIR_DENSITY, AirDensity


@dataclass(frozen=True, kw_only=True)
class TangentialQuadraticDrag(ForceEffect):
    """On a face of rest area a with tangential relative wind w_t: f = ρ C_f a |w_t| w_t (½ for each
    of two sides).

    Attributes:
        coefficient: C_f, of one side.
        density: ρ of the air.
    """

    effect_class: ClassVar[str] = "tangential-drag"
    coefficient: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 0.05),
            weighed=(0.006, 0.3),
            step=0.02,
            admissible=NOT_NEGATIVE,
            source="flat plates at Reynolds 1e4–1e6: 0.003–0.013 smooth (Schlichting, "
            "Boundary-Layer Theory); "
            "waving cloth several times that (Hoerner, Fluid-Dynamic Drag, flags and banners)",
        ),
    ] = 0.0
    density: AirDensity = AIR_DENSITY

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        along = face_wind(cloth, position, velocity, wind).along
        push = (cloth.areas / 3)[:, None, None] * (
            self.density * self.coefficient * norm(along) * along
        )
        return cloth.shared_out(push)
