"""Out-of-plane forces: hinges with tabulated stiffness in the fold angle.

For the edge i→j with face (i, j, k) on its left and (j, i, l) on its right, the fold angle θ is
positive where k and l rise along the normals (a valley). The energy is k S θ²/4 with S = l²/(2(a0 +
a1)), the force −k S (θ + d dθ/dt)/2 ∇θ, k frozen. The gradient is n/h at the opposite corners and
−Σ w n/h at the edge's ends, with h the altitudes and w the barycentric feet (Bridson, Marino,
Fedkiw 2003; Grinspun et al. 2003; as in ArcSim 0.2.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from sim.cloth import on_mesh
from sim.cloth.cloth_batch import Cloth, gather_sum
from sim.cloth.stiffness_tables import bending_stiffness

# Lengths below this share of the edge are held there, so that a collapsed triangle pushes back with
# a finite force.
_MIN_ALTITUDE = 1e-3


@dataclass(frozen=True, kw_only=True)
class Fold:
    """Fold angles θ (hinge, batch) [rad] and their gradients at the corners i, j, k, l: (hinge, 3,
    batch) [1/m]."""

    angle: Tensor
    gradient: tuple[Tensor, Tensor, Tensor, Tensor]


def fold(cloth: Cloth, position: Tensor) -> Fold:
    """Computes fold angles of positions (vertex, 3, batch) [m], in (−π, π]."""
    if on_mesh.usable(position):
        angle, gradient = on_mesh.fold(cloth.hinges, position)
        return Fold(angle=angle, gradient=gradient)
    xi, xj, xk, xl = (position[cloth.hinges[:, c]] for c in range(4))
    edge = xj - xi
    left, right = xk - xi, xl - xi
    normal0 = torch.linalg.cross(edge, left, dim=1)
    normal1 = torch.linalg.cross(right, edge, dim=1)
    square = (edge * edge).sum(1, keepdim=True)
    length = square.sqrt()
    # |edge × left| = length · altitude; the altitude is floored, the direction kept.
    doubled0 = (normal0 * normal0).sum(1, keepdim=True).sqrt()
    doubled1 = (normal1 * normal1).sum(1, keepdim=True).sqrt()
    floor = _MIN_ALTITUDE * square
    tiny = torch.finfo(position.dtype).tiny
    n0 = normal0 / doubled0.clamp(min=tiny)
    n1 = normal1 / doubled1.clamp(min=tiny)
    gk = n0 * (length / torch.maximum(doubled0, floor))
    gl = n1 * (length / torch.maximum(doubled1, floor))
    w0 = (edge * left).sum(1, keepdim=True) / square
    w1 = (edge * right).sum(1, keepdim=True) / square
    sine = -(edge * torch.linalg.cross(n0, n1, dim=1)).sum(1) / length[:, 0]
    cosine = (n0 * n1).sum(1)
    return Fold(
        angle=torch.atan2(sine, cosine),
        gradient=(-(1 - w0) * gk - (1 - w1) * gl, -w0 * gk - w1 * gl, gk, gl),
    )


def fold_angle(cloth: Cloth, position: Tensor) -> Tensor:
    """Computes fold angles (hinge, batch) [rad] alone."""
    return (
        on_mesh.fold_angle(cloth.hinges, position)
        if on_mesh.usable(position)
        else fold(cloth, position).angle
    )


def stiffness(cloth: Cloth, angle: Tensor) -> Tensor:
    """Computes k S / 2 at fold angles (hinge, batch): (hinge, batch) [N·m/rad]."""
    curvature = angle * cloth.hinge_column[:, None]
    k = bending_stiffness(curvature, cloth.segments, cloth.hinge_rows, cloth.evaluation)
    k = k * (cloth.hinge_shape[:, None] / 2)
    return k if cloth.stiffening is None else k * (1 + cloth.stiffening)


def corner_forces(cloth: Cloth, position: Tensor, velocity: Tensor) -> list[Tensor]:
    """Computes elastic and damping forces on the four corners of every hinge: (hinge, 3, batch)
    each [N]."""
    f = fold(cloth, position)
    return _corners(cloth, f, stiffness(cloth, f.angle), velocity)


def _corners(cloth: Cloth, f: Fold, k: Tensor, velocity: Tensor) -> list[Tensor]:
    """Computes corner forces (hinge, 3, batch) [N] of hinges of stiffness k (hinge, batch)
    [N·m/rad]."""
    rate = torch.zeros_like(f.angle)
    for corner, gradient in enumerate(f.gradient):
        rate = rate + (gradient * velocity[cloth.hinges[:, corner]]).sum(1)
    moment = -k * (f.angle + cloth.damping * rate)
    return [moment.unsqueeze(1) * gradient for gradient in f.gradient]


def force(cloth: Cloth, position: Tensor, velocity: Tensor) -> Tensor:
    """Computes elastic and damping forces at the vertices: (vertex, 3, batch) [N]."""
    if not len(cloth.hinges):
        return torch.zeros_like(position)
    return gather_sum(corner_forces(cloth, position, velocity), cloth.hinge_slots)


def energy(cloth: Cloth, position: Tensor) -> Tensor:
    """Computes the stored energy k S θ²/4: (batch,) [J]; exact for constant stiffness."""
    angle = fold_angle(cloth, position)
    return (stiffness(cloth, angle) * angle**2).sum(0) / 2


@dataclass(frozen=True, kw_only=True)
class LinearisedBending:
    """The Gauss–Newton stiffness of the hinges at one state: k S/2 ∇θ ∇θᵀ."""

    cloth: Cloth
    fold: Fold
    k: Tensor

    @classmethod
    def at(cls, cloth: Cloth, position: Tensor) -> LinearisedBending:
        f = fold(cloth, position)
        return cls(cloth=cloth, fold=f, k=stiffness(cloth, f.angle))

    def force(self) -> Tensor:
        """Computes the elastic force at this state: (vertex, 3, batch) [N]."""
        moment = (-self.k * self.fold.angle).unsqueeze(1)
        return gather_sum([moment * g for g in self.fold.gradient], self.cloth.hinge_slots)

    def corner_products(self, field: Tensor) -> list[Tensor]:
        """Stiffness times a vertex field (vertex, 3, batch), at the corners: (hinge, 3, batch)
        each."""
        rate = torch.zeros_like(self.k)
        for corner, gradient in enumerate(self.fold.gradient):
            rate = rate + (gradient * field[self.cloth.hinges[:, corner]]).sum(1)
        moment = (self.k * rate).unsqueeze(1)
        return [moment * gradient for gradient in self.fold.gradient]

    def diagonal(self) -> list[Tensor]:
        """Computes the diagonal at the corners: (hinge, 3, batch) each [N/m]."""
        return [self.k.unsqueeze(1) * gradient**2 for gradient in self.fold.gradient]
