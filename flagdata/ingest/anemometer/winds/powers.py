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
_EXACT = 1e-6
"""What the arithmetic of shares may be off by."""
_ROUNDED = 0.0151
"""Of a difference of numbers with two decimals, the most that rounding makes."""


def of_others(values: Mapping[int, NDArray[np.float64]], columns: Sequence[int]) -> dict[int, tuple[int, str]]:
    """For each column that is a power of another, that column and the power's name.

    Args:
        values: (n,) as written, NaN where missing.
        columns: speeds.
    """
    found: dict[int, tuple[int, str]] = {}
    possible = _possible([values[index] for index in columns])
    for at, index in enumerate(columns):
        for below, base in enumerate(columns):
            apart = base in (index, *found) or not possible[below, at]
            power = None if apart else _power(values[base], values[index])
            if power is not None:
                found[index] = base, _POWERS[power]
                break
    return found


def cubes_by_name(labels: Mapping[int, tuple[str, ...]]) -> tuple[int, ...]:
    """The columns with the number 3 behind the name of a speed beside one without a number, and no other numbers.

    WS3 beside WS is the mean cube; beside WS1 and WS2 it is the third anemometer.

    Args:
        labels: of columns of speeds the words that tell them apart.
    """
    numbered = {label for label in labels.values() if len(label) == 1 and label[0].isdigit()}
    if () not in labels.values() or numbered != {("3",)}:
        return ()
    return tuple(index for index, label in labels.items() if label == ("3",))


def is_length(components: Sequence[NDArray[np.float64]], value: NDArray[np.float64]) -> bool:
    """Whether a column is √(x² + y²) of two components in all rows, to the digits that are written."""
    x, y = components
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(value)
    length = np.hypot(x[known], y[known])
    off = np.abs(length - value[known])
    return len(length) >= _ROWS and bool(np.all(off <= 2 * _ROUNDED)) and float(length.max()) > 2 * _ROUNDED


def _possible(columns: Sequence[NDArray[np.float64]]) -> NDArray[np.bool_]:
    """(base, other) pairs of columns that the first rows do not rule out: not too many of them are of no power.

    A table may have hundreds of speeds, of which hardly any pair is left for `_power` to look at whole.
    """
    count = len(columns)
    possible = np.zeros((count, count), dtype=np.bool_)
    if not count:
        return possible
    rows = len(columns[0])
    others = np.stack(columns)[:, : rows // 5 + 20]
    for at, speed in enumerate(others):
        telling = np.isfinite(others) & (speed >= _TOLD)
        for power in _POWERS:
            ratio = np.divide(others, speed**power, out=np.zeros_like(others), where=telling)
            off = (telling & ((ratio < _LEAST) | (ratio > _MOST))).sum(axis=1)
            possible[at] |= off <= (1 - _SHARE) * rows + _EXACT
    return possible


def differences(values: Mapping[int, NDArray[np.float64]], columns: Sequence[int]) -> dict[int, tuple[int, int]]:
    """For each column that is one other column less another, and below zero somewhere, those two.

    Args:
        values: (n,) as written, NaN where missing.
        columns: speeds.
    """
    found: dict[int, tuple[int, int]] = {}
    varying = [at for at in columns if len(np.unique(values[at][np.isfinite(values[at])])) > 1]
    for index in columns:
        if not bool(np.any(values[index] < 0)):
            continue
        for first, second in permutations([at for at in varying if at != index], 2):
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
