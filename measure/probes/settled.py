"""What a recording settles at over its whole length: forecasts of 40 ms say little of it.

A hoist that is held along its length, or a cloth that is much stiffer, moves predictions of one
interval hardly, since they start from the cloth as it was observed; over seconds the cloth hangs,
stretches out and beats differently. These are compared with the same quantities of the base model
run freely in the same wind. How far both differ by chance, by numerics and by what the calibration
is off by is learnt from nulls, whose model is off by as much.
"""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray

NAMES = ("droop", "extension", "speed", "amplitude", "hoist amplitude")
"""Droop: angle below the horizontal of the line from the middle of the hoist to the middle of the
free edge, the mean over the frames [rad]. Extension: the mean length of that line over the cloth's
width. Speed: root mean square of the velocity of the middle third, in widths a second. Amplitude:
root mean square distance of the free edge from its mean place, in heights. Hoist amplitude: the
same of the middle of the hoist. The last three by their logarithms."""

_EDGE = 0.12
"""Share of the width that counts as an edge; at least one column of markers of a grid of nine."""
_LEAST = 1e-4
"""Of the cloth's size: what moves less moves as much, so that a hoist that stands still has a
finite logarithm."""


def settling_of(
    markers: FloatArray, positions: FloatArray, *, period: float, noise: float = 0.0
) -> FloatArray:
    """Computes what the markers settle at, (quantity,) as `NAMES` has them.

    Args:
        markers: (marker, 2) places on the flat cloth, u from the hoist to the fly [m].
        positions: (frame, marker, 3), z up [m].
        period: between the frames [s].
        noise: standard deviation of a coordinate, whose part in motion is taken out [m].
    """
    low, size = markers.min(axis=0), np.ptp(markers, axis=0)
    u, v = ((markers - low) / size).T
    hoist, free = u <= max(_EDGE, float(u.min())), u >= min(1 - _EDGE, float(u.max()))
    middle, inner = np.abs(u - 0.5) <= 1 / 6, hoist & (np.abs(v - 0.5) <= 0.3)
    line = positions[:, free].mean(axis=1) - positions[:, hoist].mean(axis=1)
    droop = np.arctan2(-line[:, 2], np.hypot(line[:, 0], line[:, 1])).mean()
    extension = np.linalg.norm(line, axis=1).mean() / size[0]
    velocity = (positions[2:] - positions[:-2])[:, middle if middle.any() else free] / (2 * period)
    speed = (
        _root((velocity**2).sum(axis=2).mean() - 3 * noise**2 / (2 * period**2), size[0]) / size[0]
    )
    moved = [
        _root(positions[:, part].var(axis=0).sum(axis=1).mean() - 3 * noise**2, size[0]) / size[1]
        for part in (free, inner if inner.any() else hoist)
    ]
    return np.array([droop, extension, *np.log([speed, *moved])])


def _root(square: float, size: float) -> float:
    return float(np.sqrt(max(square, (_LEAST * size) ** 2)))
