"""Points of the flat cloth: in which face each lies, and where in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError

_NEAR = 12
"""Faces that are tried first, nearest by their middles."""
_PAIRS = 1_000_000
"""Points and faces that are compared at a time."""
_SLACK = 1e-3
"""How far beyond its face, as a share of it, a point still counts as on the cloth."""


@dataclass(frozen=True, kw_only=True)
class Location:
    """Points on a triangulated cloth.

    Attributes:
        corners: (point, 3) vertices of the face that each lies in.
        weights: (point, 3) barycentric coordinates in it, which sum to 1.
    """

    corners: IntArray
    weights: FloatArray

    def of(self, values: FloatArray) -> FloatArray:
        """Interpolates values (vertex, …) at the points, (point, …), linear in each face."""
        return np.einsum("pc,pc...->p...", self.weights, values[self.corners])


def locate(rest: FloatArray, faces: IntArray, points: FloatArray, *, where: str) -> Location:
    """Finds the faces in which points of the flat cloth lie, and where in them.

    Args:
        rest: (vertex, 2) places of the vertices.
        faces: (face, 3), of either orientation; those without area are passed over.
        points: (point, 2) places in the same coordinates.

    Raises:
        InputError: a point that no face holds.
    """
    corners = rest[faces]
    doubled = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    has_area = np.abs(doubled) > 1e-9 * np.abs(doubled).max(initial=0.0)
    if not has_area.any():
        raise InputError(
            "no face has an area in the rest shape",
            where=where,
            fix="export texture coordinates anew",
        )
    corners, faces = corners[has_area], faces[has_area]
    count = min(_NEAR, len(faces))
    _, near = KDTree(corners.mean(axis=1)).query(points, k=count)
    containing, weights = _best(corners, points, np.reshape(near, (len(points), count)))
    outside = np.flatnonzero(weights.min(axis=1) < 0)
    everywhere = np.arange(len(faces))
    step = max(1, _PAIRS // len(faces))
    for first in range(0, len(outside), step):
        lost = outside[first : first + step]
        tried = np.broadcast_to(everywhere, (len(lost), len(faces)))
        containing[lost], weights[lost] = _best(corners, points[lost], tried)
    worst = int(weights.min(axis=1).argmin()) if len(points) else 0
    if len(points) and weights[worst].min() < -_SLACK:
        u, v = points[worst]
        raise InputError(
            f"the point (u, v) = ({u:.4g}, {v:.4g}) is on no face of the cloth",
            where=where,
            fix="give points within the rest shape, in its own coordinates",
        )
    return Location(corners=faces[containing], weights=weights)


def _best(corners: FloatArray, points: FloatArray, tried: IntArray) -> tuple[IntArray, FloatArray]:
    """Returns of the faces tried (point, face) the one that each point is deepest in, (point,), and
    its barycentric coordinates there (point, 3)."""
    a, b, c = (corners[tried, corner] for corner in range(3))
    doubled = _cross(b - a, c - a)
    second = _cross(points[:, None] - a, c - a) / doubled
    third = _cross(b - a, points[:, None] - a) / doubled
    weights = np.stack([1 - second - third, second, third], axis=-1)
    best = weights.min(axis=-1).argmax(axis=1)
    rows = np.arange(len(points))
    return tried[rows, best], weights[rows, best]


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
