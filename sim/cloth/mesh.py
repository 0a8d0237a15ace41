"""A triangulated piece of cloth at rest: its topology, areas and hinges, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from sim.cloth.cloth_ends import Ends, ends_of

# Twice the area over the squared longest edge; an equilateral triangle has 0.87. Below this it is a
# sliver on which shape derivatives lose half the digits of float32.
_MIN_ASPECT = 1e-3


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Cloth in its flat rest state.

    Attributes:
        rest: (vertex, 2) material coordinates u (warp), v (weft) [m].
        faces: (face, 3) vertex indices, counter-clockwise in (u, v).

    Raises:
        InputError: wrong shapes, indices out of range, inverted or degenerate triangles, edges with
            more than two faces or faces of opposed orientation, vertices that no face uses.
    """

    rest: FloatArray
    faces: IntArray

    def __post_init__(self) -> None:
        rest = np.array(self.rest, dtype=np.float64)
        faces = np.array(self.faces, dtype=np.int64)
        if rest.ndim != 2 or rest.shape[1:] != (2,):
            raise InputError(
                f"rest coordinates have shape {rest.shape}",
                where="mesh",
                fix="give (vertex, 2) in metres",
            )
        if faces.ndim != 2 or faces.shape[1:] != (3,) or not len(faces):
            raise InputError(
                f"faces have shape {faces.shape}",
                where="mesh",
                fix="give (face, 3), at least one face",
            )
        for array in (rest, faces):
            array.setflags(write=False)
        object.__setattr__(self, "rest", rest)
        object.__setattr__(self, "faces", faces)
        self._check()

    def _check(self) -> None:
        if not np.isfinite(self.rest).all():
            vertex = int(np.flatnonzero(~np.isfinite(self.rest).all(axis=1))[0])
            raise InputError(
                "a rest coordinate is not finite",
                where=f"vertex {vertex}",
                fix="give finite metres",
            )
        if self.faces.min() < 0 or self.faces.max() >= len(self.rest):
            face = int(
                np.flatnonzero(((self.faces < 0) | (self.faces >= len(self.rest))).any(axis=1))[0]
            )
            raise InputError(
                f"a vertex index is outside 0…{len(self.rest) - 1}",
                where=f"face {face}",
                fix="correct the face list",
            )
        doubled = self._doubled_areas
        corners = self.rest[self.faces]
        longest = np.max(np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=2), axis=1)
        degenerate = np.abs(doubled) < _MIN_ASPECT * longest
        degenerate |= longest == 0
        if degenerate.any():
            face = int(np.flatnonzero(degenerate)[0])
            raise InputError(
                f"{int(degenerate.sum())} triangles are degenerate (no area)",
                where=f"face {face}",
                fix="remesh the cloth",
            )
        if (doubled < 0).any():
            face = int(np.flatnonzero(doubled < 0)[0])
            raise InputError(
                f"{int((doubled < 0).sum())} triangles are inverted in the rest plane",
                where=f"face {face}",
                fix="order their vertices counter-clockwise in (u, v)",
            )
        used = np.zeros(len(self.rest), dtype=bool)
        used[self.faces] = True
        if not used.all():
            vertex = int(np.flatnonzero(~used)[0])
            raise InputError(
                f"{int((~used).sum())} vertices belong to no face",
                where=f"vertex {vertex}",
                fix="drop them",
            )
        directed = np.concatenate(
            [self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]]
        )
        unique, counts = np.unique(directed, axis=0, return_counts=True)
        if (counts > 1).any():
            edge = unique[counts > 1][0]
            raise InputError(
                "an edge is used twice in one direction: three faces on it, or two of opposed "
                "orientation",
                where=f"edge {int(edge[0])}–{int(edge[1])}",
                fix="make the surface manifold and consistently oriented",
            )

    @cached_property
    def _doubled_areas(self) -> FloatArray:
        a, b, c = (self.rest[self.faces[:, i]] for i in range(3))
        return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])

    @property
    def vertex_count(self) -> int:
        return len(self.rest)

    @cached_property
    def areas(self) -> FloatArray:
        """(face,) rest areas [m²]."""
        return self._doubled_areas / 2

    @cached_property
    def vertex_areas(self) -> FloatArray:
        """(vertex,) a third of the rest areas around each vertex [m²]; times the density, the
        lumped mass."""
        return np.bincount(
            self.faces.ravel(), weights=np.repeat(self.areas / 3, 3), minlength=self.vertex_count
        ).astype(np.float64)

    @cached_property
    def gradients(self) -> FloatArray:
        """(face, 2, 3) derivatives of a linear field: ∂f/∂(u, v) = gradients @ (its three corner
        values) [1/m]."""
        a, b, c = (self.rest[self.faces[:, i]] for i in range(3))
        edges = np.stack([b - a, c - a], axis=2)
        inverse = np.linalg.inv(edges)
        differences = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
        return np.einsum("fji,jc->fic", inverse, differences)

    @cached_property
    def arms(self) -> FloatArray:
        """(face, 3, 2) corners relative to the face's centroid, at rest [m]."""
        corners = self.rest[self.faces]
        return corners - corners.mean(axis=1, keepdims=True)

    @cached_property
    def hinges(self) -> IntArray:
        """(hinge, 4) inner edges as [i, j, k, l]: the edge runs i→j in face (i, j, k) and j→i in
        face (j, i, l)."""
        start = self.faces.ravel()
        end = np.roll(self.faces, -1, axis=1).ravel()
        opposite = np.roll(self.faces, -2, axis=1).ravel()
        code = {(int(s), int(e)): int(o) for s, e, o in zip(start, end, opposite, strict=True)}
        inner = [(s, e, o, code[e, s]) for (s, e), o in code.items() if s < e and (e, s) in code]
        return np.array(inner, dtype=np.int64).reshape(-1, 4)

    @cached_property
    def boundary(self) -> IntArray:
        """Sorted indices of the vertices on an edge with one face."""
        forward = np.stack([self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()], axis=1)
        pairs, counts = np.unique(np.sort(forward, axis=1), axis=0, return_counts=True)
        return np.unique(pairs[counts == 1])

    @cached_property
    def ends(self) -> Ends:
        """Vertices at u's least and largest, and what fields are continued to them from."""
        return ends_of(self.rest)

    @cached_property
    def hinge_lengths(self) -> FloatArray:
        """(hinge,) rest lengths of the inner edges [m]."""
        edge = self.rest[self.hinges[:, 1]] - self.rest[self.hinges[:, 0]]
        return np.hypot(edge[:, 0], edge[:, 1])

    @cached_property
    def hinge_areas(self) -> FloatArray:
        """(hinge,) rest areas of both faces of a hinge, summed [m²]."""
        i, j, k, l = self.hinges.T  # noqa: E741  the four corners as in `hinges`
        return _areas(self.rest, i, j, k) + _areas(self.rest, j, i, l)

    @cached_property
    def hinge_directions(self) -> FloatArray:
        """(hinge,) directions of the inner edges in the cloth, from u, folded to [0, π/2]."""
        edge = np.abs(self.rest[self.hinges[:, 1]] - self.rest[self.hinges[:, 0]])
        return np.arctan2(edge[:, 1], edge[:, 0])

    def components(self) -> IntArray:
        """Labels the connected piece that each vertex belongs to, (vertex,)."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        rows, columns = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        n = self.vertex_count
        graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        return connected_components(graph, directed=False)[1].astype(np.int64)


def _areas(rest: FloatArray, i: IntArray, j: IntArray, k: IntArray) -> FloatArray:
    e, f = rest[j] - rest[i], rest[k] - rest[i]
    return (e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]) / 2


class Diagonals(StrEnum):
    """How the cells of a grid are cut in two."""

    ALTERNATE = "alternate"
    """Cells with i + j even from their first corner, the others the other way: no direction is
    preferred."""
    FORWARD = "forward"
    """All from their first corner."""


def grid(
    *,
    width: float,
    height: float,
    columns: int,
    rows: int,
    diagonals: Diagonals = Diagonals.ALTERNATE,
) -> Mesh:
    """Makes a rectangle of `columns × rows` cells, each two triangles.

    Vertex `i * (rows + 1) + j` is at u = width·i/columns, v = height·j/rows: the hoist (u = 0)
    comes first.

    Raises:
        InputError: a size that is not positive, or no cells.
    """
    if not (width > 0 and height > 0):
        raise InputError(
            f"the grid measures {width} m × {height} m", where="mesh", fix="give positive sizes"
        )
    if columns < 1 or rows < 1:
        raise InputError(
            f"the grid has {columns} × {rows} cells", where="mesh", fix="give at least one of each"
        )
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1), indexing="ij")
    rest = np.stack([width * i.ravel() / columns, height * j.ravel() / rows], axis=1)
    ci, cj = (
        index.ravel() for index in np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    )
    a = ci * (rows + 1) + cj
    b, c, d = a + rows + 1, a + rows + 2, a + 1
    first = ((ci + cj) % 2 == 0)[:, None, None] | (diagonals is Diagonals.FORWARD)
    even = np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1)
    odd = np.stack([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)], axis=1)
    return Mesh(rest=rest, faces=np.where(first, even, odd).reshape(-1, 3))
