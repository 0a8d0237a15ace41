"""Tables whose columns are named anew further down, as a logger does after its program was changed.

Each heading is of the rows below it: they are put into one table by the names of their columns. A heading that is only
repeated changes nothing, and is no business of this module.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import interest, names_time, understand

_DECIMAL_COMMA = re.compile(r"^([-+]?\d+),(\d+)$")


@dataclass(frozen=True, kw_only=True)
class _Heading:
    """A line that names columns: its number from 1, its delimiter, the names."""

    line: int
    delimiter: str
    names: tuple[str, ...]

    def time(self) -> str:
        """The name of its first column of a time."""
        return next(name for name in self.names if names_time(name))


def matches(lines: Sequence[str]) -> bool:
    """Whether one of the first lines names a time and a wind; whether others do too, the whole file tells."""
    return _first(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The rows below each heading by the names of their columns; `None` where all headings are alike."""

    first = _first(source.head())
    if first is None or not _comes_again(source, first.time()):
        return None
    headings = list(_headings(source, first))
    if all(heading.names == first.names for heading in headings):
        return None
    guesses = recognise(source)
    if guesses and guesses[0].format != "delimited":
        return None
    names = tuple(dict.fromkeys(name for heading in headings for name in heading.names if name))
    short = [0]
    rows = list(_rows(source, headings, names, short))
    if short[0] > len(rows):
        return None
    anew = next(heading.line for heading in headings if heading.names != first.names)
    what = f"lines {first.line} and {anew} name the columns differently: rows by the names above them"
    return table(source, names, rows, kind="headings-anew", what=what, left_out=short[0])


def _first(lines: Sequence[str]) -> _Heading | None:
    for number, line in enumerate(lines, start=1):
        for delimiter in SIGNS:
            names = tuple(cut(line.lstrip("\ufeff"), delimiter))
            if _names_columns(names):
                return _Heading(line=number, delimiter=delimiter, names=names)
    return None


def _names_columns(names: Sequence[str]) -> bool:
    """Whether the cells are the headings of a time, a wind and other columns, each of its own."""
    filled = [name for name in names if name]
    if not 1 < len(filled) <= 200 or len(set(filled)) < len(filled) or not any(map(names_time, filled)):
        return False
    if any(cell_kind(name) in ("number", "stamp") for name in filled):
        return False
    return any(interest(name) == 2 and "wind" in understand(name).quantity for name in filled)


def _comes_again(source: TextFile, name: str) -> bool:
    """Whether a name is in more than one line, told without looking at each line."""
    word, count = name.encode(source.encoding, errors="replace"), 0
    for block in source.raw_blocks():
        count += block.count(word)
        if count > 1:
            return True
    return False


def _headings(source: TextFile, first: _Heading) -> Iterator[_Heading]:
    """The headings of a file from the first on: lines that name columns, its time or another among them."""
    name = first.time()
    for start, lines in source.blocks():
        for number, line in enumerate(lines, start=start):
            if number < first.line or name not in line:
                continue
            names = tuple(cut(line.lstrip("\ufeff"), first.delimiter))
            if name in names and _names_columns(names):
                yield _Heading(line=number, delimiter=first.delimiter, names=names)


def _rows(
    source: TextFile, headings: Sequence[_Heading], names: Sequence[str], short: list[int]
) -> Iterator[list[str]]:
    """Cells in the order of `names`; `short` counts lines that do not have the cells of the heading above them."""
    by_line = {heading.line: heading for heading in headings}
    now: _Heading | None = None
    for start, lines in source.blocks():
        for number, line in enumerate(lines, start=start):
            if number in by_line:
                now = by_line[number]
                continue
            if now is None or not line.strip():
                continue
            cells = cut(line, now.delimiter)
            if len(cells) != len(now.names):
                short[0] += 1
                continue
            if now.delimiter != ",":
                cells = [_DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
            told = dict(zip(now.names, cells, strict=True))
            yield [told.get(name, "") for name in names]
