"""Columns beside the wind that contradict it: gusts of the same name, and components that blow elsewhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.ingest.anemometer.draft.questions import Open
from flagdata.ingest.anemometer.draft.shape import Shape, is_number
from flagdata.ingest.anemometer.draft.words import GUSTS, Meaning, fits, named_alike
from flagdata.signals import Series
from flagdata.units import UNITS

_FACTORS = (1.0, 3.2)
"""Gusts by the mean of their time: below 1 is impossible, above 3.2 no station has it in the mean of a log."""
_APART, _TOGETHER, _LEAST = 30.0, 0.9, 5
"""Degrees between a direction and its components, length of the mean of unit vectors, and rows that show it."""


def gust_factor(shape: Shape, meanings: Sequence[Meaning], speed: int) -> Open | None:
    """The question about a speed whose gusts are no gusts of it; `None` where there are none, or they are."""
    own = meanings[speed]
    for index, one in enumerate(meanings):
        of_speed = one.unit is None or fits("wind_speed", one.unit)
        if index == speed or not (set(one.against) & GUSTS and of_speed and named_alike(one, own)):
            continue
        mean, gust = _numbers(shape, speed), _numbers(shape, index)
        both = np.isfinite(mean) & np.isfinite(gust)
        if both.sum() < _LEAST or mean[both].sum() <= 0:
            continue
        scale = UNITS[one.unit or "m/s"].scale / UNITS[own.unit or "m/s"].scale if one.unit and own.unit else 1.0
        factor = float(scale * gust[both].sum() / mean[both].sum())
        if not _FACTORS[0] <= factor <= _FACTORS[1]:
            question = (
                f"{shape.shown(index)} is {factor:.2g} times {shape.shown(speed)} in the mean; gusts are "
                f"{_FACTORS[0]:g} to {_FACTORS[1]:g} times the wind. Is {shape.shown(speed)} the mean wind?"
            )
            return Open(key="expect", question=question, example="gust")
    return None


def components(shape: Shape, axes: tuple[int, int], direction: int, unit: str) -> Open | None:
    """The question about a direction that components towards east and north beside it contradict.

    Args:
        axes: columns of the components.
        unit: of the direction, "deg" or "rad".
    """
    x, y, away = (_numbers(shape, index) for index in (*axes, direction))
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(away) & (np.hypot(x, y) > 0)
    if known.sum() < _LEAST:
        return None
    from_components = np.arctan2(-x[known], -y[known])
    apart = np.exp(1j * (UNITS[unit].scale * away[known] - from_components)).mean()
    degrees = float(np.rad2deg(np.angle(apart)))
    if abs(apart) >= _TOGETHER and abs(degrees) <= _APART:
        return None
    named = f"{shape.shown(direction)} and the components {', '.join(map(shape.shown, axes))}"
    how = f"differ by {degrees:.0f}\N{DEGREE SIGN}" if abs(apart) >= _TOGETHER else "do not turn together"
    question = f"{named} {how}. Does {shape.shown(direction)} say where the wind comes from?"
    return Open(key="expect", question=question, example="components")


def _numbers(shape: Shape, index: int) -> Series:
    """(n,) the cells of a column in the first rows; NaN where one is no number."""
    cells = (cell.replace(",", ".") for cell in shape.column(index))
    return np.array([float(cell) if is_number(cell) else np.nan for cell in cells])
