"""Excel workbooks (.xlsx): one sheet as the text that Excel would save as CSV, so that every format reads it.

Dates and times become ISO 8601; formulas give the values that Excel stored; empty rows stay, so that line numbers are
the sheet's row numbers. Needs the library python-calamine (the extra `flagdata[excel]`).
"""

from __future__ import annotations

import csv
import datetime as dt
import importlib
import io
import re
import zipfile
import zlib
from pathlib import Path
from typing import Any

from flagdata.errors import InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.options import Limits
from flagdata.ingest.anemometer.text.source import TableText

_OF_1904 = re.compile(rb"<(?:\w+:)?workbookPr\b[^>]*\bdate1904\s*=\s*[\"'](?:1|true|on)[\"']")
"""Where a workbook says that its days are counted from 1904-01-01 (ECMA-376, part 1, 18.2.28)."""
_WIDEST = 2000
"""Columns of the widest sheet that is read."""


def open_sheet(path: Path, *, limits: Limits) -> TableText:
    """The first sheet of a workbook that holds a table.

    Raises:
        InputError: python-calamine is missing, the workbook is damaged, or no sheet holds two rows.
        LimitError: larger than `limits` allow, unpacked.
    """
    where = str(path)
    with zipfile.ZipFile(path) as archive:  # is_workbook has read its directory
        size = sum(item.file_size for item in archive.infolist())
    if size > limits.size:
        what = f"the workbook unpacks to {size} bytes, more than {limits.size}"
        raise LimitError(what, where=where, fix="save the sheet as CSV")
    try:
        calamine: Any = importlib.import_module("python_calamine")
    except ModuleNotFoundError:
        raise InputError(
            "this is an Excel workbook, and the library that reads it is not installed", where=where,
            fix="install it: pip install 'flagdata[excel]', or save the sheet as CSV",
        ) from None  # fmt: skip
    sheets: dict[str, Any] = {}
    of_1904 = False
    try:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()  # calamine reads a damaged sheet as an empty one
            of_1904 = _OF_1904.search(archive.read("xl/workbook.xml")) is not None
        book = calamine.CalamineWorkbook.from_path(where)
        names = [one.name for one in book.sheets_metadata if one.typ == calamine.SheetTypeEnum.WorkSheet]
        sheets = {name: book.get_sheet_by_name(name) for name in names}
    except (calamine.CalamineError, zipfile.BadZipFile, zlib.error, OSError, ValueError, RuntimeError) as error:
        damaged = type(error).__name__
    if damaged is not None:
        fix = "copy it again, or open it in Excel and save the sheet as CSV"
        raise InputError(f"the workbook cannot be read: {damaged}", where=where, fix=fix)
    tables = {name: _lines(sheet, limits, where) for name, sheet in sheets.items()}
    filled = {name: lines for name, lines in tables.items() if sum(bool(line.strip(",")) for line in lines) > 1}
    if not filled:
        raise InputError("no sheet with two rows", where=where, fix="check that the workbook holds the log")
    title, *others = filled
    found: tuple[Finding, ...] = ()
    if others:
        text = f"the sheet {title!r} is read, the first of {len(filled)}; not {', '.join(map(repr, others))}"
        fix = "save another sheet as a file of its own to read it"
        found = (Finding(kind="several-sheets", severity=Severity.WARNING, count=len(filled), what=text, fix=fix),)
    if of_1904:
        text = "the workbook counts days from 1904-01-01: so its dates are read, and so is excel-days"
        found = (*found, Finding(kind="days-since-1904", severity=Severity.NOTE, what=text))
    lines, days = tuple(filled[title]), "excel-days-1904" if of_1904 else "excel-days"
    return TableText(path=path, encoding="utf-8", lines=len(lines), findings=found, text=lines, serial_days=days)


def _lines(sheet: Any, limits: Limits, where: str) -> list[str]:
    if sheet.total_height >= limits.rows:
        raise LimitError(f"more than {limits.rows} rows", where=where, fix="split the sheet")
    if sheet.total_width >= _WIDEST:
        raise LimitError(f"more than {_WIDEST} columns", where=where, fix="save the columns needed as CSV")
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows([_text(value) for value in row] for row in sheet.to_python(skip_empty_area=False))
    return out.getvalue().splitlines()


def _text(value: object) -> str:
    """A cell as text on one line."""
    if isinstance(value, dt.datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    return " ".join(str(value).split())
