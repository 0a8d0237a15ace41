"""Forces per mass that are written down directly, as products of what a place on the cloth sees.

The terms by which new effects are proposed from data are made of these pieces, and so are the files
of the effects.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from sim.cloth.cloth_batch import Cloth
from sim.cloth.inertia import mean_normals, rest_areas
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.cloth_geometry import horizontal, left_of, norm, origin
from sim.effects.effect import Effect

_LOCAL = 0.1
"""Radius of what is local, as a share of the geometric mean of the cloth's width and height."""


@dataclass(frozen=True, kw_only=True)
class Flat:
    """Shapes on the flat cloth: (vertex, 1, 1), without unit; u grows from hoist to fly, v from
    bottom to top.

    Attributes:
        cloth: constants.
    """

    cloth: Cloth

    def _shares(self) -> tuple[Tensor, Tensor]:
        """Computes shares (vertex, 1, 1) each: of the width from the hoist, of the height from
        below."""
        rest = self.cloth.mesh.rest
        shares = torch.as_tensor((rest - rest.min(axis=0)) / (rest.max(axis=0) - rest.min(axis=0)))
        u, v = shares.to(dtype=self.cloth.dtype, device=self.cloth.device).unbind(1)
        return u[:, None, None], v[:, None, None]

    @property
    def _extents(self) -> tuple[float, float]:
        """Width and height [m]."""
        rest = self.cloth.mesh.rest
        width, height = rest.max(axis=0) - rest.min(axis=0)
        return float(width), float(height)

    @property
    def _radius(self) -> float:
        """Radius of what is local [m]."""
        return _LOCAL * math.sqrt(math.prod(self._extents))

    def _bumps(self, u: float | None, v: float | None) -> Tensor:
        """Computes exp(−d²/2) of the distance d to a point, a line of constant u or one of constant
        v, in local radii."""
        square = torch.zeros_like(self.everywhere)
        for share, centre, extent in zip(self._shares(), (u, v), self._extents, strict=True):
            if centre is not None:
                square = square + ((share - centre) * (extent / self._radius)) ** 2
        return torch.exp(-square / 2)

    def near(self, u: float, v: float) -> Tensor:
        """Computes exp(−d²/(2 s²)) of the distance d to the point at shares u of the width and v of
        the height; the local radius s is a tenth of √(width × height)."""
        return self._bumps(u, v)

    def stripe(self, u: float) -> Tensor:
        """Computes the same of the distance to the line from bottom to top at a share u of the
        width."""
        return self._bumps(u, None)

    def band(self, v: float) -> Tensor:
        """Computes the same of the distance to the line from hoist to fly at a share v of the
        height."""
        return self._bumps(None, v)

    def _wave(self, axis: int) -> Tensor:
        """cos π of the share of the way along u (0) or v (1)."""
        return torch.cos(math.pi * self._shares()[axis])

    @property
    def everywhere(self) -> Tensor:
        """1."""
        return torch.ones_like(self._wave(0))

    @property
    def hoist(self) -> Tensor:
        """(1 + cos πu/W)/2: 1 at the hoist, 0 at the fly."""
        return (1 + self._wave(0)) / 2

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


@dataclass(frozen=True, kw_only=True)
class Seen(Flat):
    """What the vertices see. Fields are (vertex, 3, batch), or broadcast to it. Normals are the
    mean normals of `sim.cloth.inertia`.

    Attributes:
        position: (vertex, 3, batch) [m].
        offset: (vertex, 3, batch) from the middle of the attachments at the start [m].
        velocity: (vertex, 3, batch) [m/s].
        wind: (3, batch) or (vertex, 3, batch) [m/s].
    """

    position: Tensor
    offset: Tensor
    velocity: Tensor
    wind: Tensor

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
        """Horizontally from the vertex to the vertical through the middle of the attachments
        [m]."""
        return -horizontal(self.offset, axis=1)

    @property
    def to_pole(self) -> Tensor:
        """d/√(|d|² + s²) of `toward_pole` d with s the local radius: its direction, but for near
        the vertical."""
        arm = self.toward_pole
        return arm / ((arm * arm).sum(1, keepdim=True) + self._radius**2).sqrt()

    @property
    def toward_height(self) -> Tensor:
        """Vertically from the vertex to the height of the middle of the attachments [m]."""
        return horizontal(self.offset, axis=1) - self.offset

    @property
    def against_motion(self) -> Tensor:
        """−v [m/s]."""
        return -self.velocity

    @property
    def left_of_motion(self) -> Tensor:
        """z × v: to the left of the horizontal motion, as a turning frame pushes [m/s]."""
        return left_of(self.velocity, axis=1)

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
    def across_even(self) -> Tensor:
        """(w·n)² n: toward the side that the normals point to, whichever side the wind is on
        [m²/s²]."""
        return self._across * self.across

    @property
    def rising(self) -> Tensor:
        """|w·n| (z·n) n: by how much the pressure grows with a wind upward, over twice that wind
        [m/s]."""
        return self._turning(self.upward)

    @property
    def crossing(self) -> Tensor:
        """|w·n| (l·n) n: the same with a wind to the left of the logged one [m/s]."""
        return self._turning(self.leftward)

    @property
    def along_width(self) -> Tensor:
        """(w·t) t with t the unit vector from hoist to fly along the cloth [m/s]."""
        return self._along_threads(0)

    @property
    def along_height(self) -> Tensor:
        """(w·t) t with t the unit vector from bottom to top along the cloth [m/s]."""
        return self._along_threads(1)

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

    def _turning(self, direction: Tensor) -> Tensor:
        normal = self._normal
        return self._across.abs() * (direction * normal).sum(1, keepdim=True) * normal

    def _along_threads(self, axis: int) -> Tensor:
        corners = self.cloth.at_corners(self.position)
        slopes = [self.cloth.gradients[:, axis, c, None, None] * corners[c] for c in range(3)]
        third = (self.cloth.areas / 3)[:, None, None] * (slopes[0] + slopes[1] + slopes[2])
        mean = self.cloth.shared_out(third) / rest_areas(self.cloth)[:, None, None]
        thread = mean / norm(mean).clamp(min=torch.finfo(mean.dtype).tiny)
        return (self._relative * thread).sum(1, keepdim=True) * thread

    @property
    def _normal(self) -> Tensor:
        return mean_normals(self.cloth, self.position)

    @property
    def _across(self) -> Tensor:
        return (self._relative * self._normal).sum(1, keepdim=True)


class FieldEffect(Effect):
    """An additional force, given per mass of the cloth; and the cloth may be heavier."""

    @abstractmethod
    def acceleration(self, seen: Seen) -> Tensor:
        """Computes an acceleration that broadcasts to (vertex, 3, batch) [m/s²]."""

    def cloth(self, cloth: Cloth) -> Cloth:
        """Returns the cloth on which it acts; by default the same."""
        return cloth

    def apply(self, system: System, state: State) -> tuple[System, State]:
        placed = PlacedField(effect=self, origin=origin(system, state))
        return replace(
            system, cloth=self.cloth(system.cloth), effects=(*system.effects, placed)
        ), state


def heavier(cloth: Cloth, share: Tensor) -> Cloth:
    """Multiplies the cloth's mass by 1 + share: (vertex, 1, 1), or (vertex, 1, batch)."""
    return replace(cloth, mass=cloth.mass * (1 + share).squeeze(1))


@dataclass(frozen=True, kw_only=True)
class PlacedField:
    """A field about a place (3, batch) [m]."""

    effect: FieldEffect
    origin: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]; the time does not matter."""
        state = Seen(
            cloth=cloth,
            position=position,
            offset=position - self.origin,
            velocity=velocity,
            wind=wind,
        )
        return (cloth.mass.unsqueeze(1) * self.effect.acceleration(state)).expand(position.shape)
