"""Delimited text cut into columns by Arrow, block by block: what `rows` says of lines, without a
Python object a cell.

A line is regular when its bytes alone show its cells: as many delimiters as the others have, quotes
that begin and end cells and hold no delimiter, no NUL and no line end but its own. Arrow reads
those. All other lines (damaged, blank, commented, quoted within a cell) go the way of `rows`, which
defines what they are. Both give the same, which is tested.
"""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import codecs
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.arrays import BoolArray, IntArray, UInt8Array
from flagdata.core.files.buffers import own_copy

_LF, _CR, _QUOTE = 10, 13, 34


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Cells of a block of rows, by column.

    Attributes:
        cells: of each column, counted from 0, (n,) text as written, without its quotes.
    """

    cells: Sequence[pa.StringArray]

    def __len__(self) -> int:
        return len(self.cells[0])

    def column(self, index: int) -> pa.StringArray:
        """Returns the cells of one column."""
        return self.cells[index]

    def joined(self, indices: Sequence[int]) -> pa.StringArray:
        """Joins the cells of several columns of each row, trimmed, with a blank between."""
        return pc.binary_join_element_wise(
            *(pc.utf8_trim_whitespace(self.cells[i]) for i in indices), " "
        )

    def among(self, index: int, values: Sequence[str]) -> BoolArray:
        """Checks (n,) whether the trimmed cells of a column are among `values`."""
        is_among = pc.is_in(
            pc.utf8_trim_whitespace(self.cells[index]), pa.array(list(values), pa.string())
        )
        return is_among.to_numpy(zero_copy_only=False).astype(bool)

    def where(self, wanted: BoolArray) -> Columns:
        """Selects the rows that are wanted (n,)."""
        mask = pa.array(wanted)
        return Columns(cells=[cells.filter(mask) for cells in self.cells])

    def with_rows(self, rows: Sequence[Sequence[str]], order: IntArray) -> Columns:
        """Returns these rows and then `rows`, all in the `order` of indices given (n,)."""
        further = [pa.array([row[i] for row in rows], pa.string()) for i in range(len(self.cells))]
        return Columns(
            cells=[
                pa.concat_arrays([own, new]).take(pa.array(order))
                for own, new in zip(self.cells, further, strict=True)
            ]
        )


@dataclass(frozen=True, kw_only=True)
class LineShape:
    """What a regular line looks like.

    Attributes:
        delimiter: one byte.
        cells: in a line.
        empty: how many of them are empty at the end of the line, beyond those that the header
            names.
        comment: first byte of lines that may be comments, `None` where there are none.
        ascii: whether a line with a byte beyond ASCII is irregular.
    """

    delimiter: int
    cells: int
    empty: int
    comment: int | None
    ascii: bool


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Lines of a block of bytes.

    Attributes:
        data: the block.
        start: (n,) where each begins.
        end: (n,) where each ends, before its line end.
        regular: (n,) see the module's text.
        shape: of regular lines.
    """

    data: bytes
    start: IntArray
    end: IntArray
    regular: BoolArray
    shape: LineShape

    def text(self, index: int, encoding: str) -> str:
        """Decodes a line as text."""
        return self.data[self.start[index] : self.end[index]].decode(encoding)

    def columns(self, count: int) -> Columns:
        """Returns the first `count` columns of the regular lines."""
        from pyarrow import csv

        regular = self._regular_bytes()
        names = [str(i) for i in range(self.shape.cells)]
        if not regular:
            return Columns(cells=[pa.array([], pa.string()) for _ in range(count)])
        table = csv.read_csv(
            pa.BufferReader(own_copy(regular)),
            read_options=csv.ReadOptions(
                use_threads=False, block_size=len(regular) + 1, column_names=names
            ),
            parse_options=csv.ParseOptions(
                delimiter=chr(self.shape.delimiter), ignore_empty_lines=False
            ),
            convert_options=csv.ConvertOptions(
                check_utf8=False,
                column_types=dict.fromkeys(names[:count], pa.string()),
                include_columns=names[:count],
                strings_can_be_null=False,
                quoted_strings_can_be_null=False,
            ),
        )
        return Columns(cells=[table.column(i).combine_chunks() for i in range(count)])

    def _regular_bytes(self) -> bytes:
        """Joins the bytes of the regular lines."""
        if self.regular.all():
            return self.data
        edges = np.diff(np.concatenate(([0], self.regular.astype(np.int8), [0])))
        begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        bounds = np.append(self.start, len(self.data))
        return b"".join(
            self.data[bounds[low] : bounds[high]] for low, high in zip(begins, ends, strict=True)
        )


def shape_of(
    line: bytes, *, delimiter: str, names: int | None, comment: str | None, ascii_only: bool
) -> LineShape:
    """Finds the shape of a file of which `line` is a row and whose header names `names` cells, if
    it has one."""
    mark = ord(delimiter)
    cells = line.count(mark) + 1
    beyond = cells - names if names is not None else 0
    empty = beyond if beyond > 0 and line.endswith(beyond * delimiter.encode()) else 0
    return LineShape(
        delimiter=mark,
        cells=cells if names is None or empty else names,
        empty=empty,
        comment=comment.encode()[0] if comment else None,
        ascii=ascii_only,
    )


def lines_of(data: bytes, shape: LineShape) -> Lines | None:
    """Splits a block that ends with a line end or with the file into lines; `None` where that takes
    a closer look.

    It does where a CR alone ends a line, and where Arrow would take a cell's first character for a
    byte-order mark.
    """
    byte = np.frombuffer(data, dtype=np.uint8)
    feeds = np.flatnonzero(byte == _LF)
    if len(byte) and byte[-1] != _LF:
        feeds = np.append(feeds, len(byte))
    start = (
        np.concatenate(([0], feeds[:-1] + 1)).astype(np.int64)
        if len(feeds)
        else np.zeros(0, dtype=np.int64)
    )
    returned = (byte[np.maximum(feeds - 1, 0)] == _CR) & (feeds > start)
    if data.count(_CR) != int(returned.sum()) or codecs.BOM_UTF8 in data:
        return None
    end = feeds - returned
    marks = np.flatnonzero(byte == shape.delimiter)
    on = np.searchsorted(feeds, marks)
    regular = np.bincount(on, minlength=len(feeds)) == shape.cells - 1
    regular &= ~_with(data, byte, feeds, start, shape)
    for back in range(1, shape.empty + 1):
        regular &= (end - back >= start) & (byte[np.maximum(end - back, 0)] == shape.delimiter)
    if shape.comment is not None and len(byte):
        regular &= byte[np.minimum(start, len(byte) - 1)] != shape.comment
    quotes = np.flatnonzero(byte == _QUOTE)
    if len(quotes):
        regular &= ~_misquoted_lines(byte, feeds, quotes, marks, on, shape.delimiter)
    return Lines(data=data, start=start, end=end, regular=regular, shape=shape)


def _with(
    data: bytes, byte: UInt8Array, feeds: IntArray, start: IntArray, shape: LineShape
) -> BoolArray:
    """Lines that hold nothing but blanks, or a byte that has to be looked at: NUL, Ctrl-Z, beyond
    ASCII."""
    odd_lines = np.zeros(len(feeds), dtype=bool)
    odd = (byte == 0) | (byte == 0x1A) if 0 in data or b"\x1a" in data else None
    if shape.ascii and not data.isascii():
        odd = byte > 0x7F if odd is None else odd | (byte > 0x7F)
    if odd is not None:
        odd_lines[np.searchsorted(feeds, np.flatnonzero(odd))] = True
    if shape.delimiter <= 32 and len(start):
        odd_lines |= np.add.reduceat((byte > 32).astype(np.int64), start) == 0
    return odd_lines


def _misquoted_lines(
    byte: UInt8Array,
    feeds: IntArray,
    quotes: IntArray,
    marks: IntArray,
    on: IntArray,
    delimiter: int,
) -> BoolArray:
    """Lines with a quote that neither begins nor ends a cell, with one too many, or with a
    delimiter between two."""
    line = np.searchsorted(feeds, quotes)
    count = np.bincount(line, minlength=len(feeds))
    first = np.concatenate(([0], np.cumsum(count)))
    opens = (np.arange(len(quotes)) - first[line]) % 2 == 0
    around = np.concatenate(([_LF], byte, [_LF]))
    before, after = around[quotes], around[quotes + 2]
    begins = (before == delimiter) | (before == _LF)
    ends = (after == delimiter) | (after == _LF) | (after == _CR)
    wrong = (count % 2) == 1
    wrong[line[~np.where(opens, begins, ends)]] = True
    inside = (np.searchsorted(quotes, marks) - first[on]) % 2 == 1
    wrong[on[inside]] = True
    return wrong
