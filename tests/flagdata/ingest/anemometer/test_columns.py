"""Columns cut by Arrow are what reading row by row gives, whatever is wrong with the lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest import FileLayout, WindOptions, open_text, read_log
from flagdata.ingest.anemometer.instants.stamp_text import PLAIN_FORMS, parse
from flagdata.ingest.anemometer.text.columns import Columns
from flagdata.ingest.anemometer.text.cut_lines import RowReader
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import Limits

HEADER = b"a,b,c\n"
LAWS: dict[str, bytes] = {
    "plain": b"1,2,3\n4,5,6\n",
    "no line end at the end": b"1,2,3\n4,5,6",
    "windows": b"1,2,3\r\n4,5,6\r\n",
    "mixed line ends": b"1,2,3\r\n4,5,6\n7,8,9\r10,11,12\n",
    "quoted": b'"1",2,"3"\n4,"",6\n',
    "a quoted delimiter": b'"1,5",2,3\n4,5,6\n',
    "a quoted delimiter in place of one that is missing": b'"1,5",2\n4,5,6\n7,8,9\n',
    "doubled quotes": b'"a""b",2,3\n"""",5,6\n"a","""b""",c\n',
    "a quote within a cell": b'1,2"x,3\n4,5,6\n7,8 "y",9\n',
    "a quote that is not closed": b'"1,2,3\n4,5,6\n7,8,"9\n10,11,12\n',
    "a blank before a quote": b'1, "2",3\n4,5,6\n',
    "too few and too many": b"1,2\n4,5,6\n7,8,9,10\n1,1,1\n2,2,2\n",
    "an empty cell more": b"1,2,3,\n4,5,6,\n7,8,9\n10,11,12, \n1,2,3,4\n",
    "several empty cells more": b"1,2,3,,\n4,5,6,,\n7,8,9\n10,11,12, ,\n1,2,3,,4\n1,2,3,4,\n,,,,\n",
    "blank lines": b"\n1,2,3\n   \n4,5,6\n\x1a\n",
    "delimiters alone": b",,\n1,2,3\n",
    "NUL bytes": b"1,2,3\n\0\0\0\n4,\0,6\n7,8,9\n" + 20 * b"10,11,12\n",
    "beyond ASCII": "1,2 °,3\n4,5,\xa06\n".encode(),
    "a mark in the middle": b"\xef\xbb\xbf1,2,3\n4,5,6\n",
    "cut off": b"1,2,3\n4,5,6\n7,8",
    "cut off in a quote": b'1,2,3\n4,5,6\n7,"8',
    "comments": b"#1,2,3\n4,5,6\n# more\n7,8,9\n",
}


def reader(path: Path, *, delimiter: str = ",", comment: str = "", header: int = 1) -> RowReader:
    source = open_text(path, limits=Limits())
    return RowReader(source, FileLayout(header=header, delimiter=delimiter, comment=comment))


def columns_of(rows: RowReader, width: int) -> tuple[list[int], list[list[str]], list[object]]:
    numbers: list[int] = []
    cells: list[list[str]] = []
    for line, block in rows.blocks(width):
        numbers += line.tolist()
        if isinstance(block, Columns):
            cells += [
                list(row)
                for row in zip(*(block.column(i).to_pylist() for i in range(width)), strict=True)
            ]
        else:
            cells += [row[:width] for row in block]
    return numbers, cells, list(rows.findings())


def rows_of(rows: RowReader, width: int) -> tuple[list[int], list[list[str]], list[object]]:
    numbers: list[int] = []
    cells: list[list[str]] = []
    for line, block in rows.rows(width):
        numbers += line.tolist()
        cells += [row[:width] for row in block]
    return numbers, cells, list(rows.findings())


def small_blocks(monkeypatch: pytest.MonkeyPatch, size: int) -> None:
    """Blocks of a few bytes, so that their ends fall everywhere."""
    whole = TextFile.raw_blocks

    def blocks(self: TextFile) -> object:
        return whole(self, size)

    monkeypatch.setattr(TextFile, "raw_blocks", blocks)


@pytest.mark.parametrize("size", [7, 20, 1 << 20])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("law", LAWS)
def test_columns_equal_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, law: str, delimiter: str, size: int
) -> None:
    small_blocks(monkeypatch, size)
    path = tmp_path / "log.csv"
    path.write_bytes((HEADER + LAWS[law]).replace(b",", delimiter.encode()))
    comment = "#" if law == "comments" else ""
    expected = rows_of(reader(path, delimiter=delimiter, comment=comment), 3)
    assert expected[0], "the law has rows"
    assert columns_of(reader(path, delimiter=delimiter, comment=comment), 3) == expected


@pytest.mark.parametrize(
    "body", [b"1,2,3\n4,5,6,7\n8,9\n", b"1,2\n3,4,5\n6,7\n", b"\n1,2,3\n4,5,6\n"]
)
def test_columns_equal_rows_without_a_header(tmp_path: Path, body: bytes) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(body)
    assert columns_of(reader(path, header=0), 2) == rows_of(reader(path, header=0), 2)


@pytest.mark.parametrize("first", [b"\xef\xbb\xbf", b"\xff"], ids=["byte-order-mark", "latin-1"])
def test_columns_equal_rows_in_other_encodings(tmp_path: Path, first: bytes) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(
        first + b"a,b,c\n1,2,3\n4,\xb0,6\n7,8,9\n"
        if first == b"\xff"
        else first + b"a,b,c\n1,2,3\n"
    )
    assert columns_of(reader(path), 3) == rows_of(reader(path), 3)


def test_mostly_malformed_lines_are_refused_by_columns_too(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(HEADER + b"1,2\n" * 5 + b"1,2,3\n")
    with pytest.raises(InputError, match="5 of 6 lines have another number of columns"):
        columns_of(reader(path), 3)


@pytest.mark.parametrize("seed", range(40))
def test_columns_equal_rows_for_random_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    small_blocks(monkeypatch, int(rng.integers(5, 200)))
    body = bytearray(b'1,2,3\n"4",5,6\n' * 20)
    for at in rng.integers(0, len(body), 12).tolist():
        body[at] = int(rng.choice(list(b'",\r\n\0 #x\x1a')))
    path = tmp_path / "log.csv"
    path.write_bytes(HEADER + bytes(body))
    assert columns_of(reader(path), 3) == rows_of(reader(path), 3)


def toa5(path: Path) -> None:
    """20 Hz with missing trailing zeros, NAN, a jump of RECORD, damaged rows, and rows cut off at
    the end."""
    lines = [
        '"TOA5","CR3000","CR3000","1","os","CPU:a","2","t"',
        '"TIMESTAMP","RECORD","Ux","Uy","Uz","diag_csat"',
        '"TS","RN","m/s","m/s","m/s",""',
        '"","","Smp","Smp","Smp","Smp"',
    ]
    rng = np.random.default_rng(4)
    for i in range(600):
        whole, part = divmod(i * 50, 1000)
        text = f".{part:03d}".rstrip("0").rstrip(".") if part else ""
        record = i if i < 300 else i + 7
        x = '"NAN"' if i % 50 == 3 else f"{rng.normal(4, 1):.5f}"
        z = "-7999" if i % 90 == 5 else "0.01"
        lines.append(
            f'"2021-05-14 00:00:{whole:02d}{text}",{record},{x},{rng.normal():.5f},{z},{i % 64}'
        )
    lines[100] = lines[100][:20]
    lines[200] = lines[200].replace(",", ";")
    lines[250] = lines[250].replace("2021-05-14", "2021-13-14")
    lines[350] = lines[350].replace("2021", "2\x0021")
    lines[-1] = lines[-1][:35]
    path.write_bytes("\r\n".join(lines).encode())


def test_a_damaged_toa5_table_is_read_as_row_by_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "t.dat"
    toa5(path)
    fast = read_log(path, WindOptions(zone="UTC"))
    monkeypatch.setattr(RowReader, "blocks", RowReader.rows)
    slow = read_log(path, WindOptions(zone="UTC"))
    assert {f.kind for f in slow.findings} >= {
        "records-lost",
        "malformed-lines",
        "cut-off",
        "unreadable-stamps",
    }
    assert fast.findings == slow.findings
    np.testing.assert_array_equal(fast.series.time, slow.series.time)
    np.testing.assert_array_equal(fast.series.flags, slow.series.flags)
    for name, values in slow.series.channels.items():
        np.testing.assert_array_equal(fast.series.channels[name], values)


@pytest.mark.parametrize(
    "texts",
    [
        ["2021-05-14 00:00:00", "2021-05-14 00:00:00.05", "2021-05-14 00:00:00.1"],
        ["2021-05-14T00:01:00", "2021-05-14 00:02:00"],
        ["2021-05-14 00:01:00.123456789"],
        ["1970-01-01 00:00:00", "2200-12-31 23:59:59.999"],
        ["1969-12-31 23:59:59", "2021-05-14 00:00:00"],
        ["2021-02-29 00:00:00", "2021-05-14 00:00:00"],
        ["2021-05-14 24:00:00", "2021-05-14 23:59:60"],
        ["2021-05-14 00:00:00,5", "2021-05-14 00:00:00."],
        [" 2021-05-14 00:00:00 ", "2021-05-14  00:00:00", ""],
    ],
)
@pytest.mark.parametrize("form", PLAIN_FORMS)
def test_stamps_by_arrow_are_those_of_the_pattern(
    monkeypatch: pytest.MonkeyPatch, form: str, texts: list[str]
) -> None:
    quick = parse(texts, form)
    monkeypatch.setattr("flagdata.ingest.anemometer.instants.stamp_text.PLAIN_FORMS", ())
    slow = parse(texts, form)
    for name in ("ns", "utc", "valid", "distant"):
        np.testing.assert_array_equal(getattr(quick, name), getattr(slow, name), err_msg=name)
    assert quick.step == slow.step
