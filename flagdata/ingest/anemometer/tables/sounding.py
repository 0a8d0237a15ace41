"""Profiles over height at one instant, as radiosondes measure them: no series in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import words_of

_PRESSURES = frozenset({"pres", "press", "pressure", "p", "plev", "druck", "presion", "pressao", "pression"})
_HEIGHTS = frozenset({"hght", "hgt", "height", "alt", "altitude", "geopotential", "gph", "z", "höhe", "altitud"})
_ROWS, _SPAN = 5, 1000.0
"""Rows of a profile, and the height [m or ft] that it reaches over at least."""


def told(layout: Layout) -> str:
    """What is said of a table whose pressure falls while its height rises from row to row; "" of any other."""
    pressure, height = _column(layout, _PRESSURES), _column(layout, _HEIGHTS)
    if pressure is None or height is None:
        return ""
    known = np.isfinite(pressure) & np.isfinite(height)
    falls, rises = np.diff(pressure[known]), np.diff(height[known])
    if len(rises) < _ROWS or not np.all(rises > 0) or not np.all(falls < 0) or float(rises.sum()) < _SPAN:
        return ""
    return "the rows are a profile over height, as a radiosonde measures at one time, no series in time; "


def _column(layout: Layout, words: frozenset[str]) -> NDArray[np.float64] | None:
    """The numbers of the first column with such a heading."""
    found = next((at for at, name in enumerate(layout.names) if set(words_of(name)) & words), None)
    return None if found is None else numbers(layout.column(found), decimal=layout.decimal).value
