"""Which of a database's tables is the log of a wind, and what is said of the others."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.words.headings import names_time, understand


def holds_wind(called: str, names: Sequence[str], row: Sequence[object]) -> bool:
    """Whether a table has a time, by a name or the cells of a row, and a wind, by the name of a column or its own."""
    wind = "wind" in called.lower() or any("wind" in understand(name).quantity for name in names)
    stamped = any(isinstance(cell, str) and cell_kind(cell) == "stamp" for cell in row)
    return wind and (stamped or any(map(names_time, names)))


def others_left_out(chosen: str, winds: Sequence[str], *, fix: str) -> tuple[Finding, ...]:
    """The warning that of several tables with a wind the longest is read; none where there is one."""
    others = ", ".join(repr(name) for name in winds if name != chosen)
    if not others:
        return ()
    what = f"of {len(winds)} tables with a wind {chosen!r} is read, the longest; not {others}"
    return (Finding(kind="several-tables", severity=Severity.WARNING, count=len(winds), what=what, fix=fix),)
