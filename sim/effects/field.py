"""Forces per mass that are written down directly, as products of what a place on the cloth sees.

The terms by which new effects are proposed from data are made of these pieces, and so are the files of the effects.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.effects.effect import Effect
from sim.effects.geometry import horizontal, left_of, norm, origin
from sim.inertia import mean_normals
from sim.state import State
from sim.system import System


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What the vertices see.

    Shapes are (vertex, 1, 1), without unit, of the place on the flat cloth alone; u grows from hoist to fly, v from
    bottom to top. Fields are (vertex, 3, batch), or broadcast to it. Normals are the mean normals of `sim.inertia`.

    Attributes:
        cloth: constants.
        position: (vertex, 3, batch) [m].
        offset: (vertex, 3, batch) from the middle of the attachments at the start [m].
        velocity: (vertex, 3, batch) [m/s].
        wind: (3, batch) or (vertex, 3, batch) [m/s].
    """

    cloth: Cloth
    position: Tensor
    offset: Tensor
    velocity: Tensor
    wind: Tensor

    def _wave(self, axis: int) -> Tensor:
        """cos π of the share of the way along u (0) or v (1)."""
        rest = self.cloth.mesh.rest[:, axis]
        share = torch.as_tensor((rest - rest.min()) / (rest.max() - rest.min()), dtype=self.cloth.dtype)
        return torch.cos(math.pi * share).to(self.cloth.device)[:, None, None]

    @property
    def everywhere(self) -> Tensor:
        """1."""
        return torch.ones_like(self._wave(0))

    @property
    def fly(self) -> Tensor:
        """(1 − cos πu/W)/2: 0 at the hoist, 1 at the fly."""
        return (1 - self._wave(0)) / 2

    @property
    def upper(self) -> Tensor:
        """(1 − cos πv/H)/2: 0 at the bottom, 1 at the top."""
        return (1 - self._wave(1)) / 2

    @property
    def lower(self) -> Tensor:
        """(1 + cos πv/H)/2: 1 at the bottom, 0 at the top."""
        return (1 + self._wave(1)) / 2

    @property
    def upper_fly(self) -> Tensor:
        """1 at the upper fly corner, 0 at hoist and bottom."""
        return self.upper * self.fly

    @property
    def lower_fly(self) -> Tensor:
        """1 at the lower fly corner, 0 at hoist and top."""
        return self.lower * self.fly

    @property
    def downwind(self) -> Tensor:
        """The wind's horizontal direction; 0 in calm."""
        return self._level / self._level_speed.clamp(min=torch.finfo(self.wind.dtype).tiny)

    @property
    def leftward(self) -> Tensor:
        """Horizontal, to the left of who looks downwind."""
        return left_of(self.downwind, axis=-2)

    @property
    def upward(self) -> Tensor:
        """The vertical."""
        axis = torch.tensor(2, device=self.velocity.device)
        return torch.zeros_like(self.velocity[:1]).index_fill(1, axis, 1.0)

    @property
    def downwind_squared(self) -> Tensor:
        """|u| u of the wind's horizontal part u [m²/s²]."""
        return self._level_speed * self._level

    @property
    def leftward_squared(self) -> Tensor:
        """The same to the left [m²/s²]."""
        return left_of(self.downwind_squared, axis=-2)

    @property
    def upward_squared(self) -> Tensor:
        """u² upward [m²/s²]."""
        return self._level_speed**2 * self.upward

    @property
    def toward_pole(self) -> Tensor:
        """Horizontally from the vertex to the vertical through the middle of the attachments [m]."""
        return -horizontal(self.offset, axis=1)

    @property
    def toward_height(self) -> Tensor:
        """Vertically from the vertex to the height of the middle of the attachments [m]."""
        return horizontal(self.offset, axis=1) - self.offset

    @property
    def against_motion(self) -> Tensor:
        """−v [m/s]."""
        return -self.velocity

    @property
    def against_normal_motion(self) -> Tensor:
        """−(v·n) n [m/s]."""
        return -(self.velocity * self._normal).sum(1, keepdim=True) * self._normal

    @property
    def across(self) -> Tensor:
        """(w·n) n of the relative wind w [m/s]."""
        return self._across * self._normal

    @property
    def across_squared(self) -> Tensor:
        """|w·n| (w·n) n [m²/s²]."""
        return self._across.abs() * self.across

    @property
    def along(self) -> Tensor:
        """The relative wind's part along the cloth w_t [m/s]."""
        return self._relative - self.across

    @property
    def along_squared(self) -> Tensor:
        """|w_t| w_t [m²/s²]."""
        return norm(self.along) * self.along

    @property
    def _level(self) -> Tensor:
        level = horizontal(self.wind, axis=-2)
        return level if level.ndim == 3 else level.unsqueeze(0)

    @property
    def _level_speed(self) -> Tensor:
        return norm(self._level)

    @property
    def _relative(self) -> Tensor:
        return self.wind - self.velocity

    @property
    def _normal(self) -> Tensor:
        return mean_normals(self.cloth, self.position)

    @property
    def _across(self) -> Tensor:
        return (self._relative * self._normal).sum(1, keepdim=True)


class FieldEffect(Effect):
    """An additional force, given per mass of the cloth."""

    @abstractmethod
    def acceleration(self, seen: Seen) -> Tensor:
        """What broadcasts to (vertex, 3, batch) [m/s²]."""

    def apply(self, system: System, state: State) -> tuple[System, State]:
        placed = PlacedField(effect=self, origin=origin(system, state))
        return replace(system, effects=(*system.effects, placed)), state


@dataclass(frozen=True, kw_only=True)
class PlacedField:
    """A field about a place (3, batch) [m]."""

    effect: FieldEffect
    origin: Tensor

    def force(self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """(vertex, 3, batch) [N]; the time does not matter."""
        seen = Seen(cloth=cloth, position=position, offset=position - self.origin, velocity=velocity, wind=wind)
        return (cloth.mass.unsqueeze(1) * self.effect.acceleration(seen)).expand(position.shape)
