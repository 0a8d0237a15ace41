"""Material points of a moving mesh whose topology may change: where they are in each frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.lake.meshes import MeshSequence, RaggedMeshSequence

_PAIRS = 1_000_000  # of points and faces that are compared at a time
_SLACK = 1e-3  # barycentric: how far beyond its face, as a share of it, a point still counts as on the cloth


@dataclass(frozen=True, kw_only=True)
class Location:
    """Points on a triangulated cloth.

    Attributes:
        corners: (point, 3) vertices of the face that each lies in.
        weights: (point, 3) barycentric coordinates in it, which sum to 1.
    """

    corners: NDArray[np.int64]
    weights: NDArray[np.float64]

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(point, …) of values (vertex, …), linear in each face."""
        return np.einsum("pc,pc...->p...", self.weights, values[self.corners])


def locate(rest: NDArray[np.float64], faces: NDArray[np.int64], points: NDArray[np.float64], *, where: str) -> Location:
    """The faces in which points of the flat cloth lie, and where in them.

    Args:
        rest: (vertex, 2) [m].
        faces: (face, 3), of either orientation; those without area are passed over.
        points: (point, 2) [m].

    Raises:
        InputError: a point that no face holds.
    """
    a, b, c = (rest[faces[:, i]] for i in range(3))
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    whole = np.abs(doubled) > 1e-9 * np.abs(doubled).max(initial=0.0)
    if not whole.any():
        raise InputError("no face has an area in the rest shape", where=where, fix="export texture coordinates anew")
    a, b, c, faces, doubled = a[whole], b[whole], c[whole], faces[whole], doubled[whole]
    found = np.empty(len(points), dtype=np.int64)
    weights = np.empty((len(points), 3))
    step = max(1, _PAIRS // len(faces))
    for first in range(0, len(points), step):
        some = points[first : first + step]
        second = _cross(some[:, None] - a, c - a) / doubled
        third = _cross(b - a, some[:, None] - a) / doubled
        inside = np.minimum(np.minimum(second, third), 1 - second - third)
        best = inside.argmax(axis=1)
        rows = np.arange(len(some))
        worst = float(inside[rows, best].min())
        if worst < -_SLACK:
            lost = first + int(inside[rows, best].argmin())
            u, v = points[lost]
            raise InputError(
                f"the point (u, v) = ({u:.4g}, {v:.4g}) m is on no face of the cloth",
                where=where,
                fix="give points within the rest shape, in its own coordinates",
            )
        found[first : first + step] = best
        second, third = second[rows, best], third[rows, best]
        weights[first : first + step] = np.stack([1 - second - third, second, third], axis=1)
    return Location(corners=faces[found], weights=weights)


def sample(sequence: MeshSequence | RaggedMeshSequence, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(frame, point, 3) where points of the flat cloth (point, 2) are in each frame [m], linear in each face.

    Raises:
        InputError: a point that is not on the cloth in every frame.
    """
    positions = np.empty((len(sequence), len(points), 3))
    known: tuple[NDArray[np.float32], NDArray[np.int32]] | None = None
    location: Location | None = None
    for index in range(len(sequence)):
        mesh = sequence.frame(index)
        same = known is not None and np.array_equal(known[0], mesh.rest) and np.array_equal(known[1], mesh.faces)
        if location is None or not same:
            rest, faces = mesh.rest.astype(np.float64), mesh.faces.astype(np.int64)
            location = locate(rest, faces, points, where=f"frame {index}")
            known = (mesh.rest, mesh.faces)
        positions[index] = location.of(mesh.positions.astype(np.float64))
    return positions


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
