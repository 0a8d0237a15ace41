"""Columns that are squares, cubes or differences of speeds beside them, which no heading tells from speeds.

Loggers of wind energy keep "WS3_Avg", the mean cube of the speed, for the power of the wind. The mean of a cube is at
least the cube of the mean, and at a turbulence intensity of 0.3 it is 1 + 3 · 0.3² = 1.27 times that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

_POWERS = {2: "square", 3: "cube"}
_LEAST, _MOST = 0.97, 1.6
"""Of the ratio to the power of the mean: the least by rounding, the most by a turbulence intensity of 0.45."""
_TOLD = 1.5
"""Speeds from which on a power is told from its speed."""
_ROWS, _SHARE, _APART = 5, 0.95, 1.3
"""Rows that must tell, the share of them that must agree, and how much the speeds in them must differ."""
_ROUNDED = 0.0151
"""Of a difference of numbers with two decimals, the most that rounding makes."""


def of_others(values: Mapping[int, NDArray[np.float64]], columns: Sequence[int]) -> dict[int, tuple[int, str]]:
    """For each column that is a power of another, that column and the power's name.

    Args:
        values: (n,) as written, NaN where missing.
        columns: speeds.
    """
    found: dict[int, tuple[int, str]] = {}
    for index in columns:
        for base in columns:
            power = None if base in (index, *found) else _power(values[base], values[index])
            if power is not None:
                found[index] = base, _POWERS[power]
                break
    return found


def differences(values: Mapping[int, NDArray[np.float64]], columns: Sequence[int]) -> dict[int, tuple[int, int]]:
    """For each column that is one other column less another, and below zero somewhere, those two.

    Args:
        values: (n,) as written, NaN where missing.
        columns: speeds.
    """
    found: dict[int, tuple[int, int]] = {}
    for index in columns:
        if not bool(np.any(values[index] < 0)):
            continue
        for first, second in permutations([at for at in columns if at != index], 2):
            off = np.abs(values[first] - values[second] - values[index])
            known = off[np.isfinite(off)]
            if len(known) >= _ROWS and float((known <= _ROUNDED).mean()) >= _SHARE:
                found[index] = first, second
                break
    return found


def _power(base: NDArray[np.float64], value: NDArray[np.float64]) -> int | None:
    telling = np.isfinite(base) & np.isfinite(value) & (base >= _TOLD)
    speed, other = base[telling], value[telling]
    if len(speed) < _ROWS or speed.max() < _APART * speed.min():
        return None
    for power in _POWERS:
        ratio = other / speed**power
        if float(((ratio >= _LEAST) & (ratio <= _MOST)).mean()) >= _SHARE:
            return power
    return None
