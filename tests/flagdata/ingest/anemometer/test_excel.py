"""Excel workbooks: the sheet is read as the CSV that Excel would save."""

from __future__ import annotations

import datetime as dt
import importlib
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from flagdata.core.files.bounded import Child, End, EndedError
from flagdata.errors import FlagdataError, InputError, LimitError
from flagdata.ingest import WindOptions, open_text, read_log, sniff
from flagdata.ingest.anemometer import Limits
from flagdata.lake import Lake
from flagdata.timebase import iso
from tests.studies.hostile.campaign import command

Book = Callable[..., Path]


@pytest.fixture
def book(tmp_path: Path) -> Book:
    """Writes sheets of rows to a workbook and returns its path."""
    pytest.importorskip(
        "python_calamine", reason="python-calamine absent: pip install 'flagdata[excel]'"
    )
    openpyxl: Any = pytest.importorskip(
        "openpyxl", reason="openpyxl absent: pip install 'flagdata[dev]'"
    )

    def write(**sheets: Sequence[Sequence[object]]) -> Path:
        made = openpyxl.Workbook()
        made.remove(made.active)
        for title, rows in sheets.items():
            sheet = made.create_sheet(title)
            for row in rows:
                sheet.append(list(row))
        path = tmp_path / "wind.xlsx"
        made.save(path)
        return path

    return write


START = dt.datetime(2026, 5, 1, 23, 59, 58)  # noqa: DTZ001  a sheet's cells have no zone
PLAIN = [
    ["time", "wind_speed", "air_temperature"],
    *([START + dt.timedelta(seconds=i), 3 + i / 2, 20] for i in range(4)),
]


def test_a_sheet_with_dates_is_read_by_its_recipe(book: Book) -> None:
    path = book(Log=PLAIN)
    log = read_log(path, WindOptions(recipe="generic-csv", zone="UTC"))
    assert [iso(int(t)) for t in log.series.time[1:3]] == [
        "2026-05-01T23:59:59Z",
        "2026-05-02T00:00:00Z",
    ]
    assert log.series.channels["wind_speed"].tolist() == [3.0, 3.5, 4.0, 4.5]
    assert log.series.channels["air_temperature"][0] == pytest.approx(293.15)


def test_a_makers_export_in_a_sheet_is_identified_like_its_text(book: Book) -> None:
    rows = [
        ["z6-01234", "Port1", None, "Port8"],
        ["# Records: 3", "ATMOS 22 Ultrasonic Anemometer", None, "Barometer"],
        ["Timestamps", " m/s Wind Speed", "° Wind Direction", " kPa Reference Pressure"],
        *([START + dt.timedelta(minutes=5 * i), 1.5 + i, 90, 97.8] for i in range(4)),
    ]
    log = read_log(book(Processed=rows), WindOptions(zone="+03:00"))
    assert (log.format, iso(int(log.series.time[0]))) == ("zentra", "2026-05-01T20:59:58Z")
    assert log.series.channels["wind_speed"].tolist() == [1.5, 2.5, 3.5, 4.5]


def test_the_first_sheet_with_a_table_is_read_and_the_others_are_named(book: Book) -> None:
    log = read_log(
        book(Notes=[["made by hand"]], Log=PLAIN, More=PLAIN),
        WindOptions(recipe="generic-csv", zone="UTC"),
    )
    found = next(finding for finding in log.findings if finding.kind == "several-sheets")
    assert "'Log'" in found.what
    assert "'More'" in found.what


@pytest.mark.parametrize("plain", [False, True], ids=["dates", "numbers"])
def test_days_of_the_1904_system_are_those_of_the_workbook(book: Book, plain: bool) -> None:
    path = book(Log=PLAIN)
    made: Any = importlib.import_module("openpyxl").load_workbook(path)
    made.epoch = dt.datetime(1904, 1, 1)  # noqa: DTZ001  as openpyxl names the system
    for row, (cell,) in enumerate(made.active.iter_rows(min_row=2, max_col=1)):
        cell.value = 44681.5 + row / 86_400 if plain else START + dt.timedelta(seconds=row)
        cell.number_format = "General" if plain else "yyyy-mm-dd hh:mm:ss"
    made.save(path)
    form = "excel-days" if plain else "iso"
    log = read_log(path, WindOptions(columns=f"1=time[{form}],2=wind_speed[m/s]", zone="UTC"))
    assert iso(int(log.series.time[0])) == (
        "2026-05-01T12:00:00Z" if plain else "2026-05-01T23:59:58Z"
    )
    assert "days-since-1904" in {finding.kind for finding in log.findings}
    assert (
        "excel-days-1904" in str(log.drafted)
    ) is plain  # what was understood is part of an artifact's identity


def test_an_opendocument_spreadsheet_is_refused_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "wind.ods"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("content.xml", "<office:document-content/>")
    with pytest.raises(InputError, match="OpenDocument spreadsheet"):
        read_log(path)


def test_line_numbers_are_those_of_the_sheets_rows(book: Book) -> None:
    rows = [list(row) for row in PLAIN]
    rows[3][1] = "broken"
    log = read_log(book(Log=rows), WindOptions(recipe="generic-csv", zone="UTC"))
    assert (
        next(finding for finding in log.findings if finding.kind == "unreadable-values").where
        == "line 4"
    )


def test_a_workbook_without_a_table_is_refused(book: Book) -> None:
    with pytest.raises(InputError, match="no sheet with two rows"):
        read_log(book(Notes=[["nothing"]]))


def test_a_damaged_workbook_is_refused(book: Book) -> None:
    path = book(Log=PLAIN)
    whole = path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        at = archive.getinfo("xl/worksheets/sheet1.xml").header_offset
    path.write_bytes(whole[: at + 60] + bytes(40) + whole[at + 100 :])
    with pytest.raises(InputError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert "CSV" in (caught.value.fix or "")


def test_a_workbook_beyond_the_limits_is_refused_before_it_is_unpacked(book: Book) -> None:
    path = book(Log=PLAIN)
    with pytest.raises(LimitError, match="unpacks to"):
        read_log(path, WindOptions(limits=Limits(size=path.stat().st_size + 1)))
    with pytest.raises(LimitError, match="more than 2 rows"):
        read_log(book(Log=PLAIN), WindOptions(limits=Limits(rows=2)))


def test_without_the_library_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "wind.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(ImportError):
        importlib.import_module("python_calamine")
    with pytest.raises(InputError, match="library that reads it is not installed") as caught:
        read_log(path)
    assert "flagdata[excel]" in (caught.value.fix or "")


def test_a_zip_archive_that_is_no_workbook_stays_one(tmp_path: Path) -> None:
    path = tmp_path / "logs.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.csv", "time,wind_speed\n")
    assert sniff(path)[0].format == "a zip archive or an Excel workbook"


def _with_cells(path: Path, cells: str, *, sheet: str = "sheet1.xml") -> Path:
    """The workbook with more cells written behind the others of a sheet."""
    whole = {name: zipfile.ZipFile(path).read(name) for name in zipfile.ZipFile(path).namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in whole.items():
            more = f"{cells}</sheetData>".encode() if name.endswith(sheet) else b"</sheetData>"
            archive.writestr(name, data.replace(b"</sheetData>", more))
    return path


FAR = {
    "last cell": '<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>',
    "last row and a column": '<row r="1048576"><c r="CV1048576"><v>1</v></c></row>',
    "beyond Excel": '<row r="99999999"><c r="ZZZ99999999"><v>1</v></c></row>',
    "formula": '<row r="1048576"><c r="XFD1048576"><f>1+1</f><v>2</v></c></row>',
    "text": '<row r="1048576"><c r="XFD1048576" t="inlineStr"><is><t>x</t></is></c></row>',
}


@pytest.mark.parametrize("cells", FAR.values(), ids=FAR)
def test_a_cell_far_from_the_table_is_refused_with_bounded_memory(book: Book, cells: str) -> None:
    path = _with_cells(book(Log=PLAIN), cells)
    done = subprocess.run(
        [sys.executable, "-c", _MEASURED, str(path)], capture_output=True, text=True, check=True
    )
    words, _, peak = done.stdout.rpartition(" ")
    assert re.search(r"MiB|columns|cannot be read", words)
    assert int(peak) < 1 << 20  # KiB


def test_other_members_of_a_workbook_name_no_file(book: Book, tmp_path: Path) -> None:
    options = WindOptions(recipe="generic-csv", zone="UTC")
    path = book(Log=PLAIN)
    before = read_log(path, options)
    for name in ("../elsewhere", "/elsewhere", "xl/../../elsewhere", "\x1b[2J", "a\nb", "link"):
        _add_link(path, name)
    assert read_log(path, options).series.time.tolist() == before.series.time.tolist()
    _add_link(path, "XL/WORKBOOK.XML")  # which the library takes for the workbook's own
    with pytest.raises(InputError, match="the workbook cannot be read"):
        read_log(path, options)
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def _add_link(path: Path, name: str) -> None:
    member = zipfile.ZipInfo(name)
    member.external_attr = 0o120777 << 16
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(member, "/etc/passwd")


@pytest.mark.parametrize(
    ("end", "detail", "said"),
    [
        (End.MEMORY, "memory allocation of 99 bytes failed", r"its sheets take more than \d+ MiB"),
        (End.SIGNAL, "SIGABRT", r"the process that reads it has ended: SIGABRT"),
    ],
)
def test_only_what_was_refused_memory_takes_too_much(
    book: Book, monkeypatch: pytest.MonkeyPatch, end: End, detail: str, said: str
) -> None:
    def ended(*_: object, **__: object) -> None:
        raise EndedError(end, detail)

    monkeypatch.setattr(Child, "ask", ended)
    with pytest.raises(FlagdataError, match=said) as refused:
        read_log(book(Log=PLAIN), WindOptions(zone="UTC"))
    assert isinstance(refused.value, LimitError) == (end is End.MEMORY)


_MEASURED = """
import resource, sys
from flagdata.errors import InputError, LimitError
from flagdata.ingest.anemometer import WindOptions, read_log
try:
    read_log(sys.argv[1], WindOptions(zone="UTC"))
except (LimitError, InputError) as error:
    print(str(error).replace(chr(10), " "), end=" ")
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""Reads a log in a process of its own, whose children are measured."""


def test_a_workbook_that_is_refused_for_its_size_loses_no_other_source(
    book: Book, tmp_path: Path
) -> None:
    path = _with_cells(book(Log=PLAIN), FAR["last cell"])
    (tmp_path / "log.csv").write_text(
        "time,wind_speed (m/s)\n2026-05-01T12:00:00Z,5.0\n2026-05-01T12:00:01Z,5.1\n"
    )
    lake = Lake.create(tmp_path / "lake")
    command(
        "ingest", path, tmp_path / "log.csv", "--lake", lake.path
    )  # ends with a code of its own
    assert lake.table(lake.view(None))["kind"].to_pylist() == ["wind"]


def test_a_workbook_of_many_sheets_is_read(book: Book) -> None:
    log = read_log(
        book(**{f"n{k}": PLAIN for k in range(300)}), WindOptions(recipe="generic-csv", zone="UTC")
    )
    assert (
        next(finding for finding in log.findings if finding.kind == "several-sheets").count == 300
    )


def test_rows_and_columns_before_the_table_stay_where_they_are(book: Book) -> None:
    path = book(Log=[[], [], *([None, None, *row] for row in PLAIN)])
    assert open_text(path, limits=Limits()).head()[:3] == [
        ",,,,",
        ",,,,",
        ",,time,wind_speed,air_temperature",
    ]
