"""Tables with the wind's direction and speed in one cell, cut into two.

2026-05-01 12:00,WSW 4.3 km/h        or 249@4.3, 249/12, 12 kt from SW
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

from flagdata.compass import POINTS
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.headings import interest, words_of
from flagdata.ingest.anemometer.layout import Layout, cut, lay_out
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.source import TableText, TextFile
from flagdata.units import UNITS, spelled

_DIRECTION = r"(?P<direction>\d{1,3}(?:\.\d+)?(?=\s?°|\s*[@/])|[A-Za-z]{1,3}(?![A-Za-z/]))\s?°?"
_SPEED = r"(?P<speed>\d{1,3}(?:[.,]\d+)?)\s?(?P<unit>[^\W\d_]{1,5}(?:/[^\W\d_])?)?"
_FIRST = re.compile(rf"{_DIRECTION}\s*(?:@|/|,|at)?\s*{_SPEED}", re.IGNORECASE)
_LAST = re.compile(rf"{_SPEED}\s*(?:from|@|/)?\s+{_DIRECTION.replace('(?=', '(?=$|')}", re.IGNORECASE)
_NAMES = frozenset({"wind", "viento", "vent", "vento", "wnd"})
_SHARE = 0.9
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Whether a column is called after the wind and holds both in nearly every cell."""
    hinted = any(word in line.lower() for line in lines for word in (*_NAMES, "dir"))
    return hinted and _column(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The table with the direction and the speed in columns of their own, behind the others."""
    found = _column(source.head(HEAD_LINES))
    if found is None:
        return None
    layout, column, unit = found
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    heading = [name or f"column {at}" for at, name in enumerate(layout.names, start=1)]
    others = [at for at in range(len(heading)) if at != column]
    speed = f"wind speed [{unit}]" if unit else "wind speed"
    writer.writerow([*(heading[at] for at in others), "wind direction", speed])
    short = 0
    for number, lines in source.blocks():
        for line in lines[max(0, layout.lines[0] - number) :]:
            cells = cut(line, layout.delimiter)
            if len(cells) < len(heading):
                short += bool(line.strip())
                continue
            both = _both(cells[column])
            writer.writerow([*(cells[at] for at in others), *(("", "") if both is None else both[:2])])
    text = f"column {layout.names[column]!r} holds direction and speed: read as two columns behind the others"
    notes = [Finding(kind="two-in-a-cell", severity=Severity.NOTE, what=text)]
    if short:
        what = f"{short} lines have fewer columns than the table; left out"
        notes.append(Finding(kind="malformed-lines", severity=Severity.ERROR, count=short, what=what))
    return TableText.of(source, out.getvalue().splitlines(), notes)


def _column(lines: Sequence[str]) -> tuple[Layout, int, str] | None:
    """The table, the column that holds both, and the one unit of its speeds ("" where none is written)."""
    layout = lay_out(lines, interest=interest)
    if layout is None:
        return None
    for column, name in enumerate(layout.names):
        words = set(words_of(name))
        if not words & _NAMES and not ({"dir"} <= words and words & {"spd", "speed"}):
            continue
        cells = [cell for cell in layout.column(column) if cell]
        both = [found for cell in cells if (found := _both(cell)) is not None]
        units = {unit for _, _, unit in both}
        if len(both) >= max(_LEAST, _SHARE * len(cells)) and len(units) == 1:
            return layout, column, units.pop()
    return None


def _both(cell: str) -> tuple[str, str, str] | None:
    """Direction, speed and unit of a cell; `None` where it holds something else."""
    for shape in (_FIRST, _LAST):
        match = shape.fullmatch(cell.strip())
        if match is None:
            continue
        direction, unit = match["direction"], match["unit"] or ""
        named = spelled(unit) if unit else None
        if unit and (named is None or UNITS[named].si != "m/s"):
            continue
        if direction[0].isdigit() or direction.upper() in POINTS:
            return direction, match["speed"].replace(",", "."), unit
    return None
