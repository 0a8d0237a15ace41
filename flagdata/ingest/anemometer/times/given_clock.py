"""The column of instants that is added to a table whose rows carry no time, on the clock that its user gives.

It is no column of the file: no message counts it, and no line that is offered names it.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.text.layout import Layout

HEADING = "time by the clock given"
"""Its heading, which no log writes; it is the last."""
AS_GIVEN = "give --start and --rate as well with each line of --columns, as they were given"
"""What is said beside lines of columns of such a table."""


def headings(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """The headings of the file's own columns with their units, numbers where none has one, and that of the added."""
    named = [name or _numbered(at) for at, name in enumerate(names, start=1)]
    return [*(f"{name} [{unit}]" if unit else name for name, unit in zip(named, units, strict=True)), HEADING]


def index(layout: Layout) -> int | None:
    """The index of the added column; `None` where the file has a time of its own."""
    last = layout.number_of_columns() - 1
    return last if last > 0 and layout.names[last] == HEADING else None


def own_columns(layout: Layout) -> int:
    """How many columns the file itself has."""
    return layout.number_of_columns() - (index(layout) is not None)


def understood(layout: Layout) -> tuple[str, str]:
    """What is told of the file's columns and of their time, of a table with the added column."""
    own = own_columns(layout)
    headed = any(name != _numbered(at) for at, name in enumerate(layout.names[:own], start=1))
    columns = "1 column" if own == 1 else f"{own} columns"
    named = "named by a line above the rows" if headed else "which no line names"
    return f"a table of {columns}, {named}", "the time is counted from the start given, at the rate given"


def _numbered(column: int) -> str:
    """What a column without a heading is called, by its number from 1."""
    return f"column {column}"
