"""Tables that lie on their side: a quantity a row, a place a column. They are stood up, a row a place.

    Site,M2,M3,M4
    Date,2026-05-07 19:00,2026-05-07 19:00,2026-05-07 19:00
    Wind Speed (kn),1.1,3.9,6.6
    Wind Direction (°),143,215,113

So pages of marine and mountain stations show the latest readings of all of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import names_time, understand

_LEAST, _MOST = 3, 200
"""Quantities of a table, and lines of one: a table of readings has more."""


def matches(lines: Sequence[str]) -> bool:
    """The first cells name a wind, its time and other quantities, and numbers stand beside the wind's name."""
    return _sign(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """A row for each column beside the first; nothing where the file is longer than such tables are."""
    lines = [line for line in source.each_line() if line.strip()]
    sign = _sign(lines)
    if sign is None or len(lines) > _MOST:
        return None
    rows = [row for line in lines if any((row := cut(line, sign))[1:])]
    width = max(len(row) for row in rows)
    filled = [[*row, *[""] * (width - len(row))] for row in rows]
    places = [list(column) for column in zip(*filled, strict=True)]
    return table(source, places[0], places[1:], kind="lying-table", what="a quantity a row, a place a column")


def _sign(lines: Sequence[str]) -> str | None:
    """The delimiter of a table that lies on its side; `None` where the lines are none."""
    filled = [line for line in lines if line.strip()]
    for sign in SIGNS:
        rows = [row for line in filled if len(row := cut(line, sign)) > 1]
        if len(rows) < max(_LEAST, 0.6 * len(filled)) or len(rows) > _MOST:
            continue
        if sum(any(letter.isalpha() for letter in row[0]) for row in rows) < _LEAST:
            continue  # stamps or numbers, as rows begin
        meant = [understand(row[0]) for row in rows]
        speeds = [row for row, heading in zip(rows, meant, strict=True) if heading.channel == "wind_speed"]
        known = sum(bool(heading.quantity) for heading in meant)
        across = [understand(cell).quantity for cell in rows[0][1:]]
        timed = any(names_time(row[0]) and cell_kind(row[1]) in ("stamp", "text") for row in rows)
        if len(speeds) == 1 and known >= _LEAST and timed and not any(across) and _numbers(speeds[0][1:]):
            return sign
    return None


def _numbers(cells: Sequence[str]) -> bool:
    """Whether all cells that are filled are numbers."""
    known = [cell_kind(cell) for cell in cells if cell.strip()]
    return bool(known) and all(kind in ("number", "missing") for kind in known)
