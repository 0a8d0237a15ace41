"""Parquet tables and NumPy archives are read only where what they hold can be held, whatever their
size."""

from __future__ import annotations

import io
import shutil
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flagdata.core import arrays
from flagdata.core.arrays import read_arrays
from flagdata.core.files import bounded_parquet
from flagdata.core.files.bounded_parquet import read_parquet
from flagdata.errors import CorruptError, FlagdataError, LimitError
from flagdata.lake import Lake
from measure.nulls import bank
from tests.compat.make_lake import fill

MEMORY = 64 << 20  # far less than any of these takes, whole


def _zeros(path: Path, *, rows: int) -> Path:
    """Many rows in few bytes."""
    with pq.ParquetWriter(path, pa.schema([("a", pa.int64())]), compression="zstd") as writer:
        block = pa.table({"a": np.zeros(1_000_000, dtype=np.int64)})
        for _ in range(rows // 1_000_000):
            writer.write_table(block)
    return path


def _one_long_text(path: Path) -> Path:
    """A dictionary of one text of a megabyte, which two hundred rows name."""
    text = pa.array(["y" * 1_000_000])
    pq.write_table(pa.table({"a": text.take(pa.array(np.zeros(200, dtype=np.int64)))}), path)
    return path


def test_a_table_that_states_more_rows_than_can_be_held_is_refused_before_it_is_read(
    tmp_path: Path,
) -> None:
    path = _zeros(tmp_path / "a.parquet", rows=40_000_000)
    assert path.stat().st_size < 1 << 20
    before = pa.total_allocated_bytes()
    with pytest.raises(LimitError, match="40000000 rows"):
        read_parquet(path)
    assert pa.total_allocated_bytes() == before


def test_a_long_text_that_many_rows_name_is_refused_when_its_rows_are_too_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounded_parquet, "_BATCH", 16)
    monkeypatch.setattr(bounded_parquet, "HELD", MEMORY)
    with pytest.raises(LimitError, match="take more than"):
        read_parquet(_one_long_text(tmp_path / "a.parquet"))


def test_a_table_is_read_as_pyarrow_reads_it(tmp_path: Path) -> None:
    table = pa.table(
        {"a": list(range(2000)), "b": [[k] * (k % 3) for k in range(2000)], "c/d": ["x"] * 2000}
    )
    pq.write_table(table, tmp_path / "a.parquet")
    assert read_parquet(tmp_path / "a.parquet").equals(table)
    assert read_parquet(tmp_path / "a.parquet", ["c/d", "a"]).equals(table.select(["c/d", "a"]))
    pq.write_table(table.slice(0, 0), tmp_path / "none.parquet")
    assert read_parquet(tmp_path / "none.parquet", ["a"]).equals(table.select(["a"]).slice(0, 0))
    with pytest.raises(pa.ArrowInvalid, match="no column e"):
        read_parquet(tmp_path / "a.parquet", ["a", "e"])


def test_a_lake_whose_rows_state_more_than_can_be_held_is_refused(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    fill(lake)
    victim = max((lake.path / "catalog").glob("*.parquet"), key=lambda path: path.stat().st_mtime)
    shutil.copy(_zeros(tmp_path / "a.parquet", rows=40_000_000), victim)
    before = pa.total_allocated_bytes()
    with pytest.raises(FlagdataError):
        Lake.open(lake.path).scan(Lake.open(lake.path).view(None))
    assert pa.total_allocated_bytes() - before < MEMORY


def _zipped(path: Path, size: int) -> Path:
    """An archive of one array of zeros."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "|u1", "fortran_order": False, "shape": (size,)}
    )
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.npy", "w") as member,
    ):
        member.write(head.getvalue())
        for _ in range(size >> 20):
            member.write(bytes(1 << 20))
    return path


@pytest.mark.parametrize(
    "read",
    [lambda path: read_arrays(path, what="an archive", fix="copy it again"), bank._content],
    ids=["any", "bank"],
)
def test_an_archive_that_unpacks_to_more_than_can_be_held_is_refused(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    path = _zipped(tmp_path / "a.npz", arrays.HELD + (1 << 20))
    tracemalloc.start()
    with pytest.raises(LimitError, match="unpacks to"):
        read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < MEMORY


def test_an_archive_that_is_none_is_corrupt(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", a=np.arange(1000), b=np.array("x"))
    whole = (tmp_path / "a.npz").read_bytes()
    assert read_arrays(tmp_path / "a.npz", what="it", fix="f")["a"].sum() == 499_500
    for wrong in (b"", whole[:-30], whole[:60] + bytes(40) + whole[100:], b"PK\3\4" + bytes(100)):
        (tmp_path / "a.npz").write_bytes(wrong)
        with pytest.raises(CorruptError, match="it cannot be read"):
            read_arrays(tmp_path / "a.npz", what="it", fix="f")
    np.savez(tmp_path / "a.npz", a=np.array([{}], dtype=object))  # type: ignore[arg-type]
    with pytest.raises(CorruptError, match="it cannot be read"):
        read_arrays(tmp_path / "a.npz", what="it", fix="f")
