"""Files that are no text log at all: an error with place and fix, or samples flagged and findings with numbers."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError, LimitError
from flagdata.ingest.anemometer import Limits
from flagdata.ingest.anemometer.draft.questions import OpenFactsError

Check = Callable[..., None]


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
    pytest.param({"content": b"", "error": InputError, "says": "empty"}, id="empty"),
    pytest.param({"content": b"\n\n\n", "error": InputError, "says": "known format"}, id="only-newlines"),
    pytest.param({"content": b"\x00" * 4096, "error": InputError, "says": "NUL"}, id="only-nul"),
    pytest.param({"content": b"x", "error": InputError, "says": "known format"}, id="one-byte"),
    pytest.param({"content": gzip.compress(csv(ROW))[:-9], "error": InputError, "says": "gunzip"}, id="gzip-cut-off"),
    pytest.param({"content": gzip.compress(b"\x00" * 20000000), "error": InputError, "says": "NUL"}, id="gzip-of-nul"),
    pytest.param(
        {
            "content": gzip.compress(csv(*[ROW] * 40_000)),
            "error": LimitError,
            "says": "unpacks to more than",
            "options": {"limits": Limits(size=1_000_000)},
        },
        id="gzip-bomb",
    ),
    pytest.param({"content": zipped(csv(ROW)), "error": InputError, "says": "zip archive"}, id="zip"),
    pytest.param({"content": zipped(b"0" * 20000000), "error": InputError, "says": "zip archive"}, id="zip-bomb"),
    pytest.param({"content": b"PK\x05\x06" + bytes(18), "error": InputError, "says": "empty zip"}, id="empty-zip"),
    pytest.param({"content": b"\xfd7zXZ\x00" + bytes(20), "error": InputError, "says": "xz"}, id="xz"),
    pytest.param({"content": b"BZh91AY&SY" + bytes(20), "error": InputError, "says": "bzip2"}, id="bzip2"),
    pytest.param({"content": b"7z\xbc\xaf'\x1c" + bytes(20), "error": InputError, "says": "7-Zip"}, id="7z"),
    pytest.param({"content": b"(\xb5/\xfd" + bytes(20), "error": InputError, "says": "zstd"}, id="zstd"),
    pytest.param(
        {"content": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500), "error": InputError, "says": "Excel"},
        id="excel-97",
    ),
    pytest.param({"content": b"%PDF-1.7\n", "error": InputError, "says": "PDF"}, id="pdf"),
    pytest.param({"content": b"\x89PNG\r\n\x1a\n" + bytes(50), "error": InputError, "says": "PNG"}, id="png"),
    pytest.param({"content": b"\xff\xd8\xff\xe0" + bytes(50), "error": InputError, "says": "JPEG"}, id="jpeg"),
    pytest.param({"content": b"\x00\x00\x00\x18ftypmp42" + bytes(50), "error": InputError, "says": "video"}, id="mp4"),
    pytest.param({"content": b"RIFF\x00\x00\x00\x00AVI " + bytes(50), "error": InputError, "says": "video"}, id="avi"),
    pytest.param({"content": b"\x1aE\xdf\xa3" + bytes(50), "error": InputError, "says": "video"}, id="matroska"),
    pytest.param({"content": (b"G" + bytes(187)) * 4, "error": InputError, "says": "video"}, id="mpeg-ts"),
    pytest.param({"content": (bytes(4) + b"G" + bytes(187)) * 4, "error": InputError, "says": "video"}, id="avchd"),
    pytest.param({"content": b"\x89MCAP0\r\n" + bytes(50), "error": InputError, "says": "MCAP"}, id="mcap"),
    pytest.param({"content": b"PAR1" + bytes(50), "error": InputError, "says": "Parquet"}, id="parquet"),
    pytest.param({"content": b"\x89HDF\r\n\x1a\n" + bytes(50), "error": InputError, "says": "HDF5"}, id="hdf5"),
    pytest.param({"content": b"SQLite format 3\x00" + bytes(50), "error": InputError, "says": "SQLite"}, id="sqlite"),
    pytest.param({"content": b'"TOB1","st","CR3000"\r\n' + bytes(50), "error": InputError, "says": "TOA5"}, id="tob1"),
    pytest.param(
        {"content": bytes(np.random.default_rng(1).integers(0, 256, 5000, dtype=np.uint8)), "error": InputError},
        id="noise",
    ),
    pytest.param(
        {"content": csv(ROW).decode().encode("utf-16-le"), "error": InputError, "says": "utf-16-le"},
        id="utf16-without-mark",
    ),
    pytest.param(
        {"content": csv(ROW, NEXT).decode().encode("utf-16") + b"\x00", "error": InputError}, id="utf16-cut-in-a-unit"
    ),
    pytest.param(
        {"content": b"The wind blew all day.\nThen it stopped.\n", "error": InputError, "says": "recipe"}, id="prose"
    ),
    pytest.param({"content": b'{"time": 1, "wind_speed": 3}\n', "error": OpenFactsError, "says": "unit of"}, id="json"),
    pytest.param({"content": b"<!doctype html><html><body>404</body></html>\n", "error": InputError}, id="html"),
    pytest.param({"content": b'[file]\ndelimiter = ","\n', "error": InputError}, id="toml"),
    pytest.param({"content": b"1 2 3\n4 5 6\n", "error": FlagdataError}, id="numbers-without-header"),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any], check_refused: Check) -> None:
    check_refused(**case)
