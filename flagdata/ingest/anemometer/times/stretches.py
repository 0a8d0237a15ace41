"""Tables of several stretches one below the other, each with a count of time of its own: the column that tells them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout

_LEAST = 3
"""Rows of a stretch."""


def column(layout: Layout, time: Sequence[int]) -> int | None:
    """The first column whose cells change exactly where a count starts again, and do not return; `None` without one.

    Args:
        time: the one column of the count; more are none.
    """
    if len(time) != 1:
        return None
    count = numbers(layout.column(time[0]), decimal=layout.decimal).value
    falls = np.flatnonzero(np.diff(count) < 0) + 1
    edges = [0, *falls.tolist(), len(count)]
    if not len(falls) or min(np.diff(edges)) < _LEAST:
        return None
    for index in range(layout.number_of_columns()):
        cells = layout.column(index)
        firsts = [cells[edge] for edge in edges[:-1]]
        alike = all(len(set(cells[begin:end])) == 1 for begin, end in pairwise(edges))
        if index not in time and alike and "" not in firsts and len(set(firsts)) == len(firsts):
            return index
    return None
