"""Cloth that the pole attracts: static charge, or a magnetic stripe at a steel pole."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.inertia import rest_areas
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import NOT_NEGATIVE, Effect, Value, horizontal, norm, origin, shape, strength


@dataclass(frozen=True, kw_only=True)
class Attraction(Effect):
    """Per area p e^(−r/ℓ), horizontally toward the vertical axis at a distance r through the middle
    of the attachments.

    Attributes:
        pull: p.
        reach: ℓ.
    """

    pull: Annotated[
        Value,
        strength(
            unit="N/m²",
            prior=(0.0, 2.0),
            admissible=NOT_NEGATIVE,
            source="charged insulators bear up to σ²/(2 ε₀) = 40 N/m² at breakdown of air; cloth "
            "keeps a tenth or less",
        ),
    ] = 0.0
    reach: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.2, 1.0),
            admissible=(1e-2, 10.0),
            source="of the order of the cloth's size",
        ),
    ] = 0.5

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(
            system, effects=(*system.effects, Axis(effect=self, origin=origin(system, state)))
        ), state


@dataclass(frozen=True, kw_only=True)
class Axis:
    """The attraction of an axis through (3, batch) [m]."""

    effect: Attraction
    origin: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """(vertex, 3, batch) [N]."""
        arm = horizontal(position - self.origin, axis=1)
        distance = norm(arm)
        toward = -arm / distance.clamp(min=torch.finfo(position.dtype).tiny)
        area = rest_areas(cloth)[:, None, None]
        return area * self.effect.pull * torch.exp(-distance / self.effect.reach) * toward
