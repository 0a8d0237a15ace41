"""A cord from the lower fly corner, as of a flag that was not quite let go."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import NOT_NEGATIVE, Effect, Value, norm, origin, shape, strength

DROP = 1.0
"""Where it is made fast, below the middle of the attachments [m]."""


@dataclass(frozen=True, kw_only=True)
class Tether(Effect):
    """An elastic cord −k (|d| − ℓ)₊ d/|d| between the lower fly corner and a point 1 m below the
    attachments.

    Attributes:
        stiffness: k.
        length: ℓ, unstretched.
    """

    stiffness: Annotated[
        Value,
        strength(
            unit="N/m",
            prior=(0.0, 10.0),
            admissible=NOT_NEGATIVE,
            source="elastic cords of 1–5 mm at lengths of 1 m",
        ),
    ] = 0.0
    length: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.8, 1.5),
            admissible=NOT_NEGATIVE,
            source="taut now and then on such a flag",
        ),
    ] = 1.2

    def apply(self, system: System, state: State) -> tuple[System, State]:
        rest = system.cloth.mesh.rest
        corner = int((rest[:, 0] - rest[:, 1]).argmax())
        down = torch.tensor(
            [[0.0], [0.0], [-DROP]], dtype=state.position.dtype, device=state.position.device
        )
        cord = Cord(effect=self, vertex=corner, end=origin(system, state) + down)
        return replace(system, effects=(*system.effects, cord)), state


@dataclass(frozen=True, kw_only=True)
class Cord:
    """The cord's force on one vertex, from its end (3, batch) [m]."""

    effect: Tether
    vertex: int
    end: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """(vertex, 3, batch) [N]."""
        stretch = position[self.vertex] - self.end
        distance = norm(stretch, axis=0)
        taut = (distance - self.effect.length).clamp(min=0)
        pull = (
            -self.effect.stiffness
            * taut
            * stretch
            / distance.clamp(min=torch.finfo(position.dtype).tiny)
        )
        index = torch.tensor([self.vertex], device=position.device)
        return torch.zeros_like(position).index_add(0, index, pull.unsqueeze(0))
