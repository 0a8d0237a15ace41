"""Rows that stand above a table in another form, as of a logger whose program was changed: told, since none is read."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout, cut

_SEVERAL, _FILLED = 3, 0.8
"""Lines of numbers above a table that are told, and the share of their filled cells that holds numbers or stamps."""
_FIRST, _HALF = 3, 0.5
"""Cells by which a line is like the rows where blanks divide them and no line names them, and its share of numbers."""


def rows_above(lines: Sequence[str], layout: Layout) -> str:
    """What is said of lines above a table that hold a stamp and numbers, divided as its rows are; "" without any."""
    end = layout.lines[0] - 1 if layout.lines else 0
    found = [number for number, line in enumerate(lines[:end], start=1) if _is_row(line, layout)]
    if not found:
        return _of_numbers(lines[:end], layout)
    shown = (
        f"line {found[0]} is a row" if len(found) == 1 else f"lines {found[0]} to {found[-1]} hold {len(found)} rows"
    )
    own = layout.number_of_columns()
    return f"{shown} of another form than the {own} columns below: left out; ingest them from a file of their own"


def _of_numbers(above: Sequence[str], layout: Layout) -> str:
    """What is said of lines above a table that hold little but numbers, divided as its rows are."""
    blanks = layout.delimiter == " "
    if blanks and layout.header:
        return ""  # a title's words and numbers are divided by blanks as well
    kinds = [[kind for cell in cut(line, layout.delimiter) if (kind := cell_kind(cell)) != "missing"] for line in above]
    first = [cell_kind(cell) for cell in layout.rows[0][:_FIRST]]
    found = [
        number for number, cells in enumerate(kinds, start=1)
        if (cells[:_FIRST] == first and _numbers(cells) >= _HALF if blanks
            else len(cells) > 1 and _numbers(cells) >= _FILLED)
    ]  # fmt: skip
    if len(found) < _SEVERAL:
        return ""
    return (
        f"{len(found)} of lines {found[0]} to {found[-1]} hold numbers as the rows do, but stand among others above "
        f"the first row that is read (line {layout.lines[0]}): left out; put the rows of one form into a file of their "
        "own"
    )


def _numbers(cells: Sequence[str]) -> float:
    """The share of the kinds of cells that is of numbers and stamps."""
    return (cells.count("number") + cells.count("stamp")) / max(1, len(cells))


def _is_row(line: str, layout: Layout) -> bool:
    """Whether a line begins with a stamp, and has numbers or as many cells as the rows of the table."""
    every = cut(line, layout.delimiter)
    kinds = [cell_kind(cell) for cell in every if cell]
    if layout.delimiter == " " or len(kinds) < 2 or kinds[0] != "stamp":
        return False
    like = [cell_kind(row[0]) == "stamp" for row in layout.rows]
    filled = kinds.count("number") > 0 and kinds.count("text") <= 0.5 * len(kinds)
    return sum(like) > 0.5 * len(like) and (filled or len(every) == layout.number_of_columns())
