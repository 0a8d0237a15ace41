"""A triangulation of the flat cloth that is edited: edges split, flipped and collapsed.

Vertices keep their numbers; new ones are added at the end, and those that are gone have no faces
left. A vertex is new only as the middle of an edge, so that any field on the cloth is carried over
by means of two values, which is exact for fields that are linear on faces; flips and collapses move
no vertex.
"""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from sim.cloth.mesh import Mesh

LEAST_QUALITY = 0.1
"""Of a triangle that a flip or a collapse makes: 12 √3 times its area over its perimeter squared; 1
has equal sides."""
_STRAIGHT = 1e-12
"""Sine below which two edges of the rim lie on one line."""


class Triangles:
    """Faces around vertices.

    Attributes:
        rest: (u, v) of each vertex [m].
        around: vertex → {j: k} for each of its faces (i, j, k), counter-clockwise.
        halves: for each vertex that was added, the two that it lies between.
        fixed: vertices that stay; edges between two of them stay too.
    """

    def __init__(self, mesh: Mesh, *, fixed: frozenset[int] = frozenset()) -> None:
        self.rest: list[tuple[float, float]] = [(u, v) for u, v in mesh.rest.tolist()]
        self.around: list[dict[int, int]] = [{} for _ in self.rest]
        self.halves: list[tuple[int, int]] = []
        self.fixed = fixed
        self._start = len(self.rest)
        for face in mesh.faces.tolist():
            self._add(*face)

    def edges(self) -> list[tuple[int, int]]:
        """Lists every edge once, in ascending order of its vertices."""
        both = {
            (min(i, j), max(i, j))
            for i, star in enumerate(self.around)
            for j in (*star, *star.values())
        }
        return sorted(both)

    def opposite(self, i: int, j: int) -> int | None:
        """Returns the third corner of the face on the left of i → j; None beyond the rim."""
        return self.around[i].get(j)

    def neighbours(self, i: int) -> set[int]:
        return {*self.around[i], *self.around[i].values()}

    def adjacent(self, i: int, j: int) -> bool:
        return j in self.around[i] or i in self.around[j]

    def held(self, i: int, j: int) -> bool:
        """Returns whether an edge stays as it is."""
        return i in self.fixed and j in self.fixed

    def doubled_area(self, i: int, j: int, k: int) -> float:
        (ui, vi), (uj, vj), (uk, vk) = self.rest[i], self.rest[j], self.rest[k]
        return (uj - ui) * (vk - vi) - (vj - vi) * (uk - ui)

    def quality(self, i: int, j: int, k: int) -> float:
        """Returns 1 for equal sides, 0 for a sliver, less for a triangle that is turned over."""
        perimeter = math.dist(self.rest[i], self.rest[j]) + math.dist(self.rest[j], self.rest[k])
        perimeter += math.dist(self.rest[k], self.rest[i])
        return 6 * math.sqrt(3) * self.doubled_area(i, j, k) / perimeter**2

    def split(self, i: int, j: int) -> int:
        """Divides an edge in two at its middle, with the faces beside it; returns the new
        vertex."""
        middle = len(self.rest)
        (ui, vi), (uj, vj) = self.rest[i], self.rest[j]
        self.rest.append(((ui + uj) / 2, (vi + vj) / 2))
        self.around.append({})
        self.halves.append((i, j))
        for first, second in ((i, j), (j, i)):
            third = self.opposite(first, second)
            if third is not None:
                self._drop(first, second, third)
                self._add(first, middle, third)
                self._add(middle, second, third)
        return middle

    def flip(self, i: int, j: int) -> tuple[int, int] | None:
        """Replaces an inner edge by the other diagonal, which is returned; None, and no change,
        where it would be one of the mesh already, lie outside, or make slivers."""
        k, l = self.opposite(i, j), self.opposite(j, i)  # noqa: E741  corners as in `Mesh.hinges`
        if k is None or l is None or self.held(i, j) or self.adjacent(k, l):
            return None
        if min(self.quality(i, l, k), self.quality(l, j, k)) < LEAST_QUALITY:
            return None
        self._drop(i, j, k)
        self._drop(j, i, l)
        self._add(i, l, k)
        self._add(l, j, k)
        return k, l

    def collapsible(self, i: int, j: int) -> bool:
        """Returns whether a vertex can be merged into its neighbour: the cloth keeps its outline
        and its topology, and no triangle becomes a sliver."""
        if i in self.fixed:
            return False
        sides = {self.around[i].get(j), self.around[j].get(i)} - {None}
        if self.neighbours(i) & self.neighbours(j) != sides:
            return False
        star = self.around[i]
        rim = {*star} ^ {*star.values()}
        if rim and (len(rim) != 2 or j not in rim or not self._straight(i, *rim)):
            return False
        left = [(a, b) for a, b in star.items() if j not in (a, b)]
        return bool(left) and all(self.quality(j, a, b) >= LEAST_QUALITY for a, b in left)

    def collapse(self, i: int, j: int) -> list[int]:
        """Merges a vertex into its neighbour, where that is `collapsible`; returns those whose
        faces changed."""
        star = dict(self.around[i])
        for a, b in star.items():
            self._drop(i, a, b)
        for a, b in star.items():
            if j not in (a, b):
                self._add(j, a, b)
        return [j, *({*star, *star.values()} - {j})]

    def _straight(self, i: int, a: int, b: int) -> bool:
        """Whether a vertex of the rim lies on the line between its neighbours there."""
        reach = math.dist(self.rest[a], self.rest[i]) * math.dist(self.rest[i], self.rest[b])
        return abs(self.doubled_area(a, i, b)) <= _STRAIGHT * reach

    def _add(self, i: int, j: int, k: int) -> None:
        self.around[i][j], self.around[j][k], self.around[k][i] = k, i, j

    def _drop(self, i: int, j: int, k: int) -> None:
        del self.around[i][j], self.around[j][k], self.around[k][i]

    def mesh(self) -> tuple[Mesh, IntArray]:
        """Returns the mesh of the vertices that are left, and their numbers here (vertex,)."""
        left = [i for i, star in enumerate(self.around) if star]
        number = {vertex: index for index, vertex in enumerate(left)}
        faces = [
            (number[i], number[j], number[k])
            for i, star in enumerate(self.around)
            for j, k in star.items()
            if i < j and i < k
        ]
        rest = np.array([self.rest[i] for i in left])
        return Mesh(rest=rest, faces=np.array(sorted(faces))), np.array(left, dtype=np.int64)

    def carried(self, field: FloatArray) -> FloatArray:
        """Returns a field (vertex, …) of the mesh it began with on all vertices that there have
        been since."""
        values = np.empty((len(self.rest), *field.shape[1:]))
        values[: self._start] = field
        for vertex, (i, j) in enumerate(self.halves, start=self._start):
            values[vertex] = (values[i] + values[j]) / 2
        return values
