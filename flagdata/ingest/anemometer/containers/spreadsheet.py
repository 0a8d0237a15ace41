"""Excel workbooks (.xlsx): one sheet as the text that Excel would save as CSV, so that every format
reads it.

Dates and times become ISO 8601; formulas give the values that Excel stored; empty rows stay, so
that line numbers are the sheet's row numbers. Needs the library python-calamine (the extra
`flagdata[excel]`), which works in a process of its own, see
`flagdata.ingest.anemometer.containers.workbook`.
"""

from __future__ import annotations

import zipfile
from importlib.util import find_spec
from pathlib import Path

from flagdata.core.files.bounded import Child, End, EndedError
from flagdata.core.findings import Finding
from flagdata.errors import FlagdataError, InputError, LimitError
from flagdata.ingest.anemometer.containers.workbook import Sheet
from flagdata.ingest.anemometer.text.text_file import TableText
from flagdata.ingest.anemometer.wind_options import Limits

_MEMORY = 900 << 20
"""Memory that reading a workbook may take [B]; a sheet of a million rows and ten columns takes half
of it."""
_SECONDS = 60.0
"""Time that it may take [s]."""
_FIX = "delete what lies far from the table, or save the sheet as CSV"


def open_sheet(path: Path, *, limits: Limits) -> TableText:
    """Reads the first sheet of a workbook that holds a table.

    Raises:
        InputError: python-calamine is missing, the workbook is damaged, or no sheet holds two rows.
        LimitError: larger than `limits` allow, unpacked; or it takes too much memory or time to be
            read.
    """
    where = str(path)
    with zipfile.ZipFile(path) as archive:  # is_workbook has read its directory
        size = sum(item.file_size for item in archive.infolist())
    if size > limits.size:
        message = f"the workbook unpacks to {size} bytes, more than {limits.size}"
        raise LimitError(message, where=where, fix="save the sheet as CSV")
    if find_spec("python_calamine") is None:
        raise InputError(
            "this is an Excel workbook, and the library that reads it is not installed",
            where=where,
            fix="install it: pip install 'flagdata[excel]', or save the sheet as CSV",
        )
    sheet = _read(where, limits)
    if sheet is None:
        raise InputError(
            "there is no sheet with two rows",
            where=where,
            fix="check that the workbook holds the log",
        )
    findings: tuple[Finding, ...] = ()
    if sheet.others:
        count = 1 + len(sheet.others)
        text = (
            f"the sheet {sheet.title!r} is read, the first of {count}; not "
            f"{', '.join(map(repr, sheet.others))}"
        )
        fix = "save another sheet as a file of its own to read it"
        findings = (Finding.of("several-sheets", text, count=count, fix=fix),)
    if sheet.of_1904:
        text = (
            "the workbook counts days from 1904-01-01: so its dates are read, and so is excel-days"
        )
        findings = (*findings, Finding.of("days-since-1904", text))
    lines, days = (
        tuple(sheet.text.splitlines()),
        "excel-days-1904" if sheet.of_1904 else "excel-days",
    )
    return TableText(
        path=path,
        encoding="utf-8",
        lines=len(lines),
        findings=findings,
        text=lines,
        serial_days=days,
    )


def _read(where: str, limits: Limits) -> Sheet | None:
    child = Child("flagdata.ingest.anemometer.containers.workbook:reader", memory=_MEMORY)
    try:
        return child.ask((where, limits.rows), seconds=_SECONDS)
    except EndedError as ended:
        if ended.late:
            raise LimitError(
                f"reading it takes longer than {_SECONDS:g} s", where=where, fix=_FIX
            ) from None
        if ended.end is not End.MEMORY:
            message = f"the process that reads it has ended: {ended.detail or ended.end}"
            raise FlagdataError(message, where=where, fix=f"do it again, or {_FIX}") from None
        message = (
            f"its sheets take more than {_MEMORY >> 20} MiB: cells count from the first to the "
            "last, filled or not"
        )
        raise LimitError(message, where=where, fix=_FIX) from None
    finally:
        child.close()
