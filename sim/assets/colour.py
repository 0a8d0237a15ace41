"""sRGB (IEC 61966-2-1) as numbers in [0, 1], encoded and linear, and colours drawn at random."""

from __future__ import annotations

import colorsys
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from flagdata.core.arrays import FloatArray

Band: TypeAlias = tuple[float, float]
Hue: TypeAlias = tuple[Band, Band, Band]
"""Ranges of hue [turn], saturation and brightness."""


def hue(rng: np.random.Generator, turn: Band, saturation: Band, brightness: Band) -> FloatArray:
    """Draws (3,) encoded values of a colour, uniform in ranges of hue [turn], saturation and
    brightness."""
    return np.array(
        colorsys.hsv_to_rgb(rng.uniform(*turn), rng.uniform(*saturation), rng.uniform(*brightness))
    )


def of_hex(text: str) -> FloatArray:
    """Converts "#rrggbb" to (3,) encoded values."""
    return np.array([int(text[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.float64) / 255


def decode_values(code: ArrayLike) -> FloatArray:
    """Converts encoded values to linear ones."""
    value = np.asarray(code, dtype=np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def encode_values(linear: ArrayLike) -> FloatArray:
    """Converts linear values to encoded ones."""
    value = np.asarray(linear, dtype=np.float64)
    return np.where(
        value <= 0.0031308, 12.92 * value, 1.055 * np.maximum(value, 0.0) ** (1 / 2.4) - 0.055
    )
