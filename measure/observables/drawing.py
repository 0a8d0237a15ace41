"""Silhouettes of triangles, drawn in whole numbers: the same on every machine.

A pixel counts where its middle third, a square, touches a triangle. By the middle alone slender
folds would be lost.
"""

from __future__ import annotations

import ctypes
import functools

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray, IntArray

STEPS = 192
"""Of a pixel, in which places are rounded."""
_REACH = STEPS // 6
"""Steps from a pixel's middle to the sides of its middle third."""
_FIELDS = ("frames", "vertices", "faces", "width", "height")
_POINTERS = ("places", "face", "out")


class _Drawing(ctypes.Structure):
    """Mirrors `Drawing` of drawing.cpp field by field."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in _FIELDS),
        *((name, ctypes.c_void_p) for name in _POINTERS),
    ]


@functools.cache
def library() -> ctypes.CDLL | None:
    """Compiles the kernel; None, with one warning, where it cannot be built."""
    from sim.compiler import (
        compile_library,
    )  # a film is measured without the simulator, and loads nothing of it

    return compile_library(
        "measure.observables",
        ("drawing.cpp",),
        without="silhouettes are drawn by numpy, many times slower",
    )


def drawn(places: FloatArray, faces: IntArray, *, width: int, height: int) -> BoolArray:
    """Draws (frame, height, width) silhouettes.

    Args:
        places: (frame, vertex, 2) in pixels, to the right and down; the first pixel's middle is at
            0.5. What lies beyond the picture is left out.
        faces: (face, 3) vertex indices.
        width, height: of the picture in pixels.
    """
    steps = np.ascontiguousarray(np.rint(places * STEPS).astype(np.int64))
    corners = np.ascontiguousarray(faces, np.int64)
    out = np.zeros((len(steps), height, width), np.uint8)
    code = library()
    if code is None:
        _draw_by_numpy(steps, corners, out)
    else:
        _draw_by_kernel(code, steps, corners, out)
    return out.view(bool)


def _draw_by_kernel(
    code: ctypes.CDLL, steps: NDArray[np.int64], corners: NDArray[np.int64], out: NDArray[np.uint8]
) -> None:
    frames, height, width = out.shape
    drawing = _Drawing(
        frames=frames,
        vertices=steps.shape[1],
        faces=len(corners),
        width=width,
        height=height,
        places=steps.ctypes.data,
        face=corners.ctypes.data,
        out=out.ctypes.data,
    )
    code.draw_silhouettes(ctypes.byref(drawing))


def _draw_by_numpy(
    steps: NDArray[np.int64], corners: NDArray[np.int64], out: NDArray[np.uint8]
) -> None:
    """Draws the same by the same tests: the sides of the square and the edges of the triangle
    separate them."""
    _, height, width = out.shape
    for picture, points in zip(out, steps, strict=True):
        for triangle in points[corners]:
            first = np.maximum(-((STEPS // 2 + _REACH - triangle.min(axis=0)) // STEPS), 0)
            last = np.minimum(
                (triangle.max(axis=0) + _REACH - STEPS // 2) // STEPS, [width - 1, height - 1]
            )
            if (first > last).any():
                continue
            x = np.arange(first[0], last[0] + 1) * STEPS + STEPS // 2
            y = np.arange(first[1], last[1] + 1)[:, None] * STEPS + STEPS // 2
            following = np.roll(triangle, -1, axis=0)
            (ux, uy), (vx, vy) = triangle[1] - triangle[0], triangle[2] - triangle[0]
            across = (following - triangle)[:, ::-1] * [-1, 1] * (-1 if ux * vy < uy * vx else 1)
            touched = np.ones((len(y), x.size), bool)
            for (a, b), corner in zip(across.tolist(), triangle.tolist(), strict=True):
                touched &= (
                    a * (x - corner[0]) + b * (y - corner[1]) + _REACH * (abs(a) + abs(b)) >= 0
                )
            picture[first[1] : last[1] + 1, first[0] : last[0] + 1] |= touched
