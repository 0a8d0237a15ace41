"""Polygons split into triangles: convex ones as fans, others by clipping ears (Meisters, 1975), in their own plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CORNERS = 256
"""Most corners of a polygon that is not convex: the time that it takes grows with their cube."""
_FLAT = 1e-9
"""Twice an area over the squared extent of the polygon below which three corners are in a line."""

Points = NDArray[np.float64]
Triples = NDArray[np.int64]


def fans(sizes: NDArray[np.int64]) -> tuple[Triples, NDArray[np.int64]]:
    """Polygons of so many corners, whose corners lie one polygon after another, as fans around their first corners.

    Returns:
        (triangle, 3) places of corners, and (triangle,) the polygon of each.
    """
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    polygon = np.repeat(np.arange(len(sizes)), sizes - 2)
    begins = np.cumsum(sizes - 2) - (sizes - 2)
    step = np.arange(len(polygon)) - begins[polygon]
    base = first[polygon]
    return np.stack([base, base + step + 1, base + step + 2], axis=1), polygon


def convex(points: Points) -> NDArray[np.bool_]:
    """(polygon,) which of some polygons of equally many corners, (polygon, corner, 2), are strictly convex."""
    ahead = np.roll(points, -1, axis=1) - points
    after = np.roll(ahead, -1, axis=1)
    turn = _cross(ahead, after)
    flat = turn * np.sign(turn[:, :1]) <= _FLAT * _extent(points)[:, None]
    # A star turns one way as well, more than once around.
    angle = np.arctan2(turn, (ahead * after).sum(axis=2)).sum(axis=1)
    return ~flat.any(axis=1) & (np.abs(angle) < 3 * np.pi)


def in_plane(points: Points) -> Points:
    """(corner, 2) of the corners of a polygon in space, (corner, 3), in the plane of its vector area."""
    spokes = points - points.mean(axis=0)
    normal = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    length = float(np.linalg.norm(normal))
    if length == 0:
        return spokes[:, :2] * 0.0
    normal /= length
    u = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    u /= np.linalg.norm(u)
    return spokes @ np.stack([u, np.cross(normal, u)], axis=1)


def ears(points: Points) -> Triples:
    """A simple polygon, (corner, 2), as (corner − 2, 3) triangles with its orientation, of all its corners.

    Raises:
        ValueError: more corners than `CORNERS`, no area, or edges that cross or touch each other; the text says which.
    """
    count = len(points)
    if count > CORNERS:
        raise ValueError(f"not convex and of {count} corners, {CORNERS} at most")
    doubled = float(_cross(points, np.roll(points, -1, axis=0)).sum())
    flat = _FLAT * float(_extent(points[None])[0])
    if abs(doubled) <= flat:
        raise ValueError("without area")
    if _crosses(points):
        raise ValueError("whose edges cross or touch each other")
    sign = np.sign(doubled)
    left, found, at = list(range(count)), [], 1
    while len(left) > 3:
        for step in range(len(left)):
            place = (at + step) % len(left)
            corners = [left[place - 1], left[place], left[(place + 1) % len(left)]]
            if _is_ear(points, corners, left, sign=sign, flat=flat):
                break
        else:
            raise ValueError("with corners too close to a line to be split")
        found.append(corners)
        left.pop(place)
        at = place
    return np.array([*found, left], dtype=np.int64)


def _is_ear(points: Points, corners: list[int], left: list[int], *, sign: float, flat: float) -> bool:
    a, b, c = points[corners]
    if sign * float(_cross(b - a, c - a)) <= flat:
        return False
    others = points[[corner for corner in left if corner not in corners]]
    sides = [sign * _cross(end - start, others - start) for start, end in ((a, b), (b, c), (c, a))]
    return not (np.stack(sides) >= -flat).all(axis=0).any()


def _crosses(points: Points) -> bool:
    """Whether two edges of a polygon have a point in common, beside the corner that neighbours share."""
    count = len(points)
    start, end = points, np.roll(points, -1, axis=0)
    along = end - start
    flat = _FLAT * float(_extent(points[None])[0])
    for i in range(count - 1):
        j = np.arange(i + 1, count)
        # Neighbours share a corner; they overlap where the other corner of one lies on the other.
        following, preceding = j == i + 1, (i == 0) & (j == count - 1)
        a, b = _cross(along[i], start[j] - start[i]), _cross(along[i], end[j] - start[i])
        c, d = _cross(along[j], start[i] - start[j]), _cross(along[j], end[i] - start[j])
        proper = (a * b < 0) & (c * d < 0) & ~following & ~preceding
        touching = np.zeros(len(j), dtype=bool)
        for side, point, first, second, shared in (
            (a, start[j], start[i], end[i], following),
            (b, end[j], start[i], end[i], preceding),
            (c, start[i], start[j], end[j], preceding),
            (d, end[i], start[j], end[j], following),
        ):
            between = ((point - first) * (point - second)).sum(axis=-1) <= 0
            touching |= (np.abs(side) <= flat) & between & ~shared
        if (proper | touching).any():
            return True
    return False


def _cross(a: Points, b: Points) -> Points:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _extent(points: Points) -> Points:
    """(polygon,) squared diagonal of the box around each."""
    return (np.ptp(points, axis=1) ** 2).sum(axis=-1)
