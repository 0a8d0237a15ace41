"""In-plane forces: linear triangles with tabulated stiffness in the Green strain.

On a face of rest area a, with F = [x_u x_v] (3×2) and G = (FᵀF − I)/2, the force is

    −a [k0 G00 ∇G00 + k2 G11 ∇G11 + k1 (G00 ∇G11 + G11 ∇G00) + 2 k3 G01 ∇G01]

with k looked up at G and frozen (no ∂k/∂G), as ArcSim 0.2.1 does. Damping is Kelvin–Voigt: G + d
dG/dt in place of G outside the look-up; it vanishes for rigid motion. For constant k the elastic
part derives from a/2 (k0 G00² + 2 k1 G00 G11 + k2 G11² + 2 k3 G01²), which is what `energy`
returns.
"""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from sim.cloth.cloth_batch import Cloth, gather_sum
from sim.cloth.stiffness_tables import stretching_stiffness


@dataclass(frozen=True, kw_only=True)
class Strain:
    """Deformation of the faces: x_u, x_v (face, 3, batch), and the Green strain (face, batch)."""

    xu: Tensor
    xv: Tensor
    g00: Tensor
    g11: Tensor
    g01: Tensor


def _derivatives(cloth: Cloth, field: Tensor) -> tuple[Tensor, Tensor]:
    """Computes ∂/∂u and ∂/∂v of a vertex field (vertex, 3, batch) on the faces: (face, 3, batch)
    each."""
    corners = cloth.at_corners(field)
    d = cloth.gradients[..., None, None]
    u = d[:, 0, 0] * corners[0] + d[:, 0, 1] * corners[1] + d[:, 0, 2] * corners[2]
    v = d[:, 1, 0] * corners[0] + d[:, 1, 1] * corners[1] + d[:, 1, 2] * corners[2]
    return u, v


def strain(cloth: Cloth, position: Tensor) -> Strain:
    """Computes the Green strain of positions (vertex, 3, batch) [m]."""
    xu, xv = _derivatives(cloth, position)
    return Strain(
        xu=xu,
        xv=xv,
        g00=((xu * xu).sum(1) - 1) / 2,
        g11=((xv * xv).sum(1) - 1) / 2,
        g01=(xu * xv).sum(1) / 2,
    )


def stiffness(cloth: Cloth, e: Strain) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Computes k0, k1, k2, k3 at a strain: (face, batch) each [N/m]."""
    return stretching_stiffness(e.g00, e.g11, e.g01, cloth.samples, cloth.table_of, cloth.grid)


def corner_forces(cloth: Cloth, position: Tensor, velocity: Tensor) -> list[Tensor]:
    """Computes elastic and damping forces on the three corners of every face: (face, 3, batch) each
    [N]."""
    e = strain(cloth, position)
    k0, k1, k2, k3 = stiffness(cloth, e)
    vu, vv = _derivatives(cloth, velocity)
    d = cloth.damping
    s00 = e.g00 + d * (e.xu * vu).sum(1)
    s11 = e.g11 + d * (e.xv * vv).sum(1)
    s01 = e.g01 + d * ((e.xu * vv).sum(1) + (e.xv * vu).sum(1)) / 2
    return _corners(cloth, e, k0 * s00 + k1 * s11, k2 * s11 + k1 * s00, k3 * s01)


def _corners(cloth: Cloth, e: Strain, t00: Tensor, t11: Tensor, t01: Tensor) -> list[Tensor]:
    """Computes corner forces of a stress (face, batch) [N/m]: −a (t00 ∇G00 + t11 ∇G11 + 2 t01
    ∇G01)."""
    a = cloth.areas[:, None]
    t00, t11, t01 = ((a * t).unsqueeze(1) for t in (t00, t11, t01))
    pu = t00 * e.xu + t01 * e.xv
    pv = t11 * e.xv + t01 * e.xu
    g = cloth.gradients[..., None, None]
    return [-(g[:, 0, c] * pu + g[:, 1, c] * pv) for c in range(3)]


def force(cloth: Cloth, position: Tensor, velocity: Tensor) -> Tensor:
    """Computes elastic and damping forces at the vertices: (vertex, 3, batch) [N]."""
    return gather_sum(corner_forces(cloth, position, velocity), cloth.face_slots)


def energy(cloth: Cloth, position: Tensor) -> Tensor:
    """Computes the stored energy: (batch,) [J]; exact for constant stiffness (module docstring)."""
    e = strain(cloth, position)
    k0, k1, k2, k3 = stiffness(cloth, e)
    density = k0 * e.g00**2 + 2 * k1 * e.g00 * e.g11 + k2 * e.g11**2 + 2 * k3 * e.g01**2
    return (cloth.areas[:, None] * density).sum(0) / 2


@dataclass(frozen=True, kw_only=True)
class LinearisedMembrane:
    """The stiffness of the faces at one state, ready to be applied to many fields.

    The geometric part of the Hessian is kept where it is positive (tension); where it is not, and
    for the shear term, it is left out, so that the operator is positive semi-definite (as
    ArcSim's).
    """

    cloth: Cloth
    e: Strain
    k: tuple[Tensor, Tensor, Tensor, Tensor]
    tension_u: Tensor
    tension_v: Tensor

    @classmethod
    def at(cls, cloth: Cloth, position: Tensor) -> LinearisedMembrane:
        e = strain(cloth, position)
        k0, k1, k2, k3 = stiffness(cloth, e)
        g00, g11 = e.g00.clamp(min=0), e.g11.clamp(min=0)
        tension_u = (cloth.areas[:, None] * (k0 * g00 + k1 * g11)).unsqueeze(1)
        tension_v = (cloth.areas[:, None] * (k2 * g11 + k1 * g00)).unsqueeze(1)
        return cls(cloth=cloth, e=e, k=(k0, k1, k2, k3), tension_u=tension_u, tension_v=tension_v)

    def force(self) -> Tensor:
        """Computes the elastic force at this state: (vertex, 3, batch) [N]."""
        k0, k1, k2, k3 = self.k
        e = self.e
        corners = _corners(
            self.cloth, e, k0 * e.g00 + k1 * e.g11, k2 * e.g11 + k1 * e.g00, k3 * e.g01
        )
        return gather_sum(corners, self.cloth.face_slots)

    def corner_products(self, field: Tensor) -> list[Tensor]:
        """Stiffness times a vertex field (vertex, 3, batch), at the corners: (face, 3, batch)
        each."""
        k0, k1, k2, k3 = self.k
        e = self.e
        pu, pv = _derivatives(self.cloth, field)
        s00 = (e.xu * pu).sum(1)
        s11 = (e.xv * pv).sum(1)
        s01 = ((e.xu * pv).sum(1) + (e.xv * pu).sum(1)) / 2
        corners = _corners(self.cloth, e, k0 * s00 + k1 * s11, k2 * s11 + k1 * s00, k3 * s01)
        tu, tv = self.tension_u * pu, self.tension_v * pv
        g = self.cloth.gradients[..., None, None]
        return [-c + g[:, 0, i] * tu + g[:, 1, i] * tv for i, c in enumerate(corners)]

    def diagonal(self) -> list[Tensor]:
        """Computes the 3×3 diagonal blocks' diagonals at the corners: (face, 3, batch) each
        [N/m]."""
        k0, k1, k2, k3 = self.k
        e, a = self.e, self.cloth.areas[:, None, None]
        g = self.cloth.gradients[..., None, None]
        k0, k1, k2, k3 = (k.unsqueeze(1) for k in (k0, k1, k2, k3))
        blocks = []
        for c in range(3):
            fuu, fvv = g[:, 0, c] * e.xu, g[:, 1, c] * e.xv
            fuv = (g[:, 0, c] * e.xv + g[:, 1, c] * e.xu) / 2
            elastic = a * (k0 * fuu**2 + k2 * fvv**2 + 2 * k1 * fuu * fvv + 2 * k3 * fuv**2)
            blocks.append(
                elastic + g[:, 0, c] ** 2 * self.tension_u + g[:, 1, c] ** 2 * self.tension_v
            )
        return blocks
