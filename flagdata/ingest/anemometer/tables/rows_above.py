"""Rows that stand above a table in another form, as of a logger whose program was changed: told, since none is read."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout, cut

_SEVERAL, _FILLED = 3, 0.8
"""Lines of a table's form above it that are told, and the share of their cells that holds numbers or stamps."""


def rows_above(lines: Sequence[str], layout: Layout) -> str:
    """What is said of lines above a table that hold a stamp and numbers, divided as its rows are; "" without any."""
    end = layout.lines[0] - 1 if layout.lines else 0
    found = [number for number, line in enumerate(lines[:end], start=1) if _is_row(line, layout)]
    if not found:
        return _of_its_form(lines[:end], layout)
    shown = (
        f"line {found[0]} is a row" if len(found) == 1 else f"lines {found[0]} to {found[-1]} hold {len(found)} rows"
    )
    own = layout.number_of_columns()
    return f"{shown} of another form than the {own} columns below: left out; ingest them from a file of their own"


def _of_its_form(above: Sequence[str], layout: Layout) -> str:
    """What is said of lines above a table that are divided and filled as its rows are, among lines that are not."""
    own = layout.number_of_columns()
    kinds = [[cell_kind(cell) for cell in cut(line, layout.delimiter)] for line in above]
    found = [
        number for number, cells in enumerate(kinds, start=1)
        if len(cells) == own and cells.count("number") + cells.count("stamp") >= _FILLED * own
    ]  # fmt: skip
    if len(found) < _SEVERAL or layout.delimiter == " ":
        return ""
    return (
        f"{len(found)} of lines {found[0]} to {found[-1]} are divided as the rows are, but stand among others above "
        f"the first row (line {layout.lines[0]}): left out; put the rows of one form into a file of their own"
    )


def _is_row(line: str, layout: Layout) -> bool:
    """Whether a line begins with a stamp and has numbers, as the rows of the table do."""
    cells = [cell for cell in cut(line, layout.delimiter) if cell]
    kinds = [cell_kind(cell) for cell in cells]
    if layout.delimiter == " " or len(cells) < 2 or kinds[0] != "stamp":
        return False
    like = [cell_kind(row[0]) == "stamp" for row in layout.rows]
    return sum(like) > 0.5 * len(like) and kinds.count("number") > 0 and kinds.count("text") <= 0.5 * len(kinds)
