"""A panel of net in the cloth, through which the air passes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from sim.cloth import Cloth
from sim.cloth.air import face_wind
from sim.cloth.mesh import Mesh
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import Effect, Value, strength

LOW, HIGH = (0.4, 0.1), (0.9, 0.75)
"""Corners of the panel: from the hoist as a share of the width, from below as a share of the
height."""
_FINE = 8


@dataclass(frozen=True, kw_only=True)
class Vent(Effect):
    """Within a rectangle the normal force of the wind is multiplied by 1 − q.

    Attributes:
        share: q.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 1.0),
            admissible=(0.0, 1.0),
            source="wind slits and nets of banners: 0.2–0.7 of the solid's drag is lost at "
            "solidities of 0.8–0.3, all "
            "of it where a piece is cut out (Hoerner 1965, ch. 3)",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        within = covered(system.cloth.mesh)
        areas = system.cloth.areas * torch.as_tensor(
            within, dtype=system.cloth.dtype, device=system.cloth.device
        )
        panel = Panel(effect=self, areas=areas, density=system.air.plain.density)
        return replace(system, effects=(*system.effects, panel)), state


@dataclass(frozen=True, kw_only=True)
class Panel:
    """What is missing of the normal force ρ a |w_n| w_n, for a density ρ [kg/m³] and (face,) areas
    of net [m²]."""

    effect: Vent
    areas: Tensor
    density: float

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """(vertex, 3, batch) [N]."""
        seen = face_wind(cloth, position, velocity, wind)
        size = (self.areas / 3)[:, None, None] * self.density * self.effect.share
        return cloth.shared_out(-size * seen.across.abs() * seen.across * seen.normal)


def covered(mesh: Mesh) -> FloatArray:
    """(face,) share of the faces that the panel covers, from points spread evenly over them."""
    i, j = np.divmod(np.arange(_FINE**2), _FINE)
    i, j = i[i + j < _FINE], j[i + j < _FINE]
    weights = (np.stack([i, j, _FINE - 1 - i - j], axis=1) + 1 / 3) / _FINE
    low, high = mesh.rest.min(axis=0), mesh.rest.max(axis=0)
    points = np.einsum("pc,fcd->fpd", weights, (mesh.rest[mesh.faces] - low) / (high - low))
    return ((points > LOW) & (points < HIGH)).all(axis=2).mean(axis=1)
