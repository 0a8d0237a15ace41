"""Rows that fill columns which the first lines leave empty, such as a lidar's upper heights in clear air."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout, cut, lay_out
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.winds.missing_codes import CODES
from flagdata.ingest.anemometer.words.headings import interest, understand

_ROWS = 20
"""Rows that are taken for each of these columns."""
_CODES = frozenset({*CODES, *(-code for code in CODES)})


def rows(source: TextFile, lines: Sequence[str]) -> tuple[str, ...]:
    """Later rows in which columns of a quantity hold a value for the first time, of each column a few.

    Args:
        lines: the first of the file; columns that have a value in them need no further rows.
    """
    layout = lay_out(lines, interest=interest)
    if layout is None or not layout.header:
        return ()
    empty, width = _empty(layout, lines)
    if not empty:
        return ()
    if isinstance(source, TableText):
        return _search(source, len(lines), layout.delimiter, empty, width)
    stat = source.path.stat()
    return _kept(_Source(source, stat.st_mtime_ns, stat.st_size), len(lines), layout.delimiter, empty, width)


class _Source:
    """A file, the same as another of this path, time, size and encoding."""

    def __init__(self, source: TextFile, changed: int, size: int) -> None:
        self.source = source
        self._key = (source.path, source.encoding, changed, size)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Source) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=4)
def _kept(source: _Source, known: int, delimiter: str, empty: tuple[int, ...], width: int) -> tuple[str, ...]:
    """See `_search`; each anemometer of a file asks for the same rows."""
    return _search(source.source, known, delimiter, empty, width)


def _search(source: TextFile, known: int, delimiter: str, empty: tuple[int, ...], width: int) -> tuple[str, ...]:
    """Rows of `width` cells beyond the first `known` lines that fill columns which are `empty` till then."""
    found: list[str] = []
    lacking = dict.fromkeys(empty, _ROWS)
    for first, lines in source.blocks():
        for line in lines[known:] if first == 1 else lines:
            cells = cut(line, delimiter)
            if len(cells) != width:
                continue
            filled = [index for index in lacking if cells[index] and not _missing(cells[index])]
            if not filled:
                continue
            found.append(line)
            lacking = {index: left - (index in filled) for index, left in lacking.items() if left > (index in filled)}
            if not lacking:
                return tuple(found)
    return tuple(found)


def _empty(layout: Layout, lines: Sequence[str]) -> tuple[tuple[int, ...], int]:
    """The columns whose heading names a quantity and whose first cells hold no value, and the cells of a row."""
    names = cut(lines[layout.preamble].lstrip("\ufeff"), layout.delimiter)
    table = [cut(lines[number - 1], layout.delimiter) for number in layout.lines]
    width = Counter(map(len, table)).most_common(1)[0][0]
    if len(names) != width:
        return (), width
    held = [cells for cells in table if len(cells) == width]
    empty = (at for at, name in enumerate(names) if understand(name).quantity or interest(name))
    return tuple(at for at in empty if all(_missing(cells[at]) for cells in held)), width


@lru_cache(maxsize=1024)
def _missing(cell: str) -> bool:
    """Whether a cell holds no value, or a code for none."""
    kind = cell_kind(cell)
    if kind != "number":
        return kind == "missing"
    try:
        return float(cell.replace(",", ".")) in _CODES
    except ValueError:  # with its unit behind it
        return False
