"""Arrow's threads are given memory of Arrow's own: what belongs to Python they can let go only
while Python runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from flagdata.core.files.buffers import own_copy
from flagdata.ingest import ingest_wind
from flagdata.lake import Lake


@pytest.mark.parametrize("data", [b"", b"abc", bytes(range(256)) * 1000])
def test_the_bytes_are_copied_and_their_object_is_let_go(data: bytes) -> None:
    data = bytes(bytearray(data)) or data
    before = sys.getrefcount(data)
    content = own_copy(data)
    assert content.to_pybytes() == data
    assert content.size == len(data)
    if data:
        assert sys.getrefcount(data) == before
        held = pa.py_buffer(data)
        assert sys.getrefcount(data) > before
        del held


def test_rows_of_logs_and_of_catalogs_are_read_from_memory_of_arrows_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, given = pa.BufferReader, []

    def reader(content: Any) -> Any:
        given.append(content)
        return plain(content)

    monkeypatch.setattr(pa, "BufferReader", reader)
    lines = (f"2026-05-01T12:00:{k:02d}Z,{5 + k % 7 / 10}" for k in range(60))
    (tmp_path / "a.csv").write_text("\n".join(["time,wind_speed (m/s)", *lines, ""]))
    ingest_wind(Lake.create(tmp_path / "lake"), tmp_path / "a.csv")
    logs = len(given)
    assert logs
    assert Lake.open(tmp_path / "lake").artifact("a").name == "a"
    assert len(given) > logs
    # Arrow may write into its own memory, and not into that of bytes.
    assert all(isinstance(content, pa.Buffer) and content.is_mutable for content in given)
