"""A table on a page (HTML), as a browser saves it, made one of text that every format reads.

Of several tables that with the most rows is taken. What stands above it on the page stays above the table, where a unit
or a zone may be stated.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from html.parser import HTMLParser

from flagdata.errors import LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

LARGEST = 64 * 1024**2
"""Bytes of the largest page that is read."""
_ABOVE = 20
"""Lines of a page above a table that are kept."""
_SILENT = frozenset({"script", "style", "head"})
_STARTS = ("<!doctype html", "<html", "<table")


def matches(lines: Sequence[str]) -> bool:
    """Whether a file begins as a page does."""
    start = "".join(lines[:20]).lstrip("\ufeff \t\r").lower()
    return start.startswith(_STARTS) or (start.startswith("<?xml") and "<html" in start)


def as_table(source: TextFile) -> TableText | None:
    """The longest table of a page; `None` where none has two rows.

    Raises:
        LimitError: the page is larger than `LARGEST`.
    """
    text = "\n".join(source.each_line())
    if len(text) > LARGEST:
        where = str(source.path)
        raise LimitError(f"a page of more than {LARGEST} bytes", where=where, fix="export its table as CSV")
    page = _Page()
    page.feed(text)
    page.close()
    tables = [table for table in page.tables if sum(len(row) > 1 for row in table.rows) > 1]
    if not tables:
        return None
    chosen = max(tables, key=lambda table: len(table.rows))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows([line] for line in chosen.above[-_ABOVE:])
    writer.writerows(chosen.rows)
    found = [Finding(kind="html-table", severity=Severity.NOTE, what="a page (HTML), of which the table is read")]
    if len(tables) > 1:
        what = f"of {len(tables)} tables on the page that with the most rows, {len(chosen.rows)}, is read"
        fix = "save another one as a file of its own to read it"
        found.append(
            Finding(kind="several-tables", severity=Severity.WARNING, count=len(tables), what=what, fix=fix)
        )  # fmt: skip
    return TableText.of(source, out.getvalue().splitlines(), found)


class _Table:
    """The rows of a table, and the text of the page above it."""

    def __init__(self, above: list[str]) -> None:
        self.above = above
        self.rows: list[list[str]] = []


class _Page(HTMLParser):
    """Tables and text of a page; a table within another one is a table of its own."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.tables: list[_Table] = []
        self._open: list[_Table] = []
        self._text: list[str] = []
        self._cell: list[str] | None = None
        self._span = 1
        self._silent = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in _SILENT:
            self._silent += 1
        elif tag == "table":
            self._open.append(_Table(list(self._text)))
            self.tables.append(self._open[-1])
            self._cell = None
        elif tag == "tr" and self._open:
            self._finish()
            self._open[-1].rows.append([])
        elif tag in ("td", "th") and self._open:
            self._finish()
            span = dict(attrs).get("colspan") or "1"
            self._span = min(int(span), 100) if span.isdigit() else 1
            self._cell = []

    def handle_endtag(self, tag: str) -> None:
        if tag in _SILENT:
            self._silent = max(0, self._silent - 1)
        elif tag in ("td", "th", "tr"):
            self._finish()
        elif tag == "table" and self._open:
            self._finish()
            table = self._open.pop()
            table.rows = [row for row in table.rows if row]

    def handle_data(self, data: str) -> None:
        if self._silent:
            return
        if self._cell is not None:
            self._cell.append(data)
        elif not self._open and data.strip():
            self._text.append(" ".join(data.split()))

    def _finish(self) -> None:
        """End the cell that is open."""
        if self._cell is None or not self._open:
            return
        rows = self._open[-1].rows
        if not rows:
            rows.append([])
        rows[-1].extend([" ".join("".join(self._cell).split()), *[""] * (self._span - 1)])
        self._cell = None
