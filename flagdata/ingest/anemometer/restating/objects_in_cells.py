"""Tables with an object in a cell, as Python or JSON prints it, cut into a column for each of its members.

    dt,name,wind
    1777636800,Mast,"{'speed': 6.2, 'deg': 275, 'gust': 9.7}"       wind.speed, wind.deg, wind.gust

Programs that write a service's answer to a table cell by cell leave its objects so.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence

from flagdata.errors import LimitError
from flagdata.ingest.anemometer.documents.json_text import WIDEST, members
from flagdata.ingest.anemometer.restating import restate
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_OPENINGS = ("{'", '{"')
_SHARE = 0.8
"""Share of a column's filled cells that must hold an object."""


def matches(lines: Sequence[str]) -> bool:
    """Whether a column of a table holds objects in nearly all of its filled cells."""
    return any("{" in line for line in lines) and bool(_columns(lines)[1])


def as_table(source: TextFile) -> TableText | None:
    """The table with the members of its objects as columns, in place of them.

    Raises:
        LimitError: the objects have more than `WIDEST` kinds of members.
    """
    head = source.head(restate.LOOKED_AT)
    delimiter, columns = _columns(head)
    lines = source.each_line()
    rows = csv.reader(lines, delimiter=delimiter)
    names = next(rows)
    kept = [at for at in range(len(names)) if at not in columns]
    found: list[tuple[list[str], dict[str, str]]] = []
    inner: dict[str, None] = {}
    for row in rows:
        own = {
            f"{names[at]}.{key}": text
            for at in columns if at < len(row) for key, text in (members(row[at]) or {}).items()
        }  # fmt: skip
        inner.update(dict.fromkeys(own))
        if len(inner) > WIDEST:
            raise LimitError(
                f"objects in cells with more than {WIDEST} kinds of members",
                where=str(source.path), fix="write the columns needed to a CSV file",
            )  # fmt: skip
        if any(cell.strip() for cell in row):
            found.append(([row[at] if at < len(row) else "" for at in kept], own))
    listed = ", ".join(repr(names[at]) for at in columns)
    return restate.table(
        source, [*(names[at] for at in kept), *inner],
        ([*cells, *(own.get(name, "") for name in inner)] for cells, own in found),
        kind="objects-in-cells", what=f"a table with objects in the cells of {listed}",
    )  # fmt: skip


def _columns(lines: Sequence[str]) -> tuple[str, tuple[int, ...]]:
    """The delimiter of a table below a line of names, and its columns of objects; none where there are none."""
    for delimiter in SIGNS:
        rows = list(_rows(lines, delimiter))
        if len(rows) < 2 or not all(rows[0]) or len(rows[0]) < 2:
            continue
        found = tuple(at for at in range(len(rows[0])) if _objects([row[at] for row in rows[1:] if at < len(row)]))
        if found:
            return delimiter, found
    return ",", ()


def _rows(lines: Sequence[str], delimiter: str) -> Iterator[list[str]]:
    try:
        yield from csv.reader(lines, delimiter=delimiter)
    except csv.Error:
        return


def _objects(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell.strip()]
    opened = sum(cell.startswith(_OPENINGS) and members(cell) is not None for cell in filled)
    return bool(filled) and opened >= _SHARE * len(filled)
