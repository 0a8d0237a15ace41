"""A flag held along its whole hoist, as by a sleeve or by many clips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import torch
from torch import Tensor

from sim.cloth.cloth_batch import Cloth
from sim.cloth.handles import Handles, full_hoist
from sim.cloth.state import State
from sim.cloth.system import InapplicableError, Springs, System
from sim.effects.effect import Effect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.weighing import Need


@dataclass(frozen=True, kw_only=True)
class FullHoist(Effect):
    """Springs along the hoist, between the handles, to where its vertices start; they move with the
    handles.

    Attributes:
        stiffness: of the springs on each axis, per length of hoist.
    """

    needs: ClassVar[Mapping[Need, str]] = {
        Need.FREE_HOIST: "what is held already cannot be held more"
    }
    stiffness: Annotated[
        Value,
        strength(
            unit="N/m²",
            prior=(1e2, 2e4),
            weighed=(30.0, 2e4),
            step=20.0,
            admissible=NOT_NEGATIVE,
            source="loose lacing to a tight sleeve; 1e4 is the reference simulator's 1e3 N/m on "
            "vertices 0.1 m apart",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        mesh = system.cloth.mesh
        hoist = full_hoist(mesh.rest)
        added = [i for i, vertex in enumerate(hoist) if vertex not in system.handles.vertices]
        if not added:
            raise InapplicableError(
                "every vertex of the hoist is held already",
                where="full hoist",
                fix="leave the effect out, or start from two corners on a mesh with rows between "
                "them",
            )
        along = mesh.rest[list(hoist), 1]
        share = np.gradient(along) if len(hoist) > 2 else np.full(2, np.ptp(along) / 2)
        vertices = torch.tensor([hoist[i] for i in added], device=state.position.device)
        lace = Lace(
            strength=torch.as_tensor(
                share[added], dtype=system.cloth.dtype, device=system.cloth.device
            )[:, None]
            * self.stiffness,
            vertices=vertices,
            anchors=state.position[vertices],
            handles=system.handles,
        )
        return replace(system, ties=(*system.ties, lace)), state


@dataclass(frozen=True, kw_only=True)
class Lace:
    """Springs to anchors that move with the handles.

    Attributes:
        strength: (tied, batch or 1) [N/m].
        vertices: (tied,).
        anchors: (tied, 3, batch) [m].
        handles: whose motion they follow.
    """

    strength: Tensor
    vertices: Tensor
    anchors: Tensor
    handles: Handles

    def springs(self, cloth: Cloth) -> Springs:
        """Describes the lace as springs."""
        stiffness = self.strength.expand(-1, cloth.batch)
        return Springs(
            vertices=self.vertices,
            anchors=self.anchors,
            stiffness=stiffness,
            slack=0 * stiffness,
            share=1.0,
        )

    def force(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]."""
        offset = torch.as_tensor(
            self.handles.offset(time), dtype=position.dtype, device=position.device
        )
        stretch = position[self.vertices] - self.anchors - offset[:, None]
        return torch.zeros_like(position).index_add(
            0, self.vertices, -self.strength.unsqueeze(1) * stretch
        )

    def stiffness(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes stiffnesses (vertex, batch) [N/m]."""
        return self.stiffest(cloth)

    def stiffest(self, cloth: Cloth) -> Tensor:
        """Computes stiffnesses (vertex, batch) [N/m]."""
        return torch.zeros_like(cloth.mass).index_add(
            0, self.vertices, self.strength.expand(-1, cloth.batch)
        )
