"""Attachments with play: loops, rings or cords that the cloth may move in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.cloth_batch import Cloth
from sim.cloth.handles import Handles
from sim.cloth.state import State
from sim.cloth.system import Springs, System
from sim.effects.cloth_geometry import norm
from sim.effects.effect import Effect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.weighing import Need

# Shorter cords count as this long [m], so that the gradient at none is finite.
_SHORTEST = 1e-6


@dataclass(frozen=True, kw_only=True)
class Slack(Effect):
    """The handles' springs −k d pull only beyond a length ℓ: −k (|d| − ℓ)₊ d/|d|.

    The force has a kink at |d| = ℓ. With backward Euler the springs keep the stiffness k (1 −
    ℓ/|d|)₊ on every axis.

    Attributes:
        length: ℓ.
    """

    needs: ClassVar[Mapping[Need, str]] = {
        Need.FILMS: "attachments that are taken from where markers show them lie farther out by it"
    }
    length: Annotated[
        Value,
        strength(
            unit="m",
            prior=(0.005, 0.1),
            weighed=(0.01, 0.15),
            step=0.02,
            admissible=NOT_NEGATIVE,
            source="snap hooks and rings of 10–50 mm, loosely tied cords to 0.1 m",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        if not system.sprung:
            raise UsageError(
                "slack needs handles that are springs",
                where="slack",
                fix="give the handles a finite stiffness",
            )
        play = Play(
            length=self.length, vertices=system.held, anchors=system.anchors, handles=system.handles
        )
        return replace(system, ties=(*system.ties, play)), state


@dataclass(frozen=True, kw_only=True)
class Play:
    """What slack takes away from the handles' springs.

    Attributes:
        length: ℓ [m].
        vertices: (held,).
        anchors: (held, 3, batch) [m].
        handles: the springs.
    """

    length: Value
    vertices: Tensor
    anchors: Tensor
    handles: Handles

    def springs(self, cloth: Cloth) -> Springs:
        """Describes the play as springs."""
        slack = torch.as_tensor(self.length, dtype=cloth.dtype, device=cloth.device).expand(
            len(self.vertices), cloth.batch
        )
        return Springs(
            vertices=self.vertices,
            anchors=self.anchors,
            stiffness=torch.full_like(slack, self.handles.stiffness),
            slack=slack,
            share=0.0,
        )

    def _stretch(self, time: float, position: Tensor) -> tuple[Tensor, Tensor]:
        """Computes d (held, 3, batch) [m], and the share of it that is slack (held, 1, batch)."""
        offset = torch.as_tensor(
            self.handles.offset(time), dtype=position.dtype, device=position.device
        )
        stretch = position[self.vertices] - self.anchors - offset[:, None]
        distance = norm(stretch).clamp(min=_SHORTEST)
        return stretch, (self.length / distance).clamp(max=1)

    def force(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]."""
        stretch, slack = self._stretch(time, position)
        return torch.zeros_like(position).index_add(
            0, self.vertices, self.handles.stiffness * slack * stretch
        )

    def stiffness(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes stiffnesses (vertex, batch), negative: less than the handles' [N/m]."""
        _, slack = self._stretch(time, position)
        return torch.zeros_like(cloth.mass).index_add(
            0, self.vertices, -self.handles.stiffness * slack[:, 0]
        )

    def stiffest(self, cloth: Cloth) -> Tensor:
        """Returns zeros (vertex, batch): nothing is added to the handles' [N/m]."""
        return torch.zeros_like(cloth.mass)
