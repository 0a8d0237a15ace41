"""Units that a column spells in every row, beside the numbers they are of."""

from __future__ import annotations

from flagdata.ingest.anemometer.text.kinds import are_units
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.units import spelled


def mixed_units(layout: Layout, index: int) -> tuple[str, ...]:
    """The units that the column next to a column of numbers spells, where they change from row to row."""
    if index + 1 >= layout.number_of_columns():
        return ()
    cells = sorted({cell for cell in layout.column(index + 1) if cell})
    looked_at = cells[:50]
    several = len({spelled(cell) for cell in looked_at}) > 1
    return tuple(cells) if several and are_units(looked_at) else ()
