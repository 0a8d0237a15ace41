"""sRGB (IEC 61966-2-1) as numbers in [0, 1], encoded and linear."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def of_hex(text: str) -> NDArray[np.float64]:
    """(3,) encoded values of "#rrggbb"."""
    return np.array([int(text[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.float64) / 255


def decoded(code: ArrayLike) -> NDArray[np.float64]:
    """Encoded values as linear ones."""
    value = np.asarray(code, dtype=np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def encoded(linear: ArrayLike) -> NDArray[np.float64]:
    """Linear values as encoded ones."""
    value = np.asarray(linear, dtype=np.float64)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * np.maximum(value, 0.0) ** (1 / 2.4) - 0.055)
