"""Smooth random fields for procedural pictures."""

from __future__ import annotations

import numpy as np
from scipy import fft

from flagdata.core.arrays import FloatArray

Plane = FloatArray
"""(row, column)."""
Picture = FloatArray
"""(row, column, 3) sRGB in [0, 1], or about."""


def fractal(
    rng: np.random.Generator, rows: int, columns: int, *, slope: float, stretch: float = 1.0
) -> Plane:
    """Draws a Gaussian field whose amplitude spectrum falls as f^−slope, scaled to mean 0 and
    standard deviation 1.

    Photographs have slopes of about 1 (Field 1987, J. Opt. Soc. Am. A 4, 2379); clouds 1.5 to 2.

    Args:
        stretch: how many times longer features are along rows than across.

    Returns:
        (rows, columns), periodic.
    """
    longer = max(rows, columns)
    fy = np.fft.fftfreq(rows)[:, None] * longer
    fx = np.fft.rfftfreq(columns)[None, :] * longer * stretch
    frequency = np.hypot(fx, fy)
    frequency[0, 0] = np.inf
    real, imaginary = rng.standard_normal((2, *frequency.shape))
    field = np.asarray(fft.irfft2((real + 1j * imaginary) * frequency**-slope, s=(rows, columns)))
    return (field - field.mean()) / field.std()


def ridge(rng: np.random.Generator, columns: int, *, slope: float) -> FloatArray:
    """Draws a random line (columns,) with mean 0 and standard deviation 1, as `fractal`, not
    periodic."""
    return fractal(rng, 2, 2 * columns, slope=slope)[0, :columns]


def smoothstep(low: float, high: float, value: FloatArray) -> FloatArray:
    """Interpolates: 0 below `low`, 1 above `high`, a smooth cubic between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def over(below: Picture, colour: FloatArray, share: Plane) -> Picture:
    """Lays a colour or picture over another one with the share (row, column) that it covers."""
    return below + share[:, :, None] * (colour - below)


def defocus(picture: Picture, radius: float) -> Picture:
    """Blurs a picture by a Gaussian of standard deviation `radius` [px], mirrored at its edges."""
    from scipy.ndimage import gaussian_filter

    return gaussian_filter(picture, sigma=(radius, radius, 0.0), mode="reflect", truncate=3.0)
