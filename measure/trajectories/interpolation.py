"""Interpolation between points of one flat cloth, as small dense matrices."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import RBFInterpolator

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

_COINCIDENT = 1e-6
"""Share of the cloth's size: points nearer than this are one. Rest coordinates are often kept in
single precision."""


def onto(source_rest: FloatArray, target_rest: FloatArray) -> FloatArray:
    """Computes the matrix that takes values at source points to values at target points: thin-plate
    splines in (u, v).

    Of all fields through the source's values it gives the one of least ∫ f_uu² + 2 f_uv² + f_vv²
    (Duchon, 1977), and so reproduces fields that are linear in (u, v). Where a target point is a
    source point its row is exactly that of the identity. The same points give the same matrix,
    which is kept and must not be written to.

    Args:
        source_rest: (source, 2) [m].
        target_rest: (target, 2) [m].

    Returns:
        (target, source), rows that sum to 1.

    Raises:
        InputError: coordinates that are not finite, fewer than three source points, two in one
            place, or all on a line.
    """
    source, target = (
        np.ascontiguousarray(rest, dtype=np.float64) for rest in (source_rest, target_rest)
    )
    for name, rest in (("source", source), ("target", target)):
        if rest.ndim != 2 or rest.shape[1] != 2 or not np.isfinite(rest).all():
            raise InputError(
                f"the {name} points have the shape {rest.shape}, or are not finite",
                where="interpolation",
                fix="give (point, 2) finite metres",
            )
    return _matrix(source.tobytes(), target.tobytes())


@lru_cache(maxsize=32)
def _matrix(source_bytes: bytes, target_bytes: bytes) -> FloatArray:
    source, target = (
        np.frombuffer(b, dtype=np.float64).reshape(-1, 2) for b in (source_bytes, target_bytes)
    )
    centre, size = _frame(source)
    source, target = (source - centre) / size, (target - centre) / size
    try:
        spline = RBFInterpolator(source, np.eye(len(source)), kernel="thin_plate_spline", degree=1)
    except np.linalg.LinAlgError:
        raise InputError(
            "all source points are on a line",
            where="interpolation",
            fix="give points that span the cloth",
        ) from None
    matrix = spline(target) if len(target) else np.zeros((0, len(source)))
    rows, columns = np.nonzero(_distances(target, source) < _COINCIDENT)
    matrix[rows] = 0.0
    matrix[rows, columns] = 1.0
    matrix.setflags(write=False)
    return matrix


def _frame(source: FloatArray) -> tuple[FloatArray, float]:
    """Computes the points' centre and the size of their box, once they are known to define a
    spline."""
    if len(source) < 3:
        raise InputError(
            f"there are {len(source)} source points",
            where="interpolation",
            fix="give at least three",
        )
    low, high = source.min(axis=0), source.max(axis=0)
    size = float((high - low).max())
    distances = _distances(source, source)
    np.fill_diagonal(distances, np.inf)
    if distances.min() <= _COINCIDENT * size:
        first, second = np.unravel_index(int(distances.argmin()), distances.shape)
        raise InputError(
            "two source points are at the same point",
            where=f"points {int(first)} and {int(second)}",
            fix="keep one of them",
        )
    return (low + high) / 2, size


def _distances(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])
