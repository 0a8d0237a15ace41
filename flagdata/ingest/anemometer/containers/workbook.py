"""The process that reads Excel workbooks, see `flagdata.core.files.bounded`: the first sheet that
holds a table, as CSV.

python-calamine holds a sheet's cells from the first to the last, also where they are empty, and
ends its process where
there is no memory for them: one number in Excel's last cell is enough.
"""

from __future__ import annotations

import csv
import datetime as dt
import importlib
import io
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from flagdata.errors import InputError, LimitError

_OF_1904 = re.compile(rb"<(?:\w+:)?workbookPr\b[^>]*\bdate1904\s*=\s*[\"'](?:1|true|on)[\"']")
"""Where a workbook says that its days are counted from 1904-01-01 (ECMA-376, part 1, 18.2.28)."""
_HEAD = 1 << 20
"""Bytes in which a workbook says that."""
_WIDEST = 2000
"""Columns of the widest sheet that is read."""


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A sheet that holds a table.

    Attributes:
        title: its name.
        text: its rows as lines of CSV.
        others: names of other sheets that hold a table.
        of_1904: whether the workbook's days are counted from 1904-01-01.
    """

    title: str
    text: str
    others: tuple[str, ...]
    of_1904: bool


def reader() -> Callable[[tuple[str, int]], Sheet | None]:
    """Returns what reads (path of a workbook, most rows of a sheet).

    Raises:
        ModuleNotFoundError: python-calamine is missing.
    """
    calamine: Any = importlib.import_module("python_calamine")
    return lambda message: _read(calamine, *message)


def _read(calamine: Any, where: str, rows: int) -> Sheet | None:
    """Reads the first sheet that holds two rows; `None` where none does.

    Raises:
        InputError: the workbook is damaged.
        LimitError: a sheet has too many rows or columns.
    """
    try:
        with zipfile.ZipFile(where) as archive:
            damaged = archive.testzip()  # calamine reads a damaged sheet as an empty one
            with archive.open("xl/workbook.xml") as stream:
                of_1904 = _OF_1904.search(stream.read(_HEAD)) is not None
        if damaged is None:
            tables = _tables(calamine, where, rows)
            title, text = next(tables, ("", ""))
            other_titles = tuple(name for name, _ in tables)
            return (
                Sheet(title=title, text=text, others=other_titles, of_1904=of_1904)
                if text
                else None
            )
    except (
        calamine.CalamineError,
        zipfile.BadZipFile,
        zlib.error,
        OSError,
        ValueError,
        RuntimeError,
    ) as error:
        damaged = type(error).__name__
    fix = "copy it again, or open it in Excel and save the sheet as CSV"
    raise InputError(f"the workbook cannot be read: {damaged}", where=where, fix=fix)


def _tables(calamine: Any, where: str, rows: int) -> Iterator[tuple[str, str]]:
    """Yields title and text of each sheet that holds two rows."""
    book = calamine.CalamineWorkbook.from_path(where)
    for sheet in book.sheets_metadata:
        if sheet.typ == calamine.SheetTypeEnum.WorkSheet:
            text = _text(book.get_sheet_by_name(sheet.name), rows, where)
            if sum(bool(line.strip(",\n")) for line in io.StringIO(text)) > 1:
                yield sheet.name, text


def _text(sheet: Any, rows: int, where: str) -> str:
    if sheet.total_height >= rows:
        raise LimitError(f"the sheet has more than {rows} rows", where=where, fix="split the sheet")
    if sheet.total_width >= _WIDEST:
        raise LimitError(
            f"the sheet has more than {_WIDEST} columns",
            where=where,
            fix="save the columns needed as CSV",
        )
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    if (
        sheet.start is not None
    ):  # there is a cell; rows come from the sheet's first, columns from that of the cells
        empty_cells = [""] * sheet.start[1]
        writer.writerows([*empty_cells, *map(_cell, row)] for row in sheet.iter_rows())
    return out.getvalue()


def _cell(value: object) -> str:
    """Writes a cell as text on one line."""
    if isinstance(value, dt.datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    return " ".join(str(value).split())
