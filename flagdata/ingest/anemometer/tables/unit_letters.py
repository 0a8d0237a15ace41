"""Letters for the unit of a speed that instruments of Gill write into every line, as cells of a table."""

from __future__ import annotations

import re
from dataclasses import replace

from flagdata.ingest.anemometer.text.layout import Layout

GILL = {"M": "m/s", "N": "kn", "P": "mph", "K": "km/h", "F": "ft/min"}
"""Gill Instruments, WindSonic User Manual (1405-PS-0019, issue 28), 9.1: the unit's letter behind the speed."""
_CELLS = (
    re.compile(r".*(?<![A-Za-z])[A-Z]"), re.compile(r"(?:\d{1,3}(?:\.\d)?)?"), re.compile(r"\d{1,3}\.\d{1,2}"),
    re.compile(rf"[{''.join(GILL)}]"), re.compile(r"[0-9A-F]{1,2}"),
)  # fmt: skip
"""The instrument's letter at the end of what stands before it, direction, speed, unit, status."""
_DIRECTION, _SPEED, _LETTER = 1, 2, 3


def with_letters(layout: Layout) -> Layout:
    """A table whose rows hold lines of Gill's polar format, cut at their commas, with the unit of the speed.

    The letter must be the same in all the first rows, as every further row is checked to have it.
    """
    for start in range(layout.number_of_columns() - len(_CELLS) + 1):
        cells = [layout.column(start + at) for at in range(len(_CELLS))]
        speed = start + _SPEED
        letters = set(cells[_LETTER])
        if len(letters) != 1 or not any(cells[_DIRECTION]) or layout.units[speed] not in ("", *letters):
            continue
        if not all(shape.fullmatch(cell) for shape, column in zip(_CELLS, cells, strict=True) for cell in column):
            continue
        units, beside = list(layout.units), list(layout.unit_columns)
        units[speed], beside[speed] = GILL[letters.pop()], speed + 1
        return replace(layout, units=tuple(units), unit_columns=tuple(beside))
    return layout
