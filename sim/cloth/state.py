"""What changes during a run."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

SPEED_LIMIT = 300.0
"""Speed of a vertex that only divergence reaches [m/s]."""


@dataclass(frozen=True, kw_only=True)
class State:
    """Positions and velocities (vertex, 3, batch) [m, m/s] at one time [s] since the start of the
    run.

    `memory` holds what the system's forces remember, in their order (see `System.remembering`).
    """

    position: Tensor
    velocity: Tensor
    time: float = 0.0
    memory: tuple[Tensor, ...] = ()

    def select(self, members: slice) -> State:
        """Selects where some members are and how fast, without what is remembered."""
        return State(
            position=self.position[..., members],
            velocity=self.velocity[..., members],
            time=self.time,
        )

    def healthy(self, *, speed_limit: float = SPEED_LIMIT) -> Tensor:
        """Checks each member, (batch,) bool: finite, and no vertex faster than the limit [m/s]."""
        finite = torch.isfinite(self.position).all(0).all(0) & torch.isfinite(self.velocity).all(
            0
        ).all(0)
        return finite & ((self.velocity**2).sum(1).amax(0) < speed_limit**2)
