"""Remeshing of a cloth as it is: flips, splits where edges are too long, collapses where they would
not become so.

After Narain, Samii and O'Brien (2012, section 4.2): edges longer than 1 in the metric are split,
the longest first, and the mesh is made Delaunay in the metric around each; then vertices are merged
into neighbours as long as no edge becomes longer than `SHORT` and no triangle a sliver. The metric
is that of the cloth before; the middle of an edge has the mean of its ends'.

A split keeps the momentum ρ Σ a v̄ (v̄ the mean of a face's corners, a its rest area), since a
velocity that is linear on the face is linear on its halves. A flip and a collapse change it by ρ
times the difference of Σ a v̄ over the faces concerned, which is zero where the velocity is linear
in the material over all of them. For a flip of i–j into k–l on a parallelogram of area a that is (ρ
a/6) (v_k + v_l − vᵢ − vⱼ).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import UsageError
from sim.cloth.cloth_batch import Cloth
from sim.cloth.mesh import Mesh
from sim.cloth.sizing import Remeshing, vertex_metrics
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.effect import ForceEffect
from sim.remeshing.triangles import Triangles

SHORT = 0.8
"""Length in the metric that a collapse may make an edge: below 1, so that it is not split again at
once."""
_FLIPPED = 0.01
"""Excess, of the sum of both triangles' areas, by which an edge is not Delaunay before it is
flipped."""
_FLIPS = 20
"""Most flips of an edge's surroundings, for each edge: a metric that varies can go round in
circles."""

_Metric: TypeAlias = tuple[float, float, float]
"""M_uu, M_uv, M_vv."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Adapted:
    """A mesh that took another's place.

    Attributes:
        mesh: the new one.
        triangles: what was done.
        vertices: (vertex,) numbers of its vertices in `triangles`.
    """

    mesh: Mesh
    triangles: Triangles
    vertices: IntArray

    def carried(self, field: FloatArray) -> FloatArray:
        """Returns a field (vertex, …) of the old mesh on the new one."""
        return self.triangles.carried(field)[self.vertices]


def adapt_mesh(
    mesh: Mesh,
    position: FloatArray,
    velocity: FloatArray,
    criteria: Remeshing,
    *,
    fixed: Iterable[int] = (),
) -> Adapted:
    """Remeshes a cloth at positions and velocities (vertex, 3) [m, m/s].

    Args:
        fixed: vertices that stay, as the edges between them do.
    """
    triangles = Triangles(mesh, fixed=frozenset(fixed))
    editing = _Editing(triangles, vertex_metrics(mesh, position, velocity, criteria))
    editing.flip(triangles.edges())
    editing.split()
    editing.collapse()
    remeshed, vertices = triangles.mesh()
    return Adapted(mesh=remeshed, triangles=triangles, vertices=vertices)


def remesh_state(system: System, state: State) -> tuple[System, State]:
    """Returns a cloth on a mesh that suits its shape and motion, and its state there; both as they
    are where the system has no remeshing.

    Raises:
        UsageError: several members, or what cannot be carried over to another mesh: see `check`.
    """
    criteria = system.remeshing
    if criteria is None:
        return system, state
    check(system)
    old = system.cloth
    position, velocity = (
        field[..., 0].double().cpu().numpy() for field in (state.position, state.velocity)
    )
    new = adapt_mesh(old.mesh, position, velocity, criteria, fixed=system.handles.vertices)
    cloth = Cloth.build(
        new.mesh, old.materials, evaluation=old.evaluation, dtype=old.dtype, device=old.device
    )
    held = np.searchsorted(new.vertices, np.array(system.handles.vertices, dtype=np.int64)).tolist()

    def on_new(field: FloatArray) -> Tensor:
        return torch.tensor(new.carried(field)[..., None], dtype=old.dtype, device=old.device)

    system = replace(
        system,
        cloth=cloth,
        handles=replace(system.handles, vertices=tuple(held)),
        held=torch.tensor(held, dtype=torch.int64, device=old.device),
    )
    return system, replace(state, position=on_new(position), velocity=on_new(velocity))


def check(system: System) -> None:
    """Raises:
    UsageError: several members, or effects that know the vertices: ties, memories, moved anchors,
        and what changes the cloth itself.
    """
    if system.remeshing is None:
        return
    if system.cloth.batch != 1:
        raise UsageError(
            f"{system.cloth.batch} members are simulated together, and each would have a mesh of "
            "its own",
            where="remeshing",
            fix="simulate them one by one",
        )
    cloth = system.cloth
    plain = Cloth.build(
        cloth.mesh,
        cloth.materials,
        evaluation=cloth.evaluation,
        dtype=cloth.dtype,
        device=cloth.device,
    )
    changed = (
        not torch.equal(plain.mass, cloth.mass)
        or cloth.stiffening is not None
        or system.motion is not None
    )
    bound = [part for part in system.effects if not isinstance(part, ForceEffect)]
    names = sorted({type(part).__name__ for part in (*bound, *system.ties, *system.remembering)})
    if names or changed:
        raise UsageError(
            "what acts on single vertices or folds cannot follow a mesh that changes: "
            f"{', '.join(names) or 'mass, stiffness or anchors of the cloth'}",
            where="remeshing",
            fix="leave out remeshing, or the effects that change the cloth or its attachment or "
            "have a memory",
        )


class _Editing:
    """Operations by the metric."""

    def __init__(self, triangles: Triangles, metrics: FloatArray) -> None:
        self._triangles = triangles
        self._metrics: list[_Metric] = [(m[0][0], m[0][1], m[1][1]) for m in metrics.tolist()]

    def size(self, i: int, j: int) -> float:
        """Squared length of an edge in the metric."""
        (ui, vi), (uj, vj) = self._triangles.rest[i], self._triangles.rest[j]
        u, v = uj - ui, vj - vi
        a, b = self._metrics[i], self._metrics[j]
        return ((a[0] + b[0]) * u * u + 2 * (a[1] + b[1]) * u * v + (a[2] + b[2]) * v * v) / 2

    def split(self) -> None:
        """Divides edges until none is too long, the longest first."""
        triangles = self._triangles
        while True:
            sizes = [
                (self.size(i, j), i, j) for i, j in triangles.edges() if not triangles.held(i, j)
            ]
            long = sorted(
                ((size, i, j) for size, i, j in sizes if size > 1),
                key=lambda entry: (-entry[0], *entry[1:]),
            )
            if not long:
                return
            for _, i, j in long:
                if not triangles.adjacent(i, j):
                    continue
                middle = triangles.split(i, j)
                (a, b, c), (d, e, f) = self._metrics[i], self._metrics[j]
                self._metrics.append(((a + d) / 2, (b + e) / 2, (c + f) / 2))
                self.flip(self._links([middle]))

    def collapse(self) -> None:
        """Merges vertices until none can be, the shortest edges first."""
        triangles = self._triangles
        changed = True
        while changed:
            changed = False
            for _, i, j in sorted((self.size(i, j), i, j) for i, j in triangles.edges()):
                for gone, target in ((i, j), (j, i)):
                    if triangles.adjacent(i, j) and self._may_collapse(gone, target):
                        self.flip(self._links(triangles.collapse(gone, target)))
                        changed = True
                        break

    def _may_collapse(self, gone: int, target: int) -> bool:
        added = self._triangles.neighbours(gone) - self._triangles.neighbours(target) - {target}
        return all(
            self.size(target, other) <= SHORT**2 for other in added
        ) and self._triangles.collapsible(gone, target)

    def flip(self, edges: Iterable[tuple[int, int]]) -> None:
        """Makes these edges Delaunay in the metric, and those that are concerned by it."""
        waiting = list(edges)
        left = _FLIPS * len(waiting)
        while waiting and left:
            i, j = waiting.pop()
            if not self._wrong(i, j):
                continue
            k, l = self._triangles.opposite(i, j), self._triangles.opposite(j, i)  # noqa: E741
            if self._triangles.flip(i, j) is not None and k is not None and l is not None:
                left -= 1
                waiting += [(i, l), (l, j), (j, k), (k, i)]

    def _wrong(self, i: int, j: int) -> bool:
        """Whether the angles opposite to an edge are, in the metric, more than two right ones
        together."""
        triangles = self._triangles
        k, l = triangles.opposite(i, j), triangles.opposite(j, i)  # noqa: E741
        if k is None or l is None:
            return False
        metric = [
            sum(entries) / 4
            for entries in zip(*(self._metrics[n] for n in (i, j, k, l)), strict=True)
        ]
        left, right = triangles.doubled_area(i, j, k), triangles.doubled_area(j, i, l)
        excess = left * self._product(metric, j, i, l) + self._product(metric, i, j, k) * right
        return excess < -_FLIPPED * (left + right)

    def _product(self, metric: list[float], i: int, j: int, k: int) -> float:
        """(uᵢ − u_k)ᵀ M (uⱼ − u_k)."""
        (ui, vi), (uj, vj), (uk, vk) = (self._triangles.rest[n] for n in (i, j, k))
        a, b, c, d = ui - uk, vi - vk, uj - uk, vj - vk
        return metric[0] * a * c + metric[1] * (a * d + b * c) + metric[2] * b * d

    def _links(self, vertices: Iterable[int]) -> list[tuple[int, int]]:
        """Edges at vertices, and those opposite to them."""
        around = self._triangles.around
        spokes = [(i, j) for i in vertices for j in self._triangles.neighbours(i)]
        return spokes + [(a, b) for i in vertices for a, b in around[i].items()]
