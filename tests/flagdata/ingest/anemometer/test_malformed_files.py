"""Files that are no text log at all: an error with place and fix, or samples flagged and findings
with numbers."""

from __future__ import annotations

import gzip
import io
import zipfile
from typing import Any

import numpy as np
import pytest

from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError
from flagdata.ingest import OpenFactsError
from flagdata.ingest.anemometer import Limits
from tests.flagdata.ingest.anemometer.cases import case
from tests.flagdata.ingest.anemometer.conftest import check_refused


def csv(*rows: str, header: str = "time,wind_speed") -> bytes:
    return "\n".join([header, *rows, ""]).encode()


ROW = "2026-05-01T12:00:00Z,3.1"

NEXT = "2026-05-01T12:00:01Z,3.2"


def zipped(content: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("wind.csv", content)
    return buffer.getvalue()


REFUSED = [
    case("empty", content=b"", error=InputError, says="empty"),
    case("only-newlines", content=b"\n\n\n", error=InputError, says="known format"),
    case("only-nul", content=b"\x00" * 4096, error=InputError, says="NUL"),
    case("one-byte", content=b"x", error=InputError, says="known format"),
    case("gzip-cut-off", content=gzip.compress(csv(ROW))[:-9], error=InputError, says="gunzip"),
    case("gzip-of-nul", content=gzip.compress(b"\x00" * 20000000), error=InputError, says="NUL"),
    case(
        "gzip-bomb",
        content=gzip.compress(csv(*[ROW] * 40_000)),
        error=LimitError,
        says="unpacks to more than",
        options={"limits": Limits(size=1_000_000)},
    ),
    case("zip", content=zipped(csv(ROW)), error=InputError, says="zip archive"),
    case("zip-bomb", content=zipped(b"0" * 20000000), error=InputError, says="zip archive"),
    case("empty-zip", content=b"PK\x05\x06" + bytes(18), error=InputError, says="empty zip"),
    case("xz", content=b"\xfd7zXZ\x00" + bytes(20), error=InputError, says="xz"),
    case("bzip2", content=b"BZh91AY&SY" + bytes(20), error=InputError, says="bzip2"),
    case("7z", content=b"7z\xbc\xaf'\x1c" + bytes(20), error=InputError, says="7-Zip"),
    case("zstd", content=b"(\xb5/\xfd" + bytes(20), error=InputError, says="zstd"),
    case(
        "excel-97",
        content=b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500),
        error=InputError,
        says="Excel",
    ),
    case("pdf", content=b"%PDF-1.7\n", error=InputError, says="PDF"),
    case("png", content=b"\x89PNG\r\n\x1a\n" + bytes(50), error=InputError, says="PNG"),
    case("jpeg", content=b"\xff\xd8\xff\xe0" + bytes(50), error=InputError, says="JPEG"),
    case("mp4", content=b"\x00\x00\x00\x18ftypmp42" + bytes(50), error=InputError, says="video"),
    case("avi", content=b"RIFF\x00\x00\x00\x00AVI " + bytes(50), error=InputError, says="video"),
    case("matroska", content=b"\x1aE\xdf\xa3" + bytes(50), error=InputError, says="video"),
    case("mpeg-ts", content=(b"G" + bytes(187)) * 4, error=InputError, says="video"),
    case("avchd", content=(bytes(4) + b"G" + bytes(187)) * 4, error=InputError, says="video"),
    case(
        "mcap",
        content=b"\x89MCAP0\r\n" + bytes(50),
        error=CorruptError,
        says="MCAP file is damaged",
    ),
    case("parquet", content=b"PAR1" + bytes(50), error=InputError, says="Parquet"),
    case("hdf5", content=b"\x89HDF\r\n\x1a\n" + bytes(50), error=InputError, says="HDF5"),
    case("sqlite", content=b"SQLite format 3\x00" + bytes(50), error=InputError, says="SQLite"),
    case("tob1", content=b'"TOB1","st","CR3000"\r\n' + bytes(50), error=InputError, says="TOA5"),
    case(
        "noise",
        content=bytes(np.random.default_rng(1).integers(0, 256, 5000, dtype=np.uint8)),
        error=InputError,
    ),
    case(
        "utf16-without-mark",
        content=csv(ROW).decode().encode("utf-16-le"),
        error=InputError,
        says="utf-16-le",
    ),
    case(
        "utf16-cut-in-a-unit",
        content=csv(ROW, NEXT).decode().encode("utf-16") + b"\x00",
        error=InputError,
    ),
    case(
        "prose",
        content=b"The wind blew all day.\nThen it stopped.\n",
        error=InputError,
        says="recipe",
    ),
    case("json", content=b'{"time": 1, "wind_speed": 3}\n', error=OpenFactsError, says="unit of"),
    case("html", content=b"<!doctype html><html><body>404</body></html>\n", error=InputError),
    case("toml", content=b'[file]\ndelimiter = ","\n', error=InputError),
    case("numbers-without-header", content=b"1 2 3\n4 5 6\n", error=FlagdataError),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)
