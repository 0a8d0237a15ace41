"""How small triangles have to be: a metric on the cloth, from its shape and motion.

After Narain, Samii and O'Brien (2012, ACM Trans. Graph. 31:152, section 4.1). On each face of a
mesh

    M = max(κᵀκ/α², ∇nᵀ∇n/α², ∇vᵀ∇v/w², P/c²)        [1/m²]

where κ is the curvature in the folds between faces, ∇n and ∇v are the gradients of the vertex
normals and velocities in
the material, and P is the compression: the positive part of (I − FᵀF)/2, less what folds across it
stiffen, 2 c² times the squared curvature turned by a right angle. The maximum is the smallest
metric that is not less than any of them in any direction. Its eigenvalues are then bounded by
1/size², and the lesser one by the square of the least aspect times the larger. A vertex has the
mean of its faces, weighted by their areas.

An edge u between vertices i and j is as long as it may be where uᵀ (Mᵢ + Mⱼ)/2 u = 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import NotNegative, Positive
from sim.cloth.mesh import Mesh


@dataclass(frozen=True, kw_only=True)
class Remeshing:
    """How finely a cloth is divided, after every frame. The values are those of the paper's scenes,
    the names ArcSim's.

    Attributes:
        refine_angle: α, the angle between normals along an edge [rad].
        refine_compression: c, the amplitude of wrinkles that would take up the compression [m].
        refine_velocity: w, the difference of velocities along an edge [m/s].
        size_min, size_max: bounds of an edge's length [m].
        aspect_min: least ratio of the lengths of edges in two directions, from 0 to 1.

    Raises:
        InputError: a value that is not positive, bounds in the wrong order, or an aspect outside 0
            to 1.
    """

    refine_angle: Positive = 0.3
    refine_compression: Positive = 0.01
    refine_velocity: Positive = 1.0
    size_min: Positive = 0.02
    size_max: Positive = 0.5
    aspect_min: NotNegative = 0.2

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name != "aspect_min" and not value > 0:
                raise InputError(
                    f"{name} is {value!r}, not positive",
                    where="remeshing",
                    fix=f"give a positive {name}",
                )
        if not (self.size_min <= self.size_max < math.inf):
            raise InputError(
                f"edges are bounded by {self.size_min:g} and {self.size_max:g} m",
                where="remeshing",
                fix="give finite sizes, the smaller one first",
            )
        if not 0 <= self.aspect_min <= 1:
            raise InputError(
                f"aspect_min is {self.aspect_min:g}",
                where="remeshing",
                fix="give a ratio from 0 to 1",
            )

    def vertices(self, area: float) -> float:
        """Bounds about how many vertices a cloth of an area [m²] gets: edges of half the least size
        everywhere."""
        return 4 * area / self.size_min**2


def vertex_metrics(
    mesh: Mesh, position: FloatArray, velocity: FloatArray, criteria: Remeshing
) -> FloatArray:
    """Computes the metric (vertex, 2, 2) [1/m²] of a cloth at positions and velocities (vertex, 3)
    [m, m/s]."""
    metrics = bound_metric(face_metrics(mesh, position, velocity, criteria), criteria)
    total = np.zeros((mesh.vertex_count, 2, 2))
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], metrics * (mesh.areas / 3)[:, None, None])
    return total / mesh.vertex_areas[:, None, None]


def face_metrics(
    mesh: Mesh, position: FloatArray, velocity: FloatArray, criteria: Remeshing
) -> FloatArray:
    """Computes the metric (face, 2, 2) [1/m²] that the criteria ask for, without its bounds below
    `size_max`."""
    folds, turning = fold_curvature(mesh, position), gradient(mesh, vertex_normals(mesh, position))
    bent, turned = _squared_norm(folds), _squared_norm(turning)
    stretch = gradient(mesh, position)
    # A ridge stiffens the cloth along itself.
    ridges = np.trace(turned, axis1=1, axis2=2)[:, None, None] * np.eye(2) - turned
    compression = (
        np.eye(2) - _squared_norm(stretch)
    ) / 2 - 2 * criteria.refine_compression**2 * ridges
    metric = np.broadcast_to(np.eye(2) / criteria.size_max**2, bent.shape)
    for other in (
        bent / criteria.refine_angle**2,
        turned / criteria.refine_angle**2,
        _squared_norm(gradient(mesh, velocity)) / criteria.refine_velocity**2,
        _positive(compression) / criteria.refine_compression**2,
    ):
        metric = larger(metric, other)
    return metric


def gradient(mesh: Mesh, field: FloatArray) -> FloatArray:
    """Computes the derivatives (face, k, 2) of a linear field (vertex, k) by u and v."""
    return np.einsum("fic,fck->fki", mesh.gradients, field[mesh.faces])


def vertex_normals(mesh: Mesh, position: FloatArray) -> FloatArray:
    """Computes unit normals (vertex, 3): means of the faces around, weighted by their areas in
    space."""
    a, b, c = (position[mesh.faces[:, corner]] for corner in range(3))
    across = np.cross(b - a, c - a)
    total = np.zeros((mesh.vertex_count, 3))
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], across)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(length > 0, length, 1)


def fold_curvature(mesh: Mesh, position: FloatArray) -> FloatArray:
    """Computes the curvature (face, 2, 2) [1/m] in the folds around each face: half of Σ θ l t tᵀ
    over its area, for fold angles θ, edges of length l at rest and units t across them in the
    material."""
    curvature = np.zeros((len(mesh.faces), 2, 2))
    if not len(mesh.hinges):
        return curvature
    i, j, k, l = mesh.hinges.T  # noqa: E741  the four corners as in `Mesh.hinges`
    edge = position[j] - position[i]
    left, right = (
        np.cross(edge, position[k] - position[i]),
        np.cross(position[l] - position[i], edge),
    )
    length = np.linalg.norm(edge, axis=1)
    sine = np.einsum("hx,hx->h", np.cross(left, right), edge) / np.where(length > 0, length, 1)
    angle = np.arctan2(sine, np.einsum("hx,hx->h", left, right))
    along = mesh.rest[j] - mesh.rest[i]
    across = np.stack([along[:, 1], -along[:, 0]], axis=1)
    # θ l t tᵀ, with l t of length l.
    share = (
        (angle / mesh.hinge_lengths / 2)[:, None, None] * across[:, :, None] * across[:, None, :]
    )
    sides = face_of_edges(mesh)
    for first, second in ((i, j), (j, i)):
        faces = np.array(
            [sides[pair] for pair in zip(first.tolist(), second.tolist(), strict=True)]
        )
        np.add.at(curvature, faces, share)
    return curvature / mesh.areas[:, None, None]


def face_of_edges(mesh: Mesh) -> dict[tuple[int, int], int]:
    """Returns the face of each directed edge."""
    return {
        (face[corner], face[(corner + 1) % 3]): index
        for index, face in enumerate(mesh.faces.tolist())
        for corner in range(3)
    }


def bound_metric(metric: FloatArray, criteria: Remeshing) -> FloatArray:
    """Bounds the eigenvalues of metrics (n, 2, 2) by the sizes, and the lesser one by the
    aspect."""
    values, axes = np.linalg.eigh(metric)
    values = np.clip(values, criteria.size_max**-2, criteria.size_min**-2)
    values = np.maximum(values, values.max(axis=1, keepdims=True) * criteria.aspect_min**2)
    return _compose_metric(values, axes)


def larger(first: FloatArray, second: FloatArray) -> FloatArray:
    """Returns the smallest metrics (n, 2, 2) that are, in any direction, not less than a positive
    definite and another one."""
    values, axes = np.linalg.eigh(first)
    root, inverse = (
        _compose_metric(np.sqrt(values), axes),
        _compose_metric(1 / np.sqrt(values), axes),
    )
    values, axes = np.linalg.eigh(inverse @ second @ inverse)
    return root @ _compose_metric(np.maximum(values, 1), axes) @ root


def _positive(tensor: FloatArray) -> FloatArray:
    values, axes = np.linalg.eigh(tensor)
    return _compose_metric(np.maximum(values, 0), axes)


def _squared_norm(derivative: FloatArray) -> FloatArray:
    return np.einsum("fki,fkj->fij", derivative, derivative)


def _compose_metric(values: FloatArray, axes: FloatArray) -> FloatArray:
    return np.einsum("nik,nk,njk->nij", axes, values, axes)
