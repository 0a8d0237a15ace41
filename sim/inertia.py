"""Air that moves with the cloth: mass that counts for motion along the normals only.

A vertex of mass m with unit normal n and added mass m_a obeys (m I + m_a n nᵀ) a = F, hence

    m a = F − m_a / (m + m_a) n (n·F)                                       (Sherman–Morrison)

so that an explicit integrator goes on with the cloth's own mass and a changed force.
"""

from __future__ import annotations

import torch
from torch import Tensor

from sim.cloth import Cloth, gather_sum


def area_vectors(cloth: Cloth, position: Tensor) -> Tensor:
    """A third of the deformed faces' area vectors around every vertex: (vertex, 3, batch) [m²]."""
    x0, x1, x2 = (position[cloth.faces[:, c]] for c in range(3))
    third = torch.linalg.cross(x1 - x0, x2 - x0, dim=1) / 6
    return gather_sum([third, third, third], cloth.face_slots)


def vertex_normals(cloth: Cloth, position: Tensor) -> Tensor:
    """Unit normals at the vertices, the faces' weighted by their areas: (vertex, 3, batch)."""
    area = area_vectors(cloth, position)
    length = (area * area).sum(1, keepdim=True).sqrt()
    return area / length.clamp(min=torch.finfo(position.dtype).tiny)


def normal_rates(cloth: Cloth, position: Tensor, velocity: Tensor) -> Tensor:
    """Time derivative ṅ of the unit normals at the vertices: (vertex, 3, batch) [1/s]."""
    x0, x1, x2 = (position[cloth.faces[:, c]] for c in range(3))
    v0, v1, v2 = (velocity[cloth.faces[:, c]] for c in range(3))
    sixth = (torch.linalg.cross(v1 - v0, x2 - x0, dim=1) + torch.linalg.cross(x1 - x0, v2 - v0, dim=1)) / 6
    rate = gather_sum([sixth, sixth, sixth], cloth.face_slots)
    area = area_vectors(cloth, position)
    size = (area * area).sum(1, keepdim=True).sqrt().clamp(min=torch.finfo(position.dtype).tiny)
    normal = area / size
    return (rate - (rate * normal).sum(1, keepdim=True) * normal) / size


def effective(force: Tensor, *, mass: Tensor, added: Tensor, normals: Tensor) -> Tensor:
    """The force that gives the cloth's own mass the acceleration it has with the added mass: (vertex, 3, batch) [N].

    Args:
        force: (vertex, 3, batch) [N].
        mass: (vertex, batch) the cloth's [kg].
        added: (vertex, batch) the air's [kg].
        normals: (vertex, 3, batch).
    """
    share = (added / (mass + added)).unsqueeze(1)
    return force - share * (normals * force).sum(1, keepdim=True) * normals
