"""How cloth is held: vertices tied to points, by springs or rigidly, at rest or moving."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

ARCSIM_STIFFNESS = 1e3
"""Spring constant of the reference simulator's handles, on each axis [N/m]."""


@dataclass(frozen=True, kw_only=True)
class Handles:
    """Held vertices.

    Attributes:
        vertices: indices of the held vertices, each once.
        stiffness: spring constant on each axis [N/m]; infinite for rigid.
        times: (n,) of the motion's key frames [s], increasing; one entry for handles at rest.
        offsets: (n, 3) displacement of all anchors from where the vertices start [m]; linear
            between key frames, constant outside.

    Raises:
        InputError: repeated or negative vertices, a stiffness that is not positive, key frames that
            do not fit.
    """

    vertices: tuple[int, ...]
    stiffness: float = ARCSIM_STIFFNESS
    times: tuple[float, ...] = (0.0,)
    offsets: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)

    def __post_init__(self) -> None:
        if len(set(self.vertices)) != len(self.vertices) or any(v < 0 for v in self.vertices):
            raise InputError(
                "a vertex is held twice or negative",
                where="handles",
                fix="list each vertex index once",
            )
        if math.isnan(self.stiffness) or self.stiffness <= 0:
            raise InputError(
                f"stiffness {self.stiffness!r} is not positive",
                where="handles",
                fix="give N/m, or infinity for rigid",
            )
        shape = np.shape(self.offsets)
        if shape != (len(self.times), 3) or not self.times or not np.isfinite(self.offsets).all():
            raise InputError(
                f"there are {len(self.times)} key times with offsets of shape {shape}",
                where="handles",
                fix="give one finite (x, y, z) offset for each key time",
            )
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise InputError(
                "key times do not increase", where="handles", fix="sort them, each once"
            )

    @property
    def rigid(self) -> bool:
        return math.isinf(self.stiffness)

    def offset(self, time: float) -> FloatArray:
        """Interpolates the displacement of the anchors at a time, (3,) [m]."""
        if len(self.times) == 1:
            return np.array(self.offsets[0])
        keys = np.asarray(self.offsets)
        return np.array([np.interp(time, self.times, keys[:, axis]) for axis in range(3)])


def corners(rest: FloatArray) -> tuple[int, int]:
    """Finds the two hoist corners of a flag: the lowest and the highest vertex of those with the
    smallest u.

    Args:
        rest: (vertex, 2) material coordinates [m].
    """
    hoist = full_hoist(rest)
    return hoist[0], hoist[-1]


def full_hoist(rest: FloatArray) -> tuple[int, ...]:
    """Lists all vertices of the hoist (smallest u), from low v to high v."""
    width = float(np.ptp(rest[:, 0]))
    edge = np.flatnonzero(rest[:, 0] <= rest[:, 0].min() + 1e-9 * width)
    return tuple(int(v) for v in edge[np.argsort(rest[edge, 1], kind="stable")])


def top_corners(rest: FloatArray) -> tuple[int, int]:
    """Finds the two upper corners of a hanging cloth: smallest and largest u of those with the
    largest v."""
    height = float(np.ptp(rest[:, 1]))
    edge: Sequence[int] = np.flatnonzero(rest[:, 1] >= rest[:, 1].max() - 1e-9 * height).tolist()
    ordered = sorted(edge, key=lambda v: float(rest[v, 0]))
    return ordered[0], ordered[-1]
