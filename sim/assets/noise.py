"""Smooth random fields for procedural pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def fractal(
    rng: np.random.Generator, rows: int, columns: int, *, slope: float, stretch: float = 1.0
) -> NDArray[np.float64]:
    """A Gaussian field whose amplitude spectrum falls as f^−slope, scaled to mean 0 and standard deviation 1.

    Natural scenes have slopes about 1 (Field 1987); clouds about 1.5 to 2.

    Args:
        stretch: how many times longer features are along the rows than across.

    Returns:
        (rows, columns), periodic.
    """
    fy = np.fft.fftfreq(rows)[:, None] * max(rows, columns)
    fx = np.fft.rfftfreq(columns)[None, :] * max(rows, columns) * stretch
    frequency = np.hypot(fx, fy)
    frequency[0, 0] = np.inf
    shape = frequency.shape
    spectrum = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) * frequency**-slope
    field = np.fft.irfft2(spectrum, s=(rows, columns))
    return (field - field.mean()) / field.std()


def smoothstep(low: float, high: float, value: NDArray[np.float64]) -> NDArray[np.float64]:
    """0 below `low`, 1 above `high`, a smooth cubic between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)
