"""Tables with rows whose quotes hold line breaks, as spreadsheets and R write cells of several lines: each row in one.

A quote that is not closed is damage elsewhere, and would take all rows below it in. So lines are put together only
where that gives a row with as many cells as the others have; others stay as they are.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence

from flagdata.ingest.anemometer.text.rows import has_open_quote
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LONGEST = 10
"""Lines of a row."""
_SEVERAL, _CELLS = 2, 3
"""Rows that must be broken, and cells that each must have."""


def matches(lines: Sequence[str]) -> bool:
    """Whether several of the first rows go over lines, and have the cells of the first line then."""
    return _sign(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The rows, each in one line."""
    lines = list(source.each_line())
    sign = _sign(source.head())
    return None if sign is None else TableText.of(source, list(_whole(lines, sign, _width(lines[0], sign))))


def _sign(lines: Sequence[str]) -> str | None:
    """The sign that divides the cells of rows which go over lines; `None` where there are none."""
    for sign in SIGNS:
        width = _width(lines[0], sign) if lines else 0
        if width < _CELLS or has_open_quote(lines[0], sign):
            continue
        whole = list(_whole(lines, sign, width))
        joined, damaged = len(lines) - len(whole), sum(has_open_quote(line, sign) for line in whole[:-_LONGEST])
        if joined >= _SEVERAL and 2 * damaged < joined:
            return sign
    return None


def _whole(lines: Iterable[str], sign: str, width: int) -> Iterator[str]:
    """The lines, of which those that make a row of `width` cells together are one."""
    held: list[str] = []
    for line in lines:
        if held and not has_open_quote(line, sign) and _width(line, sign) == width:
            yield from held  # a row of its own: the quote above it was damage
            held = []
        if not held and not has_open_quote(line, sign):
            yield line
            continue
        held.append(line)
        joined = " ".join(part.strip() for part in held)
        if not has_open_quote(joined, sign) and _width(joined, sign) == width:
            yield joined
            held = []
        elif len(held) >= _LONGEST:
            yield from held
            held = []
    yield from held


def _width(line: str, sign: str) -> int:
    return len(next(csv.reader([line], delimiter=sign), []))
