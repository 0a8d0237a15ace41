"""Columns by which a logger marks rows that are wrong: told where they change, since only a recipe heeds them."""

from __future__ import annotations

from collections.abc import Collection

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import words_of

_MARKS = frozenset(
    {
        "status", "quality", "qc", "qa", "qf", "flag", "flags", "valid", "validity", "isvalid", "error", "err", "fault",
        "diag", "diagnostic", "statut", "estado", "stato", "qualität", "calidad", "qualité", "gültig", "fehler",
    }
)  # fmt: skip
_OF_WIND = frozenset({"wind", "ws", "wd", "wspd", "wdir", "speed", "dir", "direction", "anemometer", "sensor", "data"})
"""Words beside which a mark is of the wind; beside others it is of a battery, a radio or another quantity."""
_MOST, _SHOWN = 10, 4


def warnings(layout: Layout, *, taken: Collection[int]) -> tuple[str, ...]:
    """A warning for each column of marks that changes in the first rows.

    Args:
        taken: columns that are the time, measured, or heeded as a check.
    """
    found: list[str] = []
    for index, name in enumerate(layout.names):
        words = set(words_of(name))
        if index in taken or not words & _MARKS or not words <= _MARKS | _OF_WIND:
            continue
        kinds = sorted({cell for cell in layout.column(index) if cell})
        if not 2 <= len(kinds) <= _MOST or any("." in kind for kind in kinds if cell_kind(kind) == "number"):
            continue
        shown = ", ".join(kinds[:_SHOWN]) + (", …" if len(kinds) > _SHOWN else "")
        found.append(
            f"column {name!r} ({shown}) may mark rows that are wrong: all are read; a recipe's [[check]] names its "
            "values of rows that are right"
        )
    return tuple(found)
