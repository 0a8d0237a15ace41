"""Lift of the faces as thin plates in attached flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth.air import face_wind
from sim.cloth.cloth_batch import Cloth
from sim.effects.cloth_geometry import norm
from sim.effects.effect import ForceEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.quantities import AIR_DENSITY, AirDensity


@dataclass(frozen=True, kw_only=True)
class Lift(ForceEffect):
    """The force on a face of rest area a and unit normal n is f = ½ ρ C a (w·n) (|w| n − (w·n)
    w/|w|), perpendicular to the relative wind w and of size ½ ρ C a |w|² sin α cos α.

    α is the angle between the wind and the face. The face's two normals give the same force.

    Attributes:
        coefficient: C; the slope of the lift coefficient at small angles.
        density: ρ of the air.
    """

    coefficient: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 4.0),
            weighed=(0.3, 8.0),
            step=0.3,
            admissible=NOT_NEGATIVE,
            source="thin-aerofoil slope 2π, π A/2 for slender plates of aspect ratio A, less where "
            "flow separates; "
            "normal-force slopes of plates 1.5–4.5 (Hoerner and Borst, Fluid-Dynamic Lift, 1975)",
        ),
    ] = 0.0
    density: AirDensity = AIR_DENSITY

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        relative = face_wind(cloth, position, velocity, wind)
        speed = norm(relative.relative)
        direction = relative.relative / speed.clamp(min=torch.finfo(speed.dtype).tiny)
        lift = relative.across * (speed * relative.normal - relative.across * direction)
        push = (cloth.areas / 3)[:, None, None] * (0.5 * self.density * self.coefficient * lift)
        return cloth.shared_out(push)
