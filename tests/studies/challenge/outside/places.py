"""Loads at points of the flat cloth, shared out to the corners of the faces they lie in."""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray
from sim.cloth.mesh import Mesh

_TOLERANCE = 1e-9


def shares(mesh: Mesh, points: FloatArray) -> FloatArray:
    """(point, vertex) barycentric weights at points (point, 2) of the cloth [m]: a point's centre
    of mass is kept."""
    corners = mesh.rest[mesh.faces]
    relative = points[:, None] - corners[None, :, 0]
    inner = np.einsum("fac,pfa->pfc", mesh.gradients, relative)
    inner[..., 0] += 1.0
    within = inner.min(axis=2)
    face = within.argmax(axis=1)
    if (within.max(axis=1) < -_TOLERANCE).any():
        raise ValueError("a point is not on the cloth")
    result = np.zeros((len(points), mesh.vertex_count))
    rows = np.arange(len(points))
    np.add.at(result, (rows[:, None], mesh.faces[face]), inner[rows, face])
    return result


def inside(mesh: Mesh, u: float, v: float) -> FloatArray:
    """(2,) the point at shares of the cloth's width and height [m]."""
    low, high = mesh.rest.min(axis=0), mesh.rest.max(axis=0)
    return low + np.array([u, v]) * (high - low)
