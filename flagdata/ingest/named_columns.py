"""Small tables with columns of our own names: how their text is cut, and whether all columns are
there."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.files.plain_text import encoding_of
from flagdata.errors import InputError, UnknownNameError

DELIMITERS = (",", ";", "\t")
_SEP = "sep="
_COMMA, _POINT = (
    re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?"),
    re.compile(r"[-+]?\d*\.\d+([eE][-+]?\d+)?"),
)
_HEAD = 1 << 16
"""Bytes of a table that a look at it takes."""


def delimiter_of(heading: str) -> str:
    """Finds the one of `DELIMITERS` that stands most often in a heading."""
    return max(DELIMITERS, key=heading.count)


@dataclass(frozen=True, kw_only=True)
class SmallTable:
    """The cells of a table, trimmed.

    Attributes:
        line: of the heading.
        delimiter: between them.
        names: of the columns; empty headings at the end, which a spreadsheet leaves, are none.
        rows: number of the line and cells of each row that has any.
    """

    line: int
    delimiter: str
    names: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    @property
    def decimal_commas(self) -> bool:
        """Whether its numbers have decimal commas, as those of a spreadsheet that writes ";"; none
        has a point."""
        cells = [cell for _, row in self.rows for cell in row]
        return (
            self.delimiter != ","
            and any(map(_COMMA.fullmatch, cells))
            and not any(map(_POINT.fullmatch, cells))
        )

    def number(self, cell: str) -> str:
        """Writes a cell with the decimal point of programs."""
        return cell.replace(",", ".") if self.delimiter != "," and _COMMA.fullmatch(cell) else cell


def small_table(text: str, *, where: str) -> SmallTable:
    """Reads the table in a text: CSV with commas, semicolons or tabs, which a first line "sep=;"
    may name.

    Raises:
        InputError: quotes that do not close, and the like.
    """
    return _cut(text.splitlines(), where, strict=True)


def _cut(lines: Sequence[str], where: str, *, strict: bool) -> SmallTable:
    names_delimiter = int(
        bool(lines) and len(lines[0]) == len(_SEP) + 1 and lines[0].lower().startswith(_SEP)
    )
    delimiter = (
        lines[0][len(_SEP) :] if names_delimiter else delimiter_of(lines[0] if lines else "")
    )
    reader = csv.reader(lines[names_delimiter:], delimiter=delimiter, strict=strict)
    try:
        rows = [
            (reader.line_num + names_delimiter, tuple(cell.strip() for cell in row))
            for row in reader
        ]
    except csv.Error as error:
        line = f"{where}, line {reader.line_num + names_delimiter}"
        raise InputError(
            f"this is not a table: {error}", where=line, fix="export it anew"
        ) from None
    (line, names), *rows = rows or [(1, ())]
    while names and not names[-1]:
        names = names[:-1]
    filled = ((at, _without_blank_end(cells, len(names))) for at, cells in rows if any(cells))
    return SmallTable(line=line, delimiter=delimiter, names=names, rows=tuple(filled))


def small_table_head(path: Path) -> SmallTable:
    """Reads the heading and first rows of a table of any length, for a look at it: what is damaged
    is replaced.

    Raises:
        InputError: it is no text.
    """
    with path.open("rb") as stream:
        head = stream.read(_HEAD)
    text = (
        head.decode(encoding_of(head), errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    )
    whole_lines = text if len(head) < _HEAD else text[: text.rfind("\n") + 1]
    return _cut(whole_lines.splitlines(), str(path), strict=False)


def _without_blank_end(cells: tuple[str, ...], width: int) -> tuple[str, ...]:
    return cells[:width] if not any(cells[width:]) else cells


def check_columns(
    names: Sequence[str], *, needed: Sequence[str], optional: Sequence[str], where: str, fix: str
) -> None:
    """Make sure that a heading has the columns that are needed, and none that is not known.

    Args:
        fix: said of columns that are missing or doubled.

    Raises:
        UnknownNameError: a column that is none of these.
        InputError: a column that is missing, or there twice.
    """
    for name in names:
        if name not in (*needed, *optional):
            raise UnknownNameError.of("column", name, [*needed, *optional], where=where)
    missing = [name for name in needed if name not in names]
    if missing or len(set(names)) < len(names):
        message = f"columns missing: {', '.join(missing)}" if missing else "a column is there twice"
        raise InputError(message, where=where, fix=fix)
