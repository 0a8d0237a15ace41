"""Tables with one value a row and its name beside it ("sensor.wind_speed,4.2,2026-05-01T12:00:00Z"), as exports have.

Each name of a speed of wind is an anemometer of its own; a direction in rows of its own has other instants, and is left
out.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.headings import fits, understand, words_of
from flagdata.ingest.anemometer.instruments import SPEEDS, Column, Wind
from flagdata.ingest.anemometer.layout import Layout, cell_kind

_VALUES = frozenset({"value", "val", "state", "payload", "reading", "measurement", "wert"})
_MOST = 500
"""Names of quantities beyond which a column of words is something else."""


def winds_by_name(layout: Layout, *, time: Sequence[int], told: str | None) -> tuple[Wind, ...]:
    """The anemometers of a table of names and values; none where it is no such table.

    Args:
        time: columns that are the time.
        told: unit of the wind by the user's word, for names that state none.
    """
    rest = [index for index in range(layout.number_of_columns()) if index not in time]
    values = [
        index for index in rest if _most(layout, index, "number") and not understand(layout.names[index]).quantity
    ]
    told_values = [index for index in values if set(words_of(layout.names[index])) & _VALUES]
    values = told_values if len(told_values) == 1 else values
    for column in rest:
        cells = layout.column(column)
        names = sorted({cell for cell in cells if cell_kind(cell) == "text"})
        if len(values) != 1 or not 0 < len(names) <= _MOST or not _most(layout, column, "text"):
            continue
        found: list[Wind] = []
        for name in names:
            heading = understand(name)
            if heading.channel not in SPEEDS or not heading.sure:
                continue
            stated = heading.unit if fits(heading.channel, heading.unit) else None
            how = f"in {stated} by its name" if stated else f"in {told}, as you said" if told else ""
            speed = Column(index=values[0], unit=stated or told, told=how)
            found.append(Wind(
                label=name, height=heading.height, columns={heading.channel: speed}, sure=True, site=(column, name),
            ))  # fmt: skip
        if found:
            return tuple(found)
    return ()


def _most(layout: Layout, index: int, kind: str) -> bool:
    kinds = [cell_kind(cell) for cell in layout.column(index)]
    known = [found for found in kinds if found != "missing"]
    return bool(known) and sum(found == kind for found in known) >= 0.9 * len(known)
