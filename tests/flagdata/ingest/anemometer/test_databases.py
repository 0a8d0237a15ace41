"""Dumps and files of databases, and files of columns: rows of the table with a wind, none lost."""

from __future__ import annotations

import datetime as dt
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather, parquet

from flagdata.errors import FlagdataError, InputError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[..., Path]
COUNT = 12
START = dt.datetime(2026, 5, 1, 12, tzinfo=dt.UTC)
STAMPS = [START + dt.timedelta(minutes=at) for at in range(COUNT)]
SPEEDS = [3.0 + 0.25 * (at % 5) for at in range(COUNT)]
DIRECTIONS = [200.0 + at for at in range(COUNT)]
ROWS = list(zip([f"{stamp:%Y-%m-%d %H:%M:%S}" for stamp in STAMPS], SPEEDS, DIRECTIONS, strict=True))
CREATE = (
    "CREATE TABLE `weather` (\n  `id` int(11) NOT NULL,\n  `ts` datetime DEFAULT '0000-00-00 00:00:00',\n"
    "  `wind_speed_ms` decimal(5,2) COMMENT 'mean, of 1 (one) minute',\n  `wind_dir` float,\n  `note` varchar(9),\n"
    "  PRIMARY KEY (`id`), KEY `at` (`ts`)\n);\n"
)
OTHER = "CREATE TABLE users (id int, name text);\nINSERT INTO users VALUES (1,'O''Neil; (x)'),(2,'a\\'b');\n"


def check(path: Path, **options: object) -> None:
    series = read_log(path, WindOptions(**options)).series  # type: ignore[arg-type]
    np.testing.assert_array_equal(series.time, [int(stamp.timestamp()) * 10**9 for stamp in STAMPS])
    np.testing.assert_allclose(series.channels["wind_speed"], SPEEDS)
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), DIRECTIONS)


def dumps() -> dict[str, str]:
    extended = ",".join(f"({n},'{t}',{s},{d},NULL)" for n, (t, s, d) in enumerate(ROWS))
    single = "".join(f"INSERT INTO wind (ts, speed_ms, dir_deg) VALUES ('{t}', {s}, {d});\n" for t, s, d in ROWS)
    copied = "".join(f"{t}\t{s}\t{d}\t\\N\n" for t, s, d in ROWS)
    server = "".join(
        f"INSERT [dbo].[Wind] ([MeasuredAt], [WindSpeed_ms], [WindDir]) "
        f"VALUES (CAST(N'{t.replace(' ', 'T')}' AS DateTime), CAST({s} AS Decimal(10, 2)), {d})\n"
        for t, s, d in ROWS
    )
    return {
        "mysqldump": f"-- MySQL dump\n{OTHER}{CREATE}INSERT INTO `weather` VALUES {extended};\nUNLOCK TABLES;\n",
        "one-insert-a-row": single,
        "pg_dump": f"COPY public.weather (ts, wind_speed_ms, wind_dir, note) FROM stdin;\n{copied}\\.\n\nSELECT 1;\n",
        "sql-server": f"USE [db]\nGO\nCREATE TABLE [dbo].[Wind]([MeasuredAt] [datetime] NULL)\nGO\n{server}",
    }


@pytest.mark.parametrize("kind", dumps())
def test_rows_of_a_dump_are_read(log_file: Write, kind: str) -> None:
    check(log_file(dumps()[kind]), zone="UTC")


def test_a_dump_on_long_lines_is_read(log_file: Write) -> None:
    rows = ",".join(
        f"({at},'{START + dt.timedelta(seconds=at):%Y-%m-%d %H:%M:%S}',{3 + at % 5},210,NULL)" for at in range(3000)
    )
    assert len(rows) > 100_000
    log = read_log(log_file(f"{CREATE}INSERT INTO `weather` VALUES {rows};\n"), WindOptions(zone="UTC"))
    assert len(log.series.time) == 3000


def test_a_dump_that_ends_within_a_row_says_so(log_file: Write) -> None:
    text = dumps()["mysqldump"]
    log = read_log(log_file(text[: text.index(f"({COUNT - 1},") + 20]), WindOptions(zone="UTC"))
    assert len(log.series.time) == COUNT - 1
    assert "cut-off" in {finding.kind for finding in log.findings}


def test_of_two_tables_with_a_wind_the_other_is_told(log_file: Write) -> None:
    text = dumps()["mysqldump"] + "INSERT INTO gusts (ts, wind_gust_ms) VALUES ('2026-05-01 12:00:00', 9.0);\n"
    (told,) = (
        one for one in read_log(log_file(text), WindOptions(zone="UTC")).findings if one.kind == "several-tables"
    )
    assert "'gusts'" in told.what


def database(path: Path) -> Path:
    with closing(sqlite3.connect(path)) as base:
        base.execute("CREATE TABLE users (id INTEGER, name TEXT, icon BLOB)")
        base.execute("INSERT INTO users VALUES (1, 'a', x'00ff')")
        base.execute(
            "CREATE TABLE archive (dateTime INTEGER PRIMARY KEY, usUnits INTEGER, windSpeed REAL, windDir REAL)"
        )
        rows = [(int(t.timestamp()), 17, s, d) for t, s, d in zip(STAMPS, SPEEDS, DIRECTIONS, strict=True)]
        base.executemany("INSERT INTO archive VALUES (?, ?, ?, ?)", rows)
        base.commit()
    return path


def test_the_archive_of_a_weather_program_is_read_from_its_database(tmp_path: Path) -> None:
    path = database(tmp_path / "weewx.sdb")
    before = path.read_bytes()
    check(path)
    assert path.read_bytes() == before


def test_a_database_without_a_wind_names_its_tables(tmp_path: Path) -> None:
    path = tmp_path / "other.db"
    with closing(sqlite3.connect(path)) as base:
        base.execute("CREATE TABLE users (id INTEGER)")
        base.commit()
    with pytest.raises(InputError, match="'users'"):
        read_log(path)


def test_a_damaged_database_is_refused(tmp_path: Path) -> None:
    path = database(tmp_path / "weewx.sdb")
    data = path.read_bytes()
    path.write_bytes(data[:100] + b"\xff" * (len(data) - 100))
    with pytest.raises(InputError, match="cannot be read"):
        read_log(path)


def columns(stamps: pa.Array) -> pa.Table:
    return pa.table({
        "time": stamps, "wind_speed_ms": SPEEDS, "wind_dir": DIRECTIONS, "parts": [[1.0]] * COUNT,
        "site": pa.array(["a"] * COUNT).dictionary_encode(),
    })  # fmt: skip


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_files_of_columns_keep_their_instants(tmp_path: Path, unit: str) -> None:
    table = columns(pa.array(STAMPS, pa.timestamp(unit, "Europe/Amsterdam")))
    parquet.write_table(table, tmp_path / "wind.parquet")
    check(tmp_path / "wind.parquet")
    feather.write_feather(table, str(tmp_path / "wind.feather"))
    check(tmp_path / "wind.feather")


def test_stamps_of_columns_without_a_zone_are_asked_for_one(tmp_path: Path) -> None:
    naive = [stamp.replace(tzinfo=None) for stamp in STAMPS]
    parquet.write_table(columns(pa.array(naive, pa.timestamp("ms"))), tmp_path / "wind.parquet")
    with pytest.raises(FlagdataError, match="no time zone"):
        read_log(tmp_path / "wind.parquet")
    check(tmp_path / "wind.parquet", zone="UTC")


@pytest.mark.parametrize("keep", [4, 50, 500])
def test_a_damaged_file_of_columns_is_refused(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "wind.parquet"
    parquet.write_table(columns(pa.array(STAMPS, pa.timestamp("ms", "UTC"))), path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match="cannot be read"):
        read_log(path)
