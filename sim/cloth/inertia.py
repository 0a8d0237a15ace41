"""Air that moves with the cloth: mass that counts for motion along the normals only.

A vertex of mass m with normal n and added mass m_a obeys (m I + m_a n nᵀ) a = F, hence

    m a = F − m_a / (m + m_a n²) n (n·F)                                    (Sherman–Morrison)

so that an explicit integrator goes on with the cloth's own mass and a changed force.

The normals are means over the faces around a vertex, weighted by area and divided by the rest area:
of length 1 where the cloth is flat, shorter across a fold that the mesh does not resolve, where the
air has no one way to go. They are smooth in the positions, which unit normals are not.
"""

from __future__ import annotations

import torch
from torch import Tensor

from sim.cloth import on_mesh
from sim.cloth.cloth_batch import Cloth


def rest_areas(cloth: Cloth) -> Tensor:
    """Computes a third of the faces' rest areas around each vertex, (vertex,) [m²]."""
    return torch.as_tensor(cloth.mesh.vertex_areas, dtype=cloth.dtype, device=cloth.device)


def mean_normals(cloth: Cloth, position: Tensor) -> Tensor:
    """Computes mean normals at the vertices (see above): (vertex, 3, batch)."""
    return cloth.shared_out(_sixths(cloth, position)) / rest_areas(cloth)[:, None, None]


def mean_normal_rates(cloth: Cloth, position: Tensor, velocity: Tensor) -> Tensor:
    """Computes the time derivative of `mean_normals`: (vertex, 3, batch) [1/s]."""
    return (
        cloth.shared_out(_sixth_rates(cloth, position, velocity)) / rest_areas(cloth)[:, None, None]
    )


def _sixths(cloth: Cloth, position: Tensor) -> Tensor:
    """Computes a third of the faces' normals, as long as the faces are large: (face, 3, batch)
    [m²]."""
    if on_mesh.usable(position):
        return on_mesh.sixths(cloth.faces, position)
    x0, x1, x2 = cloth.at_corners(position)
    return torch.linalg.cross(x1 - x0, x2 - x0, dim=1) / 6


def _sixth_rates(cloth: Cloth, position: Tensor, velocity: Tensor) -> Tensor:
    """Computes the time derivative of `_sixths`: (face, 3, batch) [m²/s]."""
    if on_mesh.usable(position, velocity):
        return on_mesh.sixth_rates(cloth.faces, position, velocity)
    x0, x1, x2 = cloth.at_corners(position)
    v0, v1, v2 = cloth.at_corners(velocity)
    return (
        torch.linalg.cross(v1 - v0, x2 - x0, dim=1) + torch.linalg.cross(x1 - x0, v2 - v0, dim=1)
    ) / 6


def effective(force: Tensor, *, mass: Tensor, added: Tensor, normals: Tensor) -> Tensor:
    """Computes the force that gives the cloth's own mass the acceleration it has with the added
    mass: (vertex, 3, batch) [N].

    Args:
        force: (vertex, 3, batch) [N].
        mass: (vertex, batch) the cloth's [kg].
        added: (vertex, batch) the air's [kg].
        normals: (vertex, 3, batch), of any length.
    """
    mass, added = mass.unsqueeze(1), added.unsqueeze(1)
    share = added / (mass + added * (normals * normals).sum(1, keepdim=True))
    return force - share * (normals * force).sum(1, keepdim=True) * normals
