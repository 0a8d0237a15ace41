"""Lines of an instrument as a table of text, for a draft of what stands before them."""

from __future__ import annotations

import csv
import io
import string
from collections.abc import Callable, Iterable, Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_NOTHING = f"{string.whitespace}\x02\x03"


def rows_of(source: TextFile, row: Callable[[str], list[str] | None]) -> tuple[list[list[str]], int]:
    """The cells of each line that `row` knows, and how many lines with something in them it does not."""
    found: list[list[str]] = []
    other = 0
    for _, lines in source.blocks():
        for line in lines:
            cells = row(line)
            if cells is not None:
                found.append(cells)
            elif line.strip(_NOTHING):
                other += 1
    return found, other


def table(
    source: TextFile, names: Sequence[str], rows: Iterable[Sequence[str]], *, kind: str, what: str, left_out: int = 0
) -> TableText | None:
    """Rows as a table with its names in the first line; `None` where there is no row.

    Args:
        kind: of the finding that says so.
        what: what the file is, for that finding.
        left_out: lines that hold none of it.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows)
    lines = tuple(out.getvalue().splitlines())
    if len(lines) < 2:
        return None
    text = f"{what}, read as a table of {len(names)} columns; lines are counted with its heading as the first"
    found = [Finding(kind=kind, severity=Severity.NOTE, what=text)]
    if left_out:
        text = f"{left_out} lines are of another kind; left out"
        found.append(Finding(kind="malformed-lines", severity=Severity.WARNING, count=left_out, what=text))
    return TableText.of(source, lines, found)
