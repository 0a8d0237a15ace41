"""Flags of known motion: sheets whose every point is given by a formula."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from measure.observables import ClothWindow, View, edges_of, seen_from

LENGTH, HEIGHT = 1.5, 1.0
RATE = 25.0
SIDE_ON = View()
Motion = Callable[[FloatArray, FloatArray, float], tuple[FloatArray, ...]]
"""Material coordinates (u from the hoist, v above its middle) and time → x, y, z [m]."""


def sheet(columns: int = 18, rows: int = 10) -> tuple[FloatArray, IntArray]:
    """Rest (vertex, 2) and faces of a flat flag."""
    u, v = np.meshgrid(
        np.linspace(0, LENGTH, columns + 1), np.linspace(-HEIGHT / 2, HEIGHT / 2, rows + 1)
    )
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])
    )
    return np.stack([u.ravel(), v.ravel()], 1), np.concatenate(
        [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    )


def window(
    motion: Motion, *, view: View = SIDE_ON, seconds: float = 2.5, rate: float = RATE
) -> ClothWindow:
    """A window of a flag that moves by a formula."""
    rest, faces = sheet()
    times = np.arange(round(seconds * rate) + 1) / rate
    positions = np.stack([np.stack(motion(rest[:, 0], rest[:, 1], t), axis=1) for t in times])
    hoist, free = edges_of(rest)
    return seen_from(
        view,
        positions,
        times=times,
        faces=faces,
        hoist=hoist,
        free=free,
        length=LENGTH,
        height=HEIGHT,
    )


def hinged(angle: Callable[[float], float]) -> Motion:
    """A flag whose threads along the hoist stay upright while those across it droop by an angle
    [rad]."""

    def motion(u: FloatArray, v: FloatArray, t: float) -> tuple[FloatArray, ...]:
        return u * np.cos(angle(t)), 0 * u, v - u * np.sin(angle(t))

    return motion
