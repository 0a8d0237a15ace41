"""Numbers that summarise how a cloth moves: where an edge is, how fast, how often."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from flagdata.errors import UsageError


@dataclass(frozen=True, kw_only=True)
class EdgeMotion:
    """Motion of a set of vertices over a time.

    Attributes:
        position: (3,) mean [m].
        speed: mean of |velocity| [m/s].
        frequency: root mean square velocity over 2π times root mean square displacement from the
            mean [Hz]: that of a sinusoid, and for any motion the root mean square frequency of its
            displacement spectrum.
    """

    position: FloatArray
    speed: float
    frequency: float


def edge_motion(positions: NDArray[np.floating], *, rate: float) -> EdgeMotion:
    """Motion of vertices from frames.

    Velocities are differences of successive frames, so that frequencies beyond a quarter of the
    rate are underestimated (by 10 % there).

    Args:
        positions: (frame, vertex, 3) [m].
        rate: frames a second [Hz].

    Raises:
        UsageError: fewer than two frames.
    """
    if len(positions) < 2:
        raise UsageError(
            "the motion of fewer than two frames", where="edge motion", fix="give more frames"
        )
    track = np.asarray(positions, dtype=np.float64)
    velocity = np.diff(track, axis=0) * rate
    swing = track - track.mean(axis=0)
    displacement = math.sqrt(float((swing**2).sum(axis=2).mean()))
    quick = math.sqrt(float((velocity**2).sum(axis=2).mean()))
    return EdgeMotion(
        position=track.mean(axis=(0, 1)),
        speed=float(np.linalg.norm(velocity, axis=2).mean()),
        frequency=quick / (2 * math.pi * displacement) if displacement > 0 else 0.0,
    )
