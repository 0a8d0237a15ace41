"""An elastic cord in the hem of the fly, which gathers it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import NOT_NEGATIVE, Effect, Value, norm, shape, strength
from tests.studies.challenge.outside import edges


@dataclass(frozen=True, kw_only=True)
class Drawstring(Effect):
    """A cord that slides in the hem pulls along the fly with T (s − g)₊/(1 − g), s the length of
    the fly over that of the flat cloth.

    Attributes:
        tension: T, while the fly is as long as that of the flat cloth.
        gathered: g, where the cord goes slack.
    """

    tension: Annotated[
        Value,
        strength(
            unit="N",
            prior=(0.0, 3.0),
            admissible=NOT_NEGATIVE,
            source="braided elastic of 3–10 mm needs 1–10 N for half as much again of its length",
        ),
    ] = 0.0
    gathered: Annotated[
        Value,
        shape(
            unit="1",
            prior=(0.4, 0.8),
            admissible=(0.0, 0.95),
            source="gathers of 1.25 to 2.5 to one in sewing",
        ),
    ] = 0.6

    def apply(self, system: System, state: State) -> tuple[System, State]:
        pairs = edges.fly(system.cloth.mesh)
        length = float(edges.half_lengths(system.cloth, pairs).sum())
        gather = Gather(
            effect=self, pairs=torch.as_tensor(pairs, device=state.position.device), length=length
        )
        return replace(system, effects=(*system.effects, gather)), state


@dataclass(frozen=True, kw_only=True)
class Gather:
    """The cord's pull on the vertices (edge, 2) of edges that measure `length` on the flat cloth
    [m]."""

    effect: Drawstring
    pairs: Tensor
    length: float

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """(vertex, 3, batch) [N]."""
        start, end = self.pairs.unbind(1)
        along = position[end] - position[start]
        each = norm(along)
        least = self.effect.gathered
        pull = self.effect.tension * (each.sum(0) / self.length - least).clamp(min=0) / (1 - least)
        pull = pull * along / each.clamp(min=torch.finfo(position.dtype).tiny)
        return torch.zeros_like(position).index_add(0, start, pull).index_add(0, end, -pull)
