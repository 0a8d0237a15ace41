"""The free edge opposite to the hoist."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import IntArray
from sim.cloth import Cloth
from sim.cloth.mesh import Mesh
from sim.effects.cloth_geometry import boundary_edges

_TOLERANCE = 1e-6


def fly(mesh: Mesh) -> IntArray:
    """(edge, 2) vertices of the boundary edges that are as far from the hoist as any."""
    pairs = boundary_edges(mesh)
    far = mesh.rest[:, 0] > mesh.rest[:, 0].max() - _TOLERANCE * float(np.ptp(mesh.rest[:, 0]))
    return pairs[far[pairs].all(axis=1)]


def half_lengths(cloth: Cloth, pairs: IntArray) -> Tensor:
    """(vertex,) half the rest length of these edges at each vertex [m]."""
    rest = cloth.mesh.rest
    half = np.hypot(*(rest[pairs[:, 1]] - rest[pairs[:, 0]]).T) / 2
    total = np.bincount(
        pairs.ravel(), weights=np.repeat(half, 2), minlength=cloth.mesh.vertex_count
    )
    return torch.as_tensor(total, dtype=cloth.dtype, device=cloth.device)
