"""Columns that are read for nothing and that no other message speaks of: named, so that none is dropped unsaid."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds.found import Wind

_MOST = 40
"""Columns that are named; of more, the number."""


def remark(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind], said: Collection[str]) -> tuple[str, ...]:
    """One remark with the names of the columns that are not read; none where all are read, told already or empty.

    Args:
        winds: all of the table, those that are not chosen too.
        said: messages about columns; a column whose quoted name is in one of them is not named again.
    """
    found = not_told(layout, time, winds, said)
    if not found:
        return ()
    names = listed(layout, found, most=_MOST)
    return (f"columns {names} are not read" if len(found) > 1 else f"column {names} is not read",)


def not_told(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind], said: Collection[str]) -> list[int]:
    """The columns that hold something, are read for nothing, and whose quoted name no message has."""
    taken = {column.index for one in winds for column in one.columns.values()}
    taken |= set(time.columns) if time is not None else set()
    taken |= {index for index in layout.unit_columns if index is not None}
    taken |= {one.site[0] for one in winds if one.site is not None}
    return [
        index
        for index in range(len(layout.names))
        if index not in taken
        and not any(_quoted(layout, index) in message for message in said)
        and any(cell_kind(cell) != "missing" for cell in layout.column(index))
    ]


def listed(layout: Layout, indices: Sequence[int], *, most: int) -> str:
    """The names of columns, quoted, up to so many; of more, the number."""
    names = ", ".join(_quoted(layout, index) for index in indices[:most])
    return f"{names} and {len(indices) - most} more" if len(indices) > most else names


def _quoted(layout: Layout, index: int) -> str:
    name = layout.names[index]
    if not name:
        return f"number {index + 1}"
    return repr(f"{name}#{index + 1}" if layout.names.count(name) > 1 else name)
