"""Lines cut into cells, with the number of each row's line and a count of the lines that do not
fit."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from flagdata.ingest.anemometer.sensor_recipe import FileLayout
from flagdata.ingest.anemometer.text.columns import Columns, Lines, LineShape, lines_of, shape_of
from flagdata.ingest.anemometer.text.text_file import TextFile

_PLAIN = ("utf-8", "utf-8-sig", "latin-1")
"""Encodings in which a byte of ASCII is that character wherever it stands."""
_BLANK_CELL = re.compile(r'"([^"]*)"|([^\s"]+)')


class RowReader:
    """Reads header and rows of a delimited text once, in blocks.

    Args:
        source: the file.
        layout: how it is cut.

    Raises:
        InputError: the file ends before its header does.
    """

    def __init__(self, source: TextFile, layout: FileLayout) -> None:
        self._source = source
        self._layout = layout
        self._malformed: list[int] = []
        self._read = 0
        self._last_malformed = False
        head = source.head(layout.preamble + layout.header + 1)
        if len(head) < layout.preamble + layout.header:
            raise InputError(
                f"the file ends in line {len(head)}, before its header does",
                where=str(source.path),
                fix="check the recipe's preamble and header, or copy the file from the logger "
                "again",
            )
        self.first_line = layout.preamble + layout.header + 1
        self.shift = 0
        self.header: list[str] | None = None
        self._headed = 0
        if layout.header:
            names = head[layout.preamble].lstrip("\ufeff")
            self.header = [cell.strip() for cell in cells_of_lines([names], layout.delimiter)[0]]
            row = cells_of_lines(head[layout.preamble + layout.header :], layout.delimiter)
            used = (
                max((at for at, cell in enumerate(row[0], start=1) if cell.strip()), default=0)
                if row
                else 0
            )
            self._headed = len(self.header)
            while len(self.header) > max(1, used) and not self.header[-1]:
                self.header.pop()

    def blocks(self, width: int) -> Iterator[tuple[IntArray, Columns | list[list[str]]]]:
        """Yields line numbers and rows of at least `width` cells; with a header, of as many cells
        as it names.

        Empty cells beyond (delimiters at the line's end) are allowed. Where the encoding lets bytes
        be cut, regular
        lines come as columns: see `columns`.
        """
        delimiter = self._layout.delimiter
        plain = (
            self._source.encoding in _PLAIN
            and len(delimiter) == 1
            and delimiter.isascii()
            and delimiter != " "
        )
        return self._columns(width) if plain and delimiter != '"' else self.rows(width)

    def rows(self, width: int) -> Iterator[tuple[IntArray, list[list[str]]]]:
        """Yields what `blocks` gives, row by row: its definition."""
        for first, lines in self._source.blocks():
            where, good = self._cut_and_sort(list(range(first, first + len(lines))), lines, width)
            if good:
                yield where, good

    def _cut_and_sort(
        self, numbers: Sequence[int], lines: Sequence[str], width: int
    ) -> tuple[IntArray, list[list[str]]]:
        """Cuts these lines into rows and keeps those that fit, with their numbers; the others are
        counted."""
        names = len(self.header) if self.header is not None else None
        comment = self._layout.comment
        numbers_kept: list[int] = []
        lines_kept: list[str] = []
        for number, line in zip(numbers, lines, strict=True):
            if number < self.first_line or not line.strip(" \t\x00\x1a"):
                continue
            if comment and line.startswith(comment):
                continue
            if width > 1 and _is_mark(line, self._layout.delimiter):
                continue
            numbers_kept.append(number)
            lines_kept.append(line)
        good: list[list[str]] = []
        where: list[int] = []
        for number, row in zip(
            numbers_kept, cells_of_lines(lines_kept, self._layout.delimiter), strict=True
        ):
            size = len(row)
            # Cells below the empty headings at the end, which hold something in some rows only,
            # shift no others.
            fits = names is None or size in (names, self._headed) or _only_empty_beyond(row, names)
            if fits and size >= width:
                good.append(row)
                where.append(number)
            else:
                self._malformed.append(number)
        self._read += len(good)
        if numbers_kept:
            self._last_malformed = bool(self._malformed) and self._malformed[-1] == numbers_kept[-1]
        return np.array(where, dtype=np.int64), good

    def _columns(self, width: int) -> Iterator[tuple[IntArray, Columns | list[list[str]]]]:
        encoding = "utf-8" if self._source.encoding == "utf-8-sig" else self._source.encoding
        first, shape = 1, None
        for data in self._source.raw_blocks():
            shape = shape or self._shape(data)
            lines = lines_of(data, shape) if shape is not None and shape.cells >= width else None
            if lines is None:
                with io.TextIOWrapper(io.BytesIO(data), encoding=encoding, newline=None) as stream:
                    texts = [line.rstrip("\n") for line in stream]
                where, good = self._cut_and_sort(range(first, first + len(texts)), texts, width)
                if good:
                    yield where, good
                first += len(texts)
                continue
            where, columns = self._of_lines(lines, first, width, encoding)
            if len(where):
                yield where, columns
            first += len(lines.start)

    def _shape(self, data: bytes) -> LineShape | None:
        """Finds the shape of the file's regular lines by its first row; `None` where the block has
        no row."""
        at = -1
        for _ in range(self.first_line - 1):
            at = data.find(b"\n", at + 1)
            if at < 0:
                return None
        line = data[at + 1 :].partition(b"\n")[0].rstrip(b"\r")
        names = len(self.header) if self.header is not None else None
        return shape_of(
            line,
            delimiter=self._layout.delimiter,
            names=names,
            comment=self._layout.comment,
            ascii_only=self._source.encoding == "latin-1",
        )

    def _of_lines(
        self, lines: Lines, first: int, width: int, encoding: str
    ) -> tuple[IntArray, Columns]:
        """Reads the rows of a block whose first line has the number `first`."""
        number = first + np.arange(len(lines.start), dtype=np.int64)
        lines = replace(lines, regular=lines.regular & (number >= self.first_line))
        regular, irregular = number[lines.regular], number[~lines.regular]
        columns = lines.columns(width)
        before = self._last_malformed
        texts = [lines.text(at, encoding) for at in (irregular - first).tolist()]
        where, good = self._cut_and_sort(irregular.tolist(), texts, width)
        self._read += len(regular)
        if len(regular) and (not self._malformed or self._malformed[-1] < regular[-1]):
            self._last_malformed = False
        elif not len(irregular):
            self._last_malformed = before
        if not good:
            return regular, columns
        order = np.argsort(np.concatenate((regular, where)), kind="stable")
        return np.sort(np.concatenate((regular, where))), columns.with_rows(good, order)

    def findings(self) -> tuple[Finding, ...]:
        """Reports what did not fit; complete when `blocks` has been read.

        Raises:
            InputError: most lines do not fit.
        """
        findings: list[Finding] = []
        malformed = list(self._malformed)
        if len(malformed) > self._read and len(malformed) > 1:
            raise InputError(
                f"{len(malformed)} of {len(malformed) + self._read} lines have another number of "
                "columns than expected",
                where=f"{self._source.path}, line {malformed[0]}",
                fix="check delimiter and header of the recipe",
            )
        if self._last_malformed and malformed:
            last = malformed.pop()
            findings.append(
                Finding.of(
                    "cut-off",
                    "the last line is incomplete, as when the logger lost power; left out",
                    where=f"line {last}",
                )
            )
        if malformed:
            findings.append(
                Finding(
                    kind="malformed-lines",
                    severity=Severity.ERROR,
                    count=len(malformed),
                    where=f"line {malformed[0]}",
                    what=f"{len(malformed)} lines with another number of columns than the header; "
                    "left out",
                )
            )
        return tuple(findings)


def _is_mark(line: str, delimiter: str) -> bool:
    """Checks whether a line is one word without letters and digits: a ruler, or "***" where a file
    ends."""
    words = line.split()
    return (
        len(words) == 1
        and delimiter not in words[0]
        and not any(sign.isalnum() for sign in words[0])
    )


def blank_cells(line: str) -> list[str]:
    """Cells divided by runs of blanks, or by a comma and blanks; quotes bind where they are
    closed."""
    if '"' not in line or line.count('"') % 2:
        return line.replace(", ", " ").split()
    return [quoted or plain for quoted, plain in _BLANK_CELL.findall(line)]


def has_open_quote(line: str, delimiter: str) -> bool:
    """Checks whether a quote begins a cell and is not closed; one within a cell that has none
    before it is a sign (0.01")."""
    if line.count('"') % 2 == 0:
        return False
    cell, rest = re.escape(delimiter), line
    while (quoted := re.search(rf'(?:^|{cell})\s*"', rest)) is not None:
        end = re.search(rf'(?<!")(?:"")*"\s*(?:{cell}|$)', rest[quoted.end() :])
        if end is None:
            return True
        rest = (
            rest[quoted.end() + end.end() - len(delimiter) :] if end[0].endswith(delimiter) else ""
        )
    return False


def _only_empty_beyond(row: Sequence[str], names: int) -> bool:
    return len(row) > names and not any(cell.strip() for cell in row[names:])


def cells_of_lines(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Cuts each line into cells. Quotes bind within a line; a line with a quote that is not closed
    becomes one cell."""
    if delimiter == " ":
        return [blank_cells(line) for line in lines]
    if not any('"' in line for line in lines):
        return [line.split(delimiter) for line in lines]
    closed = ["" if has_open_quote(line, delimiter) else line for line in lines]
    rows = list(csv.reader(closed, delimiter=delimiter))
    return [
        row if is_closed else [line]
        for row, is_closed, line in zip(rows, closed, lines, strict=True)
    ]
