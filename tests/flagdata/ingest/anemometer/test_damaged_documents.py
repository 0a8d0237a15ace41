"""Documents and databases that are damaged anywhere are read or refused, and nothing else comes out of them."""

from __future__ import annotations

import contextlib
import datetime as dt
import io
import json
import sqlite3
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import cache
from pathlib import Path

import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import feather, parquet

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff

ROWS = [(f"2026-05-01T12:{at:02d}:00Z", 3.0 + at % 4, 200 + at) for at in range(12)]
FRAGMENTS = [
    "<", ">", "/>", "</obs>", "<obs>", "&amp;", "&", "<!--", "-->", "<![CDATA[", "]]>", "<td>", "<tr>", "</table>",
    "<table>", "'", '"', "''", "\\'", "(", ")", ",", ";", "\n", "VALUES", "INSERT INTO `w` VALUES ", "CREATE TABLE w (",
    "COPY w (a) FROM", " stdin;\n", "\\.", "NULL", "{", "}", "[", "]", ":", "null", "1e999", "-", "\x00", "é",
]  # fmt: skip


def table() -> pa.Table:
    stamps = [dt.datetime.fromisoformat(stamp) for stamp, _, _ in ROWS]
    return pa.table({"time": stamps, "wind_speed_ms": [s for _, s, _ in ROWS], "dir": [d for _, _, d in ROWS]})


def archive() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wind.db"
        with closing(sqlite3.connect(path)) as base:
            base.execute("CREATE TABLE wind (time TEXT, wind_speed_ms REAL, wind_dir REAL)")
            base.executemany("INSERT INTO wind VALUES (?, ?, ?)", ROWS)
            base.commit()
        return path.read_bytes()


def written(write: Callable[[pa.Table, io.BytesIO], object]) -> bytes:
    out = io.BytesIO()
    write(table(), out)
    return out.getvalue()


def xml() -> bytes:
    body = "".join(
        f"<obs><time>{t}</time><windSpeed unit='m/s'>{s}</windSpeed><dir>{d}</dir></obs>\n" for t, s, d in ROWS
    )
    return f"<?xml version='1.0'?>\n<data>\n{body}</data>\n".encode()


def page() -> bytes:
    body = "".join(f"<tr><td>{t}</td><td>{s}</td><td>{d}</td></tr>\n" for t, s, d in ROWS)
    head = "<tr><th>time</th><th>wind m/s</th><th>dir</th></tr>"
    return f"<html><body><table>{head}\n{body}</table></body></html>\n".encode()


def dump() -> bytes:
    made = "CREATE TABLE w (`time` text, wind_speed_ms float, note text);\nINSERT INTO w VALUES "
    return (made + ",".join(f"('{t}', {s}, 'it''s (a) note')" for t, s, _ in ROWS) + ";\n").encode()


def copied() -> bytes:
    body = "".join(f"{t}\t{s}\t{d}\n" for t, s, d in ROWS)
    return f"COPY w (time, wind_speed_ms, dir) FROM stdin;\n{body}\\.\n".encode()


def document() -> bytes:
    return json.dumps([{"time": t, "wind_speed_ms": s, "wind_dir": d} for t, s, d in ROWS]).encode()


KINDS: dict[str, Callable[[], bytes]] = {
    "xml": xml, "page": page, "dump": dump, "copied": copied, "json": document, "sqlite": cache(archive),
    "parquet": cache(lambda: written(parquet.write_table)), "feather": cache(lambda: written(feather.write_feather)),
}  # fmt: skip


def swallow(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wind.log"
        path.write_bytes(content)
        with contextlib.suppress(FlagdataError):
            read_log(path, WindOptions(zone="UTC"))
        with contextlib.suppress(FlagdataError):
            assert sniff(path)


@pytest.mark.parametrize("kind", KINDS)
def test_as_written_it_is_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "wind.log"
    path.write_bytes(KINDS[kind]())
    assert read_log(path).series.channels["wind_speed"].tolist() == [speed for _, speed, _ in ROWS]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15, deadline=None)
@given(
    changes=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=12), kept=st.floats(0, 1.5)
)
def test_changed_bytes_and_lost_ends(kind: str, changes: Sequence[tuple[float, int]], kept: float) -> None:
    content = bytearray(KINDS[kind]())
    for place, value in changes:
        content[min(int(place * len(content)), len(content) - 1)] = value
    swallow(bytes(content[: int(kept * len(content))]))


@pytest.mark.parametrize("kind", ["xml", "page", "dump", "copied", "json"])
@settings(max_examples=15, deadline=None)
@given(changes=st.lists(st.tuples(st.floats(0, 1), st.sampled_from(FRAGMENTS)), min_size=1, max_size=8))
def test_fragments_where_they_do_not_belong(kind: str, changes: Sequence[tuple[float, str]]) -> None:
    text = KINDS[kind]().decode()
    for place, fragment in changes:
        at = int(place * len(text))
        text = text[:at] + fragment + text[at:]
    swallow(text.encode())
