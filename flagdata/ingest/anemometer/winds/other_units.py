"""Columns of one speed in two units that no heading states: "windspeed1" and "windspeed2", 1.61 times the first.

A user's `--unit` is that of one of them; said of both, it would make a wrong wind of the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from flagdata.units import unit

_UNITS = ("m/s", "km/h", "mph", "kn", "ft/s", "dm/s", "cm/s")
_DIFFERENT = 4
"""Different speeds from which a constant ratio between two columns is evidence."""
_SHARE, _WIDER = 0.95, 3.0
"""Share of the rows in which the ratio must hold, and how many times wider than their rounding the speeds must vary."""


def again(values: Mapping[int, NDArray[np.float64]], columns: Sequence[int]) -> dict[int, int]:
    """For each column that is an earlier one in another unit, that column.

    Args:
        values: (n,) as written, NaN where missing.
        columns: speeds whose unit no heading states.
    """
    found: dict[int, int] = {}
    for first, second in combinations(columns, 2):
        if first not in found and second not in found and _converted(values[first], values[second]):
            found[second] = first
    return found


def _converted(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether numbers are others in another unit, within what both are rounded to."""
    known = np.isfinite(one) & np.isfinite(other)
    a, b = one[known], other[known]
    if len(np.unique(a)) < _DIFFERENT or len(np.unique(b)) < _DIFFERENT:
        return False
    ratios = {unit(x).scale / unit(y).scale for x in _UNITS for y in _UNITS if x != y}
    for ratio in ratios:
        rounded = 0.51 * (_step(b) + _step(a) * ratio)
        close = np.abs(b - ratio * a) <= rounded + 2e-3 * np.abs(b)
        if float(close.mean()) >= _SHARE and float(np.std(ratio * a)) >= _WIDER * rounded:
            return True
    return False


def _step(value: NDArray[np.float64]) -> float:
    """The last digit that is written."""
    return next((10.0**-n for n in range(6) if np.allclose(value * 10**n, np.round(value * 10**n), atol=1e-6)), 1e-6)
