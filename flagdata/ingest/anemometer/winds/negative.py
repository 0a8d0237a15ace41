"""Columns that go below zero, as components of a wind do and no speed does; codes for no value apart."""

from __future__ import annotations

import numpy as np

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import missing_codes
from flagdata.ingest.anemometer.winds.codes import below_zero

_BELOW, _OFTEN, _FEW = -0.5, 0.1, 5
"""Speeds below this [in the file's unit], in this share of at least so many rows, are those of a component."""
_NOISE, _SOME = -0.05, 0.1
"""Numbers below this in any such share are of no speed that is offered."""


def lowest(layout: Layout, index: int) -> float | None:
    """The lowest number of a column that is below zero too often and too far to be a speed; `None` where it is not."""
    known = _known(layout, index)
    low = len(known) >= _FEW and float((known < _BELOW).mean()) >= _OFTEN
    return float(known.min()) if low else None


def may_be_speed(layout: Layout, index: int) -> bool:
    """Whether nothing in the first rows of a column is as far below zero as no speed is, nor often a little below."""
    known = _known(layout, index)
    return not len(known) or (float(known.min()) >= _BELOW and float((known < _NOISE).mean()) < _SOME)


def _known(layout: Layout, index: int) -> np.ndarray:
    """The numbers of a column that are no codes for no value."""
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value) & ~np.isin(value, missing_codes.CODES)]
    return known[~below_zero(known)]
