"""Meshes of other kinds than the fit's: finer or coarser grids cut along either diagonal, and
irregular ones as other codes have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.spatial import Delaunay

from sim.cloth.mesh import Diagonals, Mesh, grid

_UNEVEN = 0.2  # share of the spacing by which inner vertices are moved at most


def remesh(fit: Mesh, *, finer: float, diagonals: int, uneven: np.random.Generator | None) -> Mesh:
    """Makes a mesh of another kind of the cloth of the fit's one, in its frame.

    Args:
        finer: vertices along a side over the fit's, by its mean area a vertex.
        diagonals: which way a grid's faces are cut: 0 or 1 of `Diagonals`.
        uneven: draws by which vertices are moved and joined anew; None for a grid.
    """
    low, (width, height) = fit.rest.min(axis=0), np.ptp(fit.rest, axis=0).tolist()
    spacing = math.sqrt(width * height / fit.vertex_count) / finer
    flat = grid(
        width=width,
        height=height,
        columns=max(2, round(width / spacing)),
        rows=max(2, round(height / spacing)),
        diagonals=list(Diagonals)[diagonals],
    )
    if uneven is not None:
        flat = _irregular(flat, spacing, uneven)
    return replace(flat, rest=flat.rest + low)


def _irregular(flat: Mesh, spacing: float, rng: np.random.Generator) -> Mesh:
    """Moves a grid's vertices, those inside by up to `_UNEVEN` of the spacing [m] along each axis,
    and joins them anew."""
    low, high = flat.rest.min(axis=0), flat.rest.max(axis=0)
    inside = ((flat.rest > low + spacing / 2) & (flat.rest < high - spacing / 2)).all(axis=1)
    rest = flat.rest + np.where(
        inside[:, None], rng.uniform(-_UNEVEN, _UNEVEN, flat.rest.shape) * spacing, 0.0
    )
    faces = np.asarray(Delaunay(rest).simplices, dtype=np.int64)
    (a, b), (c, d) = (rest[faces[:, k]].T - rest[faces[:, 0]].T for k in (1, 2))
    doubled = a * d - b * c
    faces[doubled < 0] = faces[doubled < 0][:, ::-1]
    # Vertices along an edge lie on a line but for rounding, which may join three of them.
    return Mesh(rest=rest, faces=faces[np.abs(doubled) > spacing**2 * np.finfo(np.float32).eps])
