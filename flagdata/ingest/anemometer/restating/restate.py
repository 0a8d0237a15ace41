"""Text that is no table, but says the same in every line, stated again as a table that every format reads.

Each kind is a module with `matches(lines)`, which looks at the first lines, and `as_table(source)`, which makes the
table or returns `None` where the file is of another kind after all. The first of `KINDS` that matches is taken. Those
of `WITHIN` come before and change cells within their lines, each what the one before it left.
"""

from __future__ import annotations

import csv
import io
import string
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from typing import Protocol

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.recipe import Recipe
from flagdata.ingest.anemometer.text.source import TableText, TextFile

WITHIN = (
    "flagdata.ingest.anemometer.restating.percent_encoded",
    "flagdata.ingest.anemometer.restating.east_asian_stamps",
    "flagdata.ingest.anemometer.restating.clock_words",
    "flagdata.ingest.anemometer.restating.twice_told",
    "flagdata.ingest.anemometer.restating.ruled_headings",
    "flagdata.ingest.anemometer.restating.count_lines",
    "flagdata.ingest.anemometer.restating.sentences_in_lines",
)
KINDS = (
    "flagdata.ingest.anemometer.restating.sql_dump",
    "flagdata.ingest.anemometer.restating.expedition",
    "flagdata.ingest.anemometer.restating.metar",
    "flagdata.ingest.anemometer.restating.synop",
    "flagdata.ingest.anemometer.restating.global_hourly",
    "flagdata.ingest.anemometer.restating.isd",
    "flagdata.ingest.anemometer.restating.akterm",
    "flagdata.ingest.anemometer.restating.published",
    "flagdata.ingest.anemometer.restating.pywws",
    "flagdata.ingest.anemometer.restating.hours_across",
    "flagdata.ingest.anemometer.restating.lying",
    "flagdata.ingest.anemometer.restating.smet",
    "flagdata.ingest.anemometer.restating.nead",
    "flagdata.ingest.anemometer.restating.geocsv",
    "flagdata.ingest.anemometer.restating.nasa_ames",
    "flagdata.ingest.anemometer.restating.numbered_columns",
    "flagdata.ingest.anemometer.restating.lvm",
    "flagdata.ingest.anemometer.restating.scintec",
    "flagdata.ingest.anemometer.restating.campbell_arrays",
    "flagdata.ingest.anemometer.restating.clientrawhour",
    "flagdata.ingest.anemometer.restating.noaa_summary",
    "flagdata.ingest.anemometer.restating.station_lines",
    "flagdata.ingest.anemometer.restating.aprs",
    "flagdata.ingest.anemometer.restating.ft",
    "flagdata.ingest.anemometer.restating.thies",
    "flagdata.ingest.anemometer.restating.uploads",
    "flagdata.ingest.anemometer.restating.broken_headings",
    "flagdata.ingest.anemometer.restating.broken_rows",
    "flagdata.ingest.anemometer.restating.line_breaks",
    "flagdata.ingest.anemometer.restating.quoted_commas",
    "flagdata.ingest.anemometer.restating.objects_in_cells",
    "flagdata.ingest.anemometer.restating.trimmed_rows",
    "flagdata.ingest.anemometer.restating.wrapped",
    "flagdata.ingest.anemometer.restating.two_in_a_cell",
    "flagdata.ingest.anemometer.restating.influx",
    "flagdata.ingest.anemometer.restating.line_protocol",
    "flagdata.ingest.anemometer.restating.name_value",
    "flagdata.ingest.anemometer.restating.packed_letters",
    "flagdata.ingest.anemometer.restating.labelled",
    "flagdata.ingest.anemometer.restating.blocks",
    "flagdata.ingest.anemometer.restating.bracketed",
    "flagdata.ingest.anemometer.restating.before_cells",
    "flagdata.ingest.anemometer.restating.listed_fields",
    "flagdata.ingest.anemometer.restating.counted_fields",
    "flagdata.ingest.anemometer.restating.legend",
    "flagdata.ingest.anemometer.restating.blank_cells",
    "flagdata.ingest.anemometer.restating.fixed_width",
    "flagdata.ingest.anemometer.restating.stacked_headings",
    "flagdata.ingest.anemometer.restating.headings_anew",
)
LOOKED_AT = 60
"""Lines by which a kind is told."""
_NOTHING = f"{string.whitespace}\x02\x03"
"""What a line without content may hold: blanks, and the STX and ETX that serial instruments frame their lines with."""


class Kind(Protocol):
    """What each module of `WITHIN` and `KINDS` offers."""

    def matches(self, lines: Sequence[str]) -> bool:
        """Whether the first lines look like this kind."""
        ...

    def as_table(self, source: TextFile) -> TableText | None:
        """The file as a table whose first line names the columns."""
        ...


def restate(source: TextFile, recipe: Recipe | None = None) -> TextFile:
    """The file as a table where it is of a known kind, else as it is.

    Args:
        recipe: that the user names; one whose columns are not those of the table describes the lines as they are.
    """
    for name in WITHIN:
        cells: Kind = import_module(name)  # type: ignore[assignment]
        if cells.matches(source.head(LOOKED_AT)):
            source = cells.as_table(source) or source
    lines = source.head(LOOKED_AT)
    for name in KINDS:
        kind: Kind = import_module(name)  # type: ignore[assignment]
        if kind.matches(lines):
            stated = kind.as_table(source)
            return source if stated is None or not _describes(recipe, stated) else stated
    return source


def _describes(recipe: Recipe | None, stated: TableText) -> bool:
    """Whether a recipe names columns of a table; no recipe leaves the table to be understood."""
    if recipe is None:
        return True
    names = next(csv.reader(stated.head(1)))
    return all(column in names for column in (*recipe.time.columns, *(c.column for c in recipe.channels.values())))


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
