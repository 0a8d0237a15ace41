"""Forces of the air on the cloth, as named models.

`QuadraticNormal` is the reference simulator's (ArcSim 0.2.1): on a face of rest area a with
deformed unit normal n, with w = wind − face velocity, w_n = w·n and w_t = w − w_n n,

    ρ a |w_n| w_n n + c a w_t,

a third on each corner. There is no ½ and no drag coefficient: ρ is a parameter, 1 kg/m³ by default,
not the air's density.

`Stokes` is what the paper's text says (Runia et al. 2020, section 4.1; Wejchert and Haumann 1991):
a sphere's drag 6 π R η w on every mass. The text leaves R open; here R = √(A/π) with A the rest
area that belongs to the vertex, so that the total does not depend on orientation but, as for any
such model, on the mesh.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

from flagdata.errors import InputError
from flagdata.recipes.registry import Registry
from sim.cloth import on_mesh
from sim.cloth.cloth_batch import Cloth

# Dynamic viscosity of air at 288.15 K, U.S. Standard Atmosphere 1976, table 4.
_VISCOSITY = 1.789e-5


class AirForce(Protocol):
    """A model of the air's force on the cloth."""

    def force(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N] for a wind (3, batch), or (vertex, 3, batch) where
        it differs in space [m/s]."""
        ...

    @property
    def plain(self) -> QuadraticNormal:
        """The quadratic-normal force nearest to it, of which the compiled kernel takes care."""
        ...

    @property
    def factors(self) -> tuple[object, ...] | None:
        """What the normal part of `plain` is multiplied by; None where it has more than that."""
        ...

    def beyond(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Computes what `force` has more than `plain`: (vertex, 3, batch) [N]."""
        ...


@dataclass(frozen=True, kw_only=True)
class FaceWind:
    """The air as the faces meet it.

    Attributes:
        normal: (face, 3, batch) unit normals of the deformed faces.
        relative: (face, 3, batch) wind less face velocity [m/s].
        across: (face, 1, batch) its part along the normal [m/s].
    """

    normal: Tensor
    relative: Tensor
    across: Tensor

    @property
    def along(self) -> Tensor:
        """(face, 3, batch) the tangential part of the relative wind [m/s]."""
        return self.relative - self.across * self.normal


def face_wind(cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> FaceWind:
    """Computes the relative wind on the faces, for a wind (3, batch) or (vertex, 3, batch)
    [m/s]."""
    if on_mesh.usable(position, velocity, wind):
        normal, relative, across = on_mesh.face_wind(cloth.faces, position, velocity, wind)
        return FaceWind(normal=normal, relative=relative, across=across)
    x0, x1, x2 = cloth.at_corners(position)
    normal = torch.linalg.cross(x1 - x0, x2 - x0, dim=1)
    length = (normal * normal).sum(1, keepdim=True).sqrt()
    normal = normal / length.clamp(min=torch.finfo(position.dtype).tiny)
    at_vertices = wind - velocity
    r0, r1, r2 = cloth.at_corners(at_vertices)
    relative = (r0 + r1 + r2) / 3
    return FaceWind(
        normal=normal, relative=relative, across=(relative * normal).sum(1, keepdim=True)
    )


@dataclass(frozen=True, kw_only=True)
class QuadraticNormal:
    """The reference simulator's wind.

    Attributes:
        density: ρ [kg/m³], null value 0.
        drag: c of the linear tangential part [kg/(m² s)], null value 0.
    """

    density: float = 1.0
    drag: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("density", self.density), ("drag", self.drag)):
            if not (math.isfinite(value) and value >= 0):
                raise InputError(
                    f"{name} {value!r} is negative or not finite",
                    where="wind force",
                    fix="give at least 0",
                )

    @property
    def plain(self) -> QuadraticNormal:
        """Itself."""
        return self

    @property
    def factors(self) -> tuple[object, ...]:
        """None of them."""
        return ()

    def force(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N] for a wind (3, batch) or (vertex, 3, batch)
        [m/s]."""
        relative = face_wind(cloth, position, velocity, wind)
        third = (cloth.areas / 3)[:, None, None]
        push = third * (
            self.density * relative.across.abs() * relative.across * relative.normal
            + self.drag * relative.along
        )
        return cloth.shared_out(push)

    def beyond(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Returns zeros: (vertex, 3, batch) [N]."""
        return torch.zeros_like(position)


NO_AIR = QuadraticNormal(density=0.0)


@dataclass(frozen=True, kw_only=True)
class Stokes:
    """The paper's text: 6 π R η times the relative velocity, on every vertex.

    Attributes:
        viscosity: η [Pa·s], null value 0.
    """

    viscosity: float = _VISCOSITY

    def __post_init__(self) -> None:
        if not (math.isfinite(self.viscosity) and self.viscosity >= 0):
            raise InputError(
                f"viscosity {self.viscosity!r} is negative or not finite",
                where="wind force",
                fix="give at least 0",
            )

    @property
    def plain(self) -> QuadraticNormal:
        """None of it acts."""
        return NO_AIR

    @property
    def factors(self) -> None:
        """It is another force."""
        return None

    def force(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N] for a wind (3, batch) or (vertex, 3, batch)
        [m/s]."""
        areas = torch.tensor(cloth.mesh.vertex_areas, dtype=position.dtype, device=position.device)
        coefficient = 6 * math.pi * self.viscosity * (areas / math.pi).sqrt()
        return coefficient[:, None, None] * (wind - velocity)

    def beyond(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Returns all of the force: (vertex, 3, batch) [N]."""
        return self.force(cloth, position, velocity, wind)


AIR_FORCES = Registry(
    "wind force",
    {
        "quadratic-normal": "sim.cloth.air:QuadraticNormal",
        "stokes": "sim.cloth.air:Stokes",
    },
)
