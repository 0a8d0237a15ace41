"""Observations of CRHM, whose lines above a row of # are names with the number of columns each has.

    made from the station's log
    t 1 (°C)
    u 2 (m/s)
    ########
    38656.04167    -1.39    2.31    2.50

Source: University of Saskatchewan, "Cold Regions Hydrological Model", the format of .obs files: before the values
stands the time, as days since 1899-12-30 in one column, or as year, month, day, hour and minute in five.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_RULE = re.compile(r"#{3,}[\s#]*")
_FIELD = re.compile(r"(?P<name>[A-Za-z]\w*)\s+(?P<count>[1-9]\d?)(?P<unit>\s*\([^)]*\))?(?:\s.*)?")
_TIMES = {1: ("time",), 5: ("year", "month", "day", "hour", "minute")}
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def matches(lines: Sequence[str]) -> bool:
    """Names with their counts stand above a row of #, below a first line of any text."""
    return bool(_names(lines))


def as_table(source: TextFile) -> TableText | None:
    """Time and values below their names; `None` where the rows have other columns."""
    names = _names(source.head())
    cells = next((cut for _, lines in source.blocks() for line in lines if (cut := _row(line)) is not None), [])
    times = _TIMES.get(len(cells) - len(names))
    if times is None:
        return None
    rows, _ = rows_of(source, lambda line: _row(line, len(cells)))
    return table(source, [*times, *names], rows, kind="counted-fields", what="observations of CRHM")


def _names(lines: Sequence[str]) -> list[str]:
    """The names of the columns, one for each; none where the lines above the row of # are others."""
    end = next((at for at, line in enumerate(lines) if _RULE.fullmatch(line.strip())), 0)
    found: list[str] = []
    for line in lines[1:end]:
        match = _FIELD.fullmatch(line.strip())
        if match is not None:
            count, unit = int(match["count"]), match["unit"] or ""
            found += [f"{match['name']}{number if count > 1 else ''}{unit}" for number in range(1, count + 1)]
        elif line.strip() and line.strip()[0] not in "$/":
            return []
    return found


def _row(line: str, width: int | None = None) -> list[str] | None:
    """The cells of a row of numbers; `None` for another line."""
    cells = line.replace(",", " ").split()
    if not cells or width not in (None, len(cells)) or not all(map(_NUMBER.fullmatch, cells)):
        return None
    return cells
