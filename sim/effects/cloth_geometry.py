"""Small geometry that several effects share. Up is +z."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from sim.cloth.mesh import Mesh
from sim.cloth.state import State
from sim.cloth.system import System


def norm(vectors: Tensor, *, axis: int = 1) -> Tensor:
    """Lengths along an axis, which is kept; their gradient is 0 at 0, not NaN."""
    square = (vectors * vectors).sum(axis, keepdim=True)
    positive = square > 0
    return torch.where(positive, torch.where(positive, square, 1.0).sqrt(), 0.0)


def origin(system: System, state: State) -> Tensor:
    """Computes the middle of the attachments, or of the cloth where nothing holds it, (3, batch)
    [m]."""
    return (system.anchors if len(system.held) else state.position).mean(0)


def horizontal(vectors: Tensor, *, axis: int) -> Tensor:
    """Sets the vectors' part along z to 0."""
    x, y, z = vectors.unbind(axis)
    return torch.stack([x, y, torch.zeros_like(z)], axis)


def left_of(vectors: Tensor, *, axis: int) -> Tensor:
    """Computes z × the vectors: their horizontal part turned by 90° counter-clockwise seen from
    above."""
    x, y, z = vectors.unbind(axis)
    return torch.stack([-y, x, torch.zeros_like(z)], axis)


def disturbed_wind(wind: Tensor, relative: Tensor) -> Tensor:
    """Returns the wind (3, batch) with disturbances relative to its horizontal speed.

    Args:
        wind: (3, batch) [m/s].
        relative: (3, batch) along the wind's horizontal part, to its left, and up.
    """
    level = horizontal(wind, axis=0)
    up = torch.zeros_like(wind).index_fill(0, torch.tensor(2, device=wind.device), 1.0)
    return (
        wind
        + relative[0] * level
        + relative[1] * left_of(wind, axis=0)
        + relative[2] * norm(level, axis=0) * up
    )


def boundary_edges(mesh: Mesh) -> IntArray:
    """Lists edges with one face, (edge, 2) vertices, sorted."""
    pairs = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    unique, counts = np.unique(np.sort(pairs, axis=1), axis=0, return_counts=True)
    return unique[counts == 1]


def hem_lengths(mesh: Mesh) -> FloatArray:
    """Computes half the length of the boundary edges at each vertex, (vertex,) [m]; their sum is
    the perimeter."""
    edges = boundary_edges(mesh)
    half = np.hypot(*(mesh.rest[edges[:, 1]] - mesh.rest[edges[:, 0]]).T) / 2
    return np.bincount(
        edges.ravel(), weights=np.repeat(half, 2), minlength=mesh.vertex_count
    ).astype(np.float64)


def edge_distances(mesh: Mesh) -> FloatArray:
    """Computes the distance to the nearest boundary edge in the flat cloth, (vertex,) [m]."""
    edges = boundary_edges(mesh)
    start, along = mesh.rest[edges[:, 0]], mesh.rest[edges[:, 1]] - mesh.rest[edges[:, 0]]
    offset = mesh.rest[:, None] - start
    share = np.clip((offset * along).sum(-1) / (along * along).sum(-1), 0, 1)
    distance = np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1)
    distance[mesh.boundary] = 0.0
    return distance
