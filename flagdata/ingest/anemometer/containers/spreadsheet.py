"""Excel workbooks (.xlsx): one sheet as the text that Excel would save as CSV, so that every format reads it.

Dates and times become ISO 8601; formulas give the values that Excel stored; empty rows stay, so that line numbers are
the sheet's row numbers. Needs the library openpyxl (the extra `flagdata[excel]`).
"""

from __future__ import annotations

import csv
import datetime as dt
import importlib
import io
import struct
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import Any

from flagdata.errors import FlagdataError, InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.options import Limits
from flagdata.ingest.anemometer.text.source import TableText

ZIP = b"PK\x03\x04"
_WORKBOOK = "xl/workbook.xml"
# What zipfile, zlib, the XML parser and openpyxl raise for a damaged or encrypted workbook.
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, struct.error, SyntaxError, KeyError, ValueError, TypeError, AttributeError,
    IndexError, EOFError, OSError, RuntimeError, AssertionError, OverflowError,
)  # fmt: skip
_WIDEST = 2000
"""Columns of the widest sheet that is read."""


def is_workbook(path: Path, head: bytes) -> bool:
    """Whether a file is an Excel workbook (Office Open XML), by its content."""
    if not head.startswith(ZIP):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return _WORKBOOK in archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return False


def open_sheet(path: Path, *, limits: Limits) -> TableText:
    """The first sheet of a workbook that holds a table.

    Raises:
        InputError: openpyxl is missing, the workbook is damaged, or no sheet holds two rows.
        LimitError: larger than `limits` allow, unpacked.
    """
    where = str(path)
    with zipfile.ZipFile(path) as archive:  # is_workbook has read its directory
        size = sum(item.file_size for item in archive.infolist())
    if size > limits.size:
        raise LimitError(
            f"the workbook unpacks to {size} bytes, more than {limits.size}", where=where,
            fix="save the sheet as CSV",
        )  # fmt: skip
    try:
        openpyxl = importlib.import_module("openpyxl")
    except ModuleNotFoundError:
        raise InputError(
            "this is an Excel workbook, and the library that reads it is not installed", where=where,
            fix="install it: pip install 'flagdata[excel]', or save the sheet as CSV",
        ) from None  # fmt: skip
    # openpyxl warns of styles and validations that it does not keep; values are all that is read here.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            return _read(openpyxl, path, limits)
        except FlagdataError:
            raise
        except _DAMAGE as error:
            raise InputError(
                f"the workbook cannot be read: {error.__class__.__name__}", where=where,
                fix="copy it again, or open it in Excel and save the sheet as CSV",
            ) from None  # fmt: skip


def _read(openpyxl: Any, path: Path, limits: Limits) -> TableText:
    where = str(path)
    with path.open("rb") as stream:  # opened here: openpyxl leaves a damaged workbook open
        book = openpyxl.load_workbook(stream, read_only=True, data_only=True)
        try:
            tables = {sheet.title: _lines(sheet, limits, where) for sheet in book.worksheets}
        finally:
            book.close()
    filled = {title: lines for title, lines in tables.items() if sum(bool(line.strip(",")) for line in lines) > 1}
    if not filled:
        raise InputError("no sheet with two rows", where=where, fix="check that the workbook holds the log")
    title = next(iter(filled))
    found: tuple[Finding, ...] = ()
    if len(filled) > 1:
        others = ", ".join(repr(name) for name in list(filled)[1:])
        text = f"the sheet {title!r} is read, the first of {len(filled)}; not {others}"
        fix = "save another sheet as a file of its own to read it"
        found = (Finding(kind="several-sheets", severity=Severity.WARNING, count=len(filled), what=text, fix=fix),)
    lines = filled[title]
    return TableText(path=path, encoding="utf-8", lines=len(lines), findings=found, text=tuple(lines))


def _lines(sheet: Any, limits: Limits, where: str) -> list[str]:
    lines: list[str] = []
    for row in sheet.iter_rows(values_only=True):
        if len(lines) >= limits.rows:
            raise LimitError(f"more than {limits.rows} rows", where=where, fix="split the sheet")
        if len(row) > _WIDEST:
            raise LimitError(f"more than {_WIDEST} columns", where=where, fix="save the columns needed as CSV")
        out = io.StringIO()
        csv.writer(out, lineterminator="").writerow([_text(value) for value in row])
        lines.append(out.getvalue())
    while lines and not lines[-1].strip(","):
        lines.pop()
    return lines


def _text(value: object) -> str:
    """A cell as text on one line."""
    if value is None:
        return ""
    if isinstance(value, dt.datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    return " ".join(str(value).split())
