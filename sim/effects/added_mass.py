"""Air that the cloth takes along when it moves along its normals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from torch import Tensor

from sim.cloth.cloth_batch import Cloth
from sim.cloth.inertia import mean_normal_rates, mean_normals, rest_areas
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.effect import ForceEffect
from sim.effects.parameter import NOT_NEGATIVE, Described, Value, strength


def mass_per_area(*, step: float) -> Described:
    """Annotates a mass of air per area of cloth."""
    return strength(
        unit="kg/m²",
        prior=(0.0, 0.3),
        weighed=(0.03, 0.6),
        step=step,
        admissible=NOT_NEGATIVE,
        source="potential flow: ρ λ/π for waves of length λ on a wide sheet, both sides, and π ρ "
        "H/4, the mean over a "
        "slender strip of height H (Lighthill 1960): 0.04–0.3 for waves of 0.1–0.8 m",
    )


@dataclass(frozen=True, kw_only=True)
class AddedMass(ForceEffect):
    """Still-air inertia: per area −m_a V̇ n, with V = v·n the velocity along the normal n and V̇ =
    n·a + ṅ·v.

    Its power is that of the air's kinetic energy ½ m_a V², so that none is made or lost when the
    cloth turns. The first term is mass (see `sim.cloth.inertia`), the second a force.

    Attributes:
        mass: m_a, per area of cloth.
    """

    effect_class: ClassVar[str] = "fluid-inertia"
    mass: Annotated[Value, mass_per_area(step=0.05)] = 0.0

    def added_mass(self, cloth: Cloth) -> Tensor:
        """Computes the added mass, (vertex, batch) [kg]."""
        return (rest_areas(cloth)[:, None] * self.mass).expand_as(cloth.mass)

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        turning = (mean_normal_rates(cloth, position, velocity) * velocity).sum(1, keepdim=True)
        return (
            -self.mass * rest_areas(cloth)[:, None, None] * turning * mean_normals(cloth, position)
        )

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return super().apply(replace(system, loads=(*system.loads, self)), state)
