"""Questions that wind columns raise: a gust's factor, and where the wind goes to or comes from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.core.units import UNITS
from flagdata.ingest.anemometer.draft.heading_words import (
    GUSTS,
    Meaning,
    fits,
    named_alike,
)
from flagdata.ingest.anemometer.draft.questions import Open
from flagdata.ingest.anemometer.draft.table_shape import TableShape, is_number
from flagdata.record.signals import Series

_APART, _TOGETHER, _LEAST = 30.0, 0.9, 5
"""Degrees between a direction and its components, length of the mean of unit vectors, and rows that
show it."""
_FACTORS = (1.0, 3.2)
"""Gusts by the mean of their time: below 1 is impossible, above 3.2 no station has it in the mean
of a log."""


def gust_factor(shape: TableShape, meanings: Sequence[Meaning], speed: int) -> Open | None:
    """Asks about a speed whose gusts are no gusts of it; `None` where there are none, or they
    are."""
    speed_heading = meanings[speed]
    for index, gust_heading in enumerate(meanings):
        of_speed = gust_heading.unit is None or fits("wind_speed", gust_heading.unit)
        if index == speed or not (
            set(gust_heading.against) & GUSTS
            and of_speed
            and named_alike(gust_heading, speed_heading)
        ):
            continue
        mean, gust = _numbers(shape, speed), _numbers(shape, index)
        present = np.isfinite(mean) & np.isfinite(gust)
        if present.sum() < _LEAST or mean[present].sum() <= 0:
            continue
        scale = (
            UNITS[gust_heading.unit or "m/s"].scale / UNITS[speed_heading.unit or "m/s"].scale
            if gust_heading.unit and speed_heading.unit
            else 1.0
        )
        factor = float(scale * gust[present].sum() / mean[present].sum())
        if not _FACTORS[0] <= factor <= _FACTORS[1]:
            question = (
                f"{shape.shown(index)} is {factor:.2g} times {shape.shown(speed)} in the mean; "
                "gusts are "
                f"{_FACTORS[0]:g} to {_FACTORS[1]:g} times the wind. Is {shape.shown(speed)} the "
                "mean wind?"
            )
            return Open(key="expect", question=question, example="gust")
    return None


def ask_about_direction(
    shape: TableShape, axes: tuple[int, int], direction: int, unit: str
) -> Open | None:
    """Asks about a direction that components towards east and north beside it contradict.

    Args:
        axes: columns of the components.
        unit: of the direction, "deg" or "rad".
    """
    x, y, away = (_numbers(shape, index) for index in (*axes, direction))
    present = np.isfinite(x) & np.isfinite(y) & np.isfinite(away) & (np.hypot(x, y) > 0)
    if present.sum() < _LEAST:
        return None
    from_components = np.arctan2(-x[present], -y[present])
    mean_turn = np.exp(1j * (UNITS[unit].scale * away[present] - from_components)).mean()
    degrees = float(np.rad2deg(np.angle(mean_turn)))
    if abs(mean_turn) >= _TOGETHER and abs(degrees) <= _APART:
        return None
    columns = f"{shape.shown(direction)} and the components {', '.join(map(shape.shown, axes))}"
    how = (
        f"differ by {degrees:.0f}\N{DEGREE SIGN}"
        if abs(mean_turn) >= _TOGETHER
        else "do not turn together"
    )
    question = f"{columns} {how}. Does {shape.shown(direction)} say where the wind comes from?"
    return Open(key="expect", question=question, example="components")


def _numbers(shape: TableShape, index: int) -> Series:
    """Reads (n,) cells of a column in the first rows as numbers; NaN where one is no number."""
    cells = (cell.replace(",", ".") for cell in shape.column(index))
    return np.array([float(cell) if is_number(cell) else np.nan for cell in cells])
