"""A camera's noise, from pictures of a scene: Immerkær (Computer Vision and Image Understanding 64,
1996)."""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.core.arrays import Float32Array, UInt8Array

_ROUGH = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32)
"""The difference of two Laplacians, by which smooth changes do not pass; white noise of deviation σ
leaves 6 σ."""
_LEFT = 6.0
_MEDIAN = 0.6745
"""Median of the absolute value of a normal variable, over its deviation."""
_EDGE = 2
"""Pixels at the edge that are left out."""
_VALUES = 16 * 255 + 1
"""Magnitudes that a filtered pixel of 8 bits can have, from 0."""


def rough(picture: Float32Array) -> Float32Array:
    """Filters smooth parts out of a picture (height, width)."""
    return np.asarray(cv2.filter2D(picture, cv2.CV_32F, _ROUGH), dtype=np.float32)


def deviation(rough_pixels: Float32Array) -> float:
    """Estimates the standard deviation of a pixel's noise from pixels filtered by `rough`, by the
    median [gray levels]."""
    return float(np.median(np.abs(rough_pixels))) / (_MEDIAN * _LEFT)


def deviation_in(picture: UInt8Array) -> float:
    """Estimates the same from one picture (height, width): its filtered values are whole numbers,
    which are counted."""
    left = np.abs(cv2.filter2D(picture, cv2.CV_16S, _ROUGH)[_EDGE:-_EDGE, _EDGE:-_EDGE]).astype(
        np.uint16
    )
    counts = cv2.calcHist([left], [0], None, [_VALUES], [0, _VALUES]).ravel()
    middle = np.searchsorted(
        np.cumsum(counts, dtype=np.int64), [(left.size - 1) // 2, left.size // 2], side="right"
    )
    return float(middle.mean()) / (_MEDIAN * _LEFT)
