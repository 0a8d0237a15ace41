"""Tables with a heading whose quotes hold a line break: the lines between are one.

Spreadsheets write a cell of several lines so. Only the first lines are looked at: in rows a quote that is not closed is
damage, and stays one.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.text.rows import has_open_quote
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_MOST = 10
"""Lines of the longest heading."""


def matches(lines: Sequence[str]) -> bool:
    """Whether one of the first lines opens a quote that a later one of them closes."""
    return _span(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The file with the lines of the heading in one."""
    span = _span(source.head())
    if span is None:
        return None
    first, last = span
    lines = list(source.each_line())
    heading = " ".join(line.strip() for line in lines[first : last + 1])
    return TableText.of(source, [*lines[:first], heading, *lines[last + 1 :]])


def _span(lines: Sequence[str]) -> tuple[int, int] | None:
    """The first and the last of the lines that a quote spans."""
    odd = [at for at, line in enumerate(lines[:_MOST]) if line.count('"') % 2]
    if len(odd) != 2 or any(line.count('"') % 2 for line in lines[_MOST:]):
        return None
    return (odd[0], odd[1]) if any(has_open_quote(lines[odd[0]], sign) for sign in SIGNS) else None
