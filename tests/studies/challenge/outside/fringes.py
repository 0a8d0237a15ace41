"""Fringes, tassels or ribbons on the fly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import AIR_DENSITY, NOT_NEGATIVE, Effect, Value, norm, strength
from sim.effects.quantities import AirDensity
from tests.studies.challenge.outside import edges


@dataclass(frozen=True, kw_only=True)
class Fringes(Effect):
    """Along the fly, per length, ½ ρ b |w| w for a relative wind w, whatever way the cloth lies.

    Attributes:
        breadth: b, drag area per length of the edge.
        density: ρ of the air.
    """

    breadth: Annotated[
        Value,
        strength(
            unit="m",
            prior=(0.0, 0.2),
            admissible=NOT_NEGATIVE,
            source="ribbons 0.1–1 m long have drag coefficients of 0.1–0.3 by their area "
            "(Carruthers and Filippone, "
            "J. Aircraft 42:976, 2005); tassels and fringes are several layers of them",
        ),
    ] = 0.0
    density: AirDensity = AIR_DENSITY

    def apply(self, system: System, state: State) -> tuple[System, State]:
        drag = EdgeDrag(
            effect=self, lengths=edges.half_lengths(system.cloth, edges.fly(system.cloth.mesh))
        )
        return replace(system, effects=(*system.effects, drag)), state


@dataclass(frozen=True, kw_only=True)
class EdgeDrag:
    """The drag of what hangs from the vertices, (vertex,) lengths of edge [m]."""

    effect: Fringes
    lengths: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """(vertex, 3, batch) [N]."""
        relative = wind - velocity
        return (
            0.5
            * self.effect.density
            * self.effect.breadth
            * self.lengths[:, None, None]
            * norm(relative)
            * relative
        )
