"""Units that a column spells in every row, beside the numbers they are of."""

from __future__ import annotations

from flagdata.ingest.anemometer.text.kinds import is_unit
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.units import spelled


def mixed_units(layout: Layout, index: int) -> tuple[str, ...]:
    """The units that the column next to a column of numbers spells, where they change from row to row."""
    if index + 1 >= layout.number_of_columns():
        return ()
    cells = sorted({cell for cell in layout.column(index + 1) if cell})
    names = {spelled(cell) for cell in cells[:50]}
    of_others = all(spelled(cell) is not None or is_unit(cell) for cell in cells[:50])
    return tuple(cells) if len(names) > 1 and names != {None} and of_others else ()
