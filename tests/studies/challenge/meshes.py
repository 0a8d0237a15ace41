"""The generator's meshes, and what tracked markers see of them."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline

from flagdata.core.arrays import FloatArray
from sim.cloth.mesh import Mesh, grid
from tests.studies.challenge.recipe import ChallengeRecipe, Diagonals, Numerics


def mesh_of(numerics: Numerics, *, width: float, height: float) -> Mesh:
    """A grid of columns × rows cells, vertices in the order of `sim.cloth.mesh.grid`."""
    mesh = grid(width=width, height=height, columns=numerics.columns, rows=numerics.rows)
    if numerics.diagonals is Diagonals.ALTERNATE:
        return mesh
    column, row = (
        i.ravel()
        for i in np.meshgrid(np.arange(numerics.columns), np.arange(numerics.rows), indexing="ij")
    )
    a = column * (numerics.rows + 1) + row
    b, c, d = a + numerics.rows + 1, a + numerics.rows + 2, a + 1
    faces = np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1)
    return Mesh(rest=mesh.rest, faces=faces.reshape(-1, 3))


def layout(recipe: ChallengeRecipe, rng: np.random.Generator) -> FloatArray:
    """(marker, 2) rest coordinates [m]: an uneven grid, each marker moved by up to `jitter` of the
    spacing, those on the edges along them only, in random order."""
    shape = (recipe.marker_columns, recipe.marker_rows)
    size = np.array([recipe.width, recipe.height])
    places = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"), axis=-1)
    moved = rng.uniform(-recipe.jitter, recipe.jitter, places.shape) / (np.array(shape) - 1)
    moved[[0, -1], :, 0] = 0.0
    moved[:, [0, -1], 1] = 0.0
    return rng.permutation((places + moved).reshape(-1, 2) * size)


def seen(numerics: Numerics, markers: FloatArray, *, width: float, height: float) -> FloatArray:
    """(marker, vertex) weights of the surface through the vertices: cubic splines along u and v
    (not-a-knot).

    The fitter interpolates otherwise; facets would add an error of a few millimetres that no cloth
    has.
    """
    along_u = _spline(numerics.columns, width, markers[:, 0])
    along_v = _spline(numerics.rows, height, markers[:, 1])
    return (along_u[:, :, None] * along_v[:, None, :]).reshape(len(markers), -1)


def _spline(cells: int, length: float, at: FloatArray) -> FloatArray:
    """(point, knot) weights of the cubic spline through values at equally spaced knots."""
    return make_interp_spline(np.linspace(0, length, cells + 1), np.eye(cells + 1), k=3)(at)
