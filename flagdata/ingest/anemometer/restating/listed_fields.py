"""Tables whose columns are named above them one a line, by their numbers, and by no heading.

     1. Year
     2. Month
    Column 3: Wind speed (m/s) at 40 m
    2026,5,2.31

The list names the columns where it counts from 1 to as many as a row has cells.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.text.layout import lay_out
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import interest

_FIELD = re.compile(
    r"\W*(?:(?:col(?:umn)?|field|spalte|colonne|columna|coluna|campo|feld)\b\.?)?\s*#?(?P<number>\d{1,3})\s*[.):=-]\s+"
    r"(?P<name>\S*[^\W\d_].*?)[\s,;\t]*",
    re.IGNORECASE,
)
_LEAST = 3
"""Fields from which lines that count are a list of them."""


def matches(lines: Sequence[str]) -> bool:
    """Whether lines count fields from 1 on."""
    return len(_fields(lines)[0]) >= _LEAST


def as_table(source: TextFile) -> TableText | None:
    """The file with a heading of the list's names above its first row.

    `None` where the rows have other columns, or a heading of their own.
    """
    lines = source.head(HEAD_LINES)
    names, end = _fields(lines)
    layout = lay_out(lines[end:], interest=interest)
    if layout is None or len(names) != layout.number_of_columns():
        return None
    if layout.header and any(map(interest, layout.names)):
        return None
    first = end + layout.lines[0]
    out = io.StringIO()
    csv.writer(out, delimiter=layout.delimiter, quoting=csv.QUOTE_ALL, lineterminator="").writerow(names)
    text = list(source.each_line())
    # The list and what stands around it are no part of the table, but may state its zone.
    above = [f"# {line}" if line.strip() else line for line in text[: first - 1]]
    empty = bool(above) and not re.sub(r"[#\s,;|]", "", above[-1])
    above = above[:-1] if empty else above
    counted = "" if empty else "; lines are counted with this heading before the first row"
    what = f"line {first} begins a table whose {len(names)} columns a list above it names{counted}"
    found = Finding(kind="fields-listed", severity=Severity.NOTE, what=what)
    return TableText.of(source, (*above, out.getvalue(), *text[first - 1 :]), [found])


def _fields(lines: Sequence[str]) -> tuple[list[str], int]:
    """The names of fields that lines count from 1 on, until another number comes, and the number of the last line."""
    found: list[str] = []
    last = 0
    for number, line in enumerate(lines, start=1):
        match = _FIELD.fullmatch(line.strip().strip('"'))
        if match is None:
            continue
        if int(match["number"]) != len(found) + 1:
            break
        found.append(match["name"].strip())
        last = number
    return found, last
