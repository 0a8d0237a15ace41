"""Pole and camera on something that turns: a ship, a carousel, a swivelling mast."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import Effect, Value, horizontal, left_of, origin, strength


@dataclass(frozen=True, kw_only=True)
class TurningPole(Effect):
    """Inertial forces of a frame that turns at Ω about the vertical through the middle of the
    attachments: −2 m Ω z × v + m Ω² r, r the horizontal distance. The wind is that of the turning
    frame.

    Attributes:
        rate: Ω, counter-clockwise seen from above.
    """

    rate: Annotated[
        Value,
        strength(
            unit="rad/s",
            prior=(-1.2, 1.2),
            source="ships turn at up to 0.1, carousels at 0.3 to 1.2 rad/s",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(
            system, effects=(*system.effects, Frame(effect=self, origin=origin(system, state)))
        ), state


@dataclass(frozen=True, kw_only=True)
class Frame:
    """The inertial forces about a vertical axis through (3, batch) [m]."""

    effect: TurningPole
    origin: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """(vertex, 3, batch) [N]."""
        rate = self.effect.rate
        arm = horizontal(position - self.origin, axis=1)
        return cloth.mass.unsqueeze(1) * (rate**2 * arm - 2 * rate * left_of(velocity, axis=1))
