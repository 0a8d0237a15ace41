"""Air that the cloth takes along when it moves along its normals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, TypeAlias

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.effects.effect import Effect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.state import State
from sim.system import System

MassPerArea: TypeAlias = Annotated[
    Value,
    strength(
        unit="kg/m²",
        prior=(0.0, 1.0),
        admissible=NOT_NEGATIVE,
        source="potential flow: ρ λ/π for waves of length λ on a wide sheet, both sides; π ρ H/4, the mean over a "
        "slender strip of height H (Lighthill 1960); ρ = 1.2 kg/m³ and λ, H of 0.1–1 m give 0.04–1",
    ),
]


@dataclass(frozen=True, kw_only=True)
class AddedMass(Effect):
    """Still-air inertia: (m + m_a A n nᵀ) a = F at a vertex with rest area A and normal n (see `sim.inertia`).

    Attributes:
        mass: m_a, per area of cloth.
    """

    mass: MassPerArea = 0.0

    def added_mass(self, cloth: Cloth) -> Tensor:
        """(vertex, batch) [kg]."""
        areas = torch.as_tensor(cloth.mesh.vertex_areas, dtype=cloth.dtype, device=cloth.device)
        return (areas[:, None] * self.mass).expand_as(cloth.mass)

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(system, loads=(*system.loads, self)), state
