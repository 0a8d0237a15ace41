"""The model's mesh for a cloth: a grid where the cloth is a rectangle, else a triangulation of its
outline."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull, Delaunay, KDTree, QhullError

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.errors import InputError
from sim.cloth.mesh import Mesh, grid

VERTICES = 200
"""Vertices of a model mesh, about."""
_SQUARE = 0.995  # of its box: an outline that fills as much is a rectangle
_CLEARANCE = 0.6  # of the spacing: inner points keep that far from the outline
_SHARP = math.radians(15)  # turn of an outline at a corner that the mesh keeps
_SLIVER = 0.05  # twice the area over the squared longest edge

Points = FloatArray


def rectangle(width: float, height: float, *, vertices: int = VERTICES) -> Mesh:
    """Makes a grid of nearly square cells from (0, 0) to (width, height), of about so many
    vertices.

    Raises:
        InputError: a size that is not positive.
    """
    if not (width > 0 and height > 0):
        raise InputError(
            f"the cloth measures {width} m × {height} m", where="cloth", fix="give positive sizes"
        )
    # (w/s + 1) (h/s + 1) = n, solved for the cell s.
    n, total = max(vertices, 4) - 1, width + height
    cell = (total + math.sqrt(total**2 + 4 * n * width * height)) / (2 * n)
    return grid(
        width=width,
        height=height,
        columns=max(1, round(width / cell)),
        rows=max(1, round(height / cell)),
    )


def hull(points: Points, *, where: str) -> Points:
    """Computes the convex hull of points on the cloth, (corner, 2), counter-clockwise.

    Raises:
        InputError: they are on a line.
    """
    try:
        return points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        raise InputError(
            "the points on the cloth lie on a line, or are fewer than three",
            where=where,
            fix="check that u and v are the two coordinates in the flat cloth",
        ) from None


def outline(rest: Points, faces: IntArray, *, where: str) -> Points:
    """Finds the outer edge of a triangulated cloth, (corner, 2).

    Raises:
        InputError: it has no edge, several pieces or a hole.
    """
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, inverse, counts = np.unique(
        np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    follows = dict(directed[counts[inverse.ravel()] == 1].tolist())
    if not follows:
        raise InputError(
            "the rest shape has no edge",
            where=where,
            fix="is the surface closed, or its rest unwrapped?",
        )
    first = min(follows)
    loop, vertex = [first], follows.pop(first)
    while vertex != first:
        if vertex not in follows:
            raise InputError(
                "the outline of the cloth is broken",
                where=f"{where}, vertex {vertex}",
                fix="join vertices that are doubled, and orient all faces alike",
            )
        loop.append(vertex)
        vertex = follows.pop(vertex)
    if follows:
        raise InputError(
            "the cloth has holes or several pieces",
            where=f"{where}, vertex {min(follows)}",
            fix="name the width and height of the sheet, or give one sheet without holes",
        )
    return rest[loop]


def is_rectangle(corners: Points) -> bool:
    """Returns whether an outline fills its box."""
    return abs(area(corners)) >= _SQUARE * float(np.prod(np.ptp(corners, axis=0)))


def area(corners: Points) -> float:
    """Computes the signed area of a polygon [m²], positive where it is counter-clockwise (shoelace
    formula)."""
    following = np.roll(corners, -1, axis=0)
    return float((corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum() / 2)


def model_mesh(corners: Points, *, vertices: int = VERTICES) -> Mesh:
    """Meshes an outline by about so many vertices, in the outline's own coordinates.

    Raises:
        InputError: an outline that has no area, or is too narrow somewhere to be meshed at that
            spacing.
    """
    low = corners.min(axis=0)
    if is_rectangle(corners):
        flat = rectangle(*np.ptp(corners, axis=0).tolist(), vertices=vertices)
        return Mesh(rest=flat.rest + low, faces=flat.faces)
    size = abs(area(corners))
    if size <= 1e-9 * float(np.ptp(corners, axis=0).max()) ** 2:
        raise InputError(
            "the outline of the cloth has no area", where="cloth", fix="check its rest coordinates"
        )
    # Equilateral triangles of side s have √3/2 s² a vertex, and half the outer edge's are beyond
    # the cloth.
    perimeter = float(np.hypot(*np.diff(np.vstack([corners, corners[:1]]), axis=0).T).sum())
    cell, unit = perimeter / 2, math.sqrt(3) / 2
    spacing = (cell + math.sqrt(cell**2 + 4 * vertices * unit * size)) / (2 * vertices * unit)
    edge = _along(corners, spacing)
    inner = _lattice(corners, spacing)
    inner = inner[inside(corners, inner)]
    inner = inner[KDTree(edge).query(inner)[0] > _CLEARANCE * spacing] if len(inner) else inner
    points = np.concatenate([edge, inner])
    faces = Delaunay(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    keep = (np.abs(doubled) > _SLIVER * longest) & inside(corners, (a + b + c) / 3)
    faces = np.where(doubled[:, None] < 0, faces[:, ::-1], faces)[keep]
    used, compact = np.unique(faces, return_inverse=True)
    covered = float(np.abs(doubled[keep]).sum() / 2)
    if len(used) < len(edge) or abs(covered - size) > 0.02 * size:
        raise InputError(
            f"{len(points)} vertices do not fill the outline: {covered:.4g} of {size:.4g} m²",
            where="cloth",
            fix="ask for more vertices, or name the width and height of a plain sheet",
        )
    return Mesh(rest=points[used], faces=compact.reshape(-1, 3))


def sharp_corners(corners: Points) -> IntArray:
    """Indices of the corners at which an outline turns by more than 15°."""
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    turn = np.arctan2(
        before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)
    )
    return np.flatnonzero(np.abs(turn) > _SHARP)


def distance_to(corners: Points, point: Points) -> float:
    """Computes the distance of a point (2,) from the edge of a polygon [m]."""
    along = np.roll(corners, -1, axis=0) - corners
    offset = point - corners
    share = np.clip((offset * along).sum(axis=1) / (along * along).sum(axis=1), 0, 1)
    return float(np.hypot(*(offset - share[:, None] * along).T).min())


def inside(corners: Points, points: Points) -> BoolArray:
    """Returns whether points are within a polygon, (point,): a ray from each crosses its edges an
    odd number of times."""
    x, y = points[:, 0:1], points[:, 1:2]
    x0, y0 = corners.T
    x1, y1 = np.roll(corners, -1, axis=0).T
    spans = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = spans & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return crossing.sum(axis=1) % 2 == 1


def _along(corners: Points, spacing: float) -> Points:
    """Selects sharp corners of the outline, and points evenly spaced along it between them."""
    sharp = sharp_corners(corners)
    loop = np.roll(corners, -int(sharp[0]) if len(sharp) else 0, axis=0)
    loop = np.concatenate([loop, loop[:1]])
    stops = [*(sharp - sharp[0]).tolist(), len(corners)] if len(sharp) else [0, len(corners)]
    parts: list[Points] = []
    for start, end in pairwise(stops):
        path = loop[start : end + 1]
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        count = max(1, round(float(length[-1]) / spacing))
        at = length[-1] * np.arange(count) / count
        parts.append(np.stack([np.interp(at, length, path[:, axis]) for axis in (0, 1)], axis=1))
    return np.concatenate(parts)


def _lattice(corners: Points, spacing: float) -> Points:
    """Corners of equilateral triangles over the outline's box."""
    (u0, v0), (u1, v1) = corners.min(axis=0), corners.max(axis=0)
    rise = spacing * math.sqrt(3) / 2
    rows = np.arange(v0, v1 + rise, rise)
    columns = np.arange(u0 - spacing, u1 + spacing, spacing)
    v, u = np.meshgrid(rows, columns, indexing="ij")
    return np.stack(
        [(u + spacing / 2 * (np.arange(len(rows)) % 2)[:, None]).ravel(), v.ravel()], axis=1
    )
