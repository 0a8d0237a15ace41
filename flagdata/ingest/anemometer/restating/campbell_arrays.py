"""Mixed arrays of Campbell Scientific's older loggers: rows without headings, of several lengths in one file.

    30,1999,61,1130,5.9,6.1,0,0
    60,1999,61,1200,12.66,7.53,.762,5.468,5.31,4.6,48.5

The first cell is the number of the array, 1 to 1023, of which each has its own cells; then year, day of the year, and
hours and minutes, of which 2400 or 0 is midnight (Campbell Scientific, LoggerNet, "Array Compatible CSV"). An array is
read as a station. What its cells are only the logger's program tells.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_ROW = re.compile(
    r"\s*(?P<array>\d{1,4}),\s*(?P<year>(?:19|20)\d\d),\s*(?P<day>\d{1,3}),\s*(?P<time>\d{1,4})(?P<cells>(?:,[^,]*)+)\s*"
)
_NUMBER = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)?\s*")
_NAMES = ("station", "year", "day of year", "hhmm")
_MOST, _LEAST, _SHARE = 1023, 4, 0.9


def matches(lines: Sequence[str]) -> bool:
    """Nearly all lines are rows of two or more arrays, each of one length, which are not all the same."""
    filled = [line for line in lines if line.strip()]
    known = [row for line in filled if (row := _cells(line)) is not None]
    if len(known) < max(_LEAST, _SHARE * len(filled)):
        return False
    kinds = {(row[0], len(row)) for row in known}
    arrays, lengths = ({kind[place] for kind in kinds} for place in (0, 1))
    return len(kinds) == len(arrays) > 1 and len(lengths) > 1


def as_table(source: TextFile) -> TableText | None:
    """Rows of all arrays, the shorter ones filled up, with the array as the station."""
    rows, other = rows_of(source, _cells)
    width = max(map(len, rows))
    names = [*_NAMES, *(f"field {number}" for number in range(len(_NAMES) + 1, width + 1))]
    filled = ([f"array {row[0]}", *row[1:], *[""] * (width - len(row))] for row in rows)
    arrays = sorted({(int(row[0]), len(row)) for row in rows})
    what = "mixed arrays of a Campbell logger, " + ", ".join(f"{array} of {count} cells" for array, count in arrays)
    return table(source, names, filled, kind="campbell-arrays", what=what, left_out=other)


def _cells(line: str) -> list[str] | None:
    """The cells of a row; `None` where a line is none."""
    match = _ROW.fullmatch(line)
    if match is None or not 1 <= int(match["array"]) <= _MOST or not 1 <= int(match["day"]) <= 366:
        return None
    if int(match["time"]) > 2400 or int(match["time"]) % 100 > 59:
        return None
    cells = match["cells"][1:].split(",")
    if not all(_NUMBER.fullmatch(cell) for cell in cells):
        return None
    return [match["array"], match["year"], match["day"], f"{int(match['time']):04d}", *map(str.strip, cells)]
