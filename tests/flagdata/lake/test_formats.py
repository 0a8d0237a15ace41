"""What others see of a lake: its catalog is plain Delta, its hashes are sha256sum's, its folder may
be anywhere."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import time
from datetime import timedelta
from pathlib import Path

import polars as pl
import pytest
from deltalake import DeltaTable

from flagdata.core.files.checksums import content_hash
from flagdata.core.files.durable import HEAL
from flagdata.core.findings import Severity
from flagdata.core.json_values import json_values
from flagdata.core.schema import CATALOG, Kind
from flagdata.errors import ConflictError, CorruptError, UsageError
from flagdata.lake import Artifact, Lake, Log, collect, doctor, verify_catalog
from flagdata.lake.attempts import Moved
from flagdata.storage import RemotePath
from flagdata.storage.connection import settings
from tests.flagdata.lake.conftest import AGES, put_text


def test_polars_reads_the_catalog_as_a_delta_table(lake: Lake) -> None:
    for i in range(40):  # beyond the merge of small files
        put_text(lake, f"{i:02d}")
    options = settings() if isinstance(lake.path, RemotePath) else None
    frame = pl.read_delta(lake.catalog.path.as_uri(), storage_options=options)
    assert frame.columns == list(CATALOG)
    assert sorted(frame["name"].to_list()) == [f"{i:02d}" for i in range(40)]


def test_a_file_has_the_hash_that_sha256_publishes_for_it(tmp_path: Path) -> None:
    # FIPS 180-2, appendix B.1
    path = tmp_path / "abc"
    path.write_bytes(b"abc")
    assert content_hash(path) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="sha256sum is not installed")
def test_a_folder_has_the_hash_of_the_lines_that_sha256sum_prints(tmp_path: Path) -> None:
    folder = tmp_path / "object.zarr"
    for name in ("b/c/0", "b.json", "a", "é"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)
    (folder / "empty").mkdir()
    command = "find . -type f -printf '%P\\n' | LC_ALL=C sort | xargs -d '\\n' sha256sum"
    lines = subprocess.run(
        ["bash", "-c", command], cwd=folder, capture_output=True, check=True
    ).stdout
    assert content_hash(folder) == hashlib.sha256(lines).hexdigest()


@pytest.mark.parametrize("name", ["with blank", "50%", "a#b", "q?x=1", "ünïcode", "[set]", "file:"])
def test_a_lake_works_in_a_folder_of_any_name(tmp_path: Path, name: str) -> None:
    lake = Lake.create(tmp_path / name / "lake")
    put_text(lake, "a")
    lake.tag("v1")
    assert Lake.open(tmp_path / name / "lake").rows(at="v1")["name"].to_pylist() == ["a"]
    assert doctor(lake) == ()
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_folder_name_that_the_delta_library_would_decode_is_refused(tmp_path: Path) -> None:
    for make in (Lake.create, Lake.open):
        with pytest.raises(UsageError, match="percent"):
            make(tmp_path / "50%20" / "lake")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.disk("a bucket cannot rename; `clone` copies a lake")
def test_a_lake_that_is_moved_stays_whole(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "a")
    lake.path.rename(tmp_path / "elsewhere")
    moved = Lake.open(tmp_path / "elsewhere")
    put_text(moved, "b")
    assert moved.rows()["name"].to_pylist() == ["a", "b"]
    assert doctor(moved) == ()


def test_of_two_appends_at_one_version_the_second_fails_and_publishes_nothing(lake: Lake) -> None:
    put_text(lake, "a")
    base = lake.catalog.head()
    rows = lake.rows()
    first, second = Lake.open(lake.path).catalog, Lake.open(lake.path).catalog
    assert [second.head(), second.rows(base).num_rows] == [base, 1]
    assert first.append(rows, base=base, info={}) == base + 1
    with pytest.raises(Moved):
        second.append(rows, base=base, info={})
    assert second.head() == base + 1
    assert lake.catalog.unpublished_files() == []


def test_a_catalog_whose_protocol_another_program_raised_is_read_and_not_written(
    lake: Lake,
) -> None:
    """Delta: a writer must not write to a table that asks for a later writer version than it
    implements."""
    kept = put_text(lake, "before")
    raised = {"protocol": {"minReaderVersion": 1, "minWriterVersion": 4}}
    log = Log(lake.path / "catalog" / "_delta_log", lake.path / "refs" / "newest")
    assert log.put(2, [{"commitInfo": {"timestamp": 0, "operation": "UPGRADE PROTOCOL"}}, raised])
    assert lake.rows()["artifact"].to_pylist() == [kept.id]
    with pytest.raises(ConflictError, match="version 4 of Delta's protocol"):
        put_text(lake, "after")
    assert lake.catalog.head() == 2


def test_a_batch_of_rows_is_one_version_and_one_file(lake: Lake) -> None:
    before = lake.catalog.head()
    with lake.transaction("a batch") as tx:
        for i in range(1000):
            tx.add(Artifact(kind=Kind.MEASUREMENT, name=f"{i}", recipe={"i": i}))
    assert lake.catalog.head() == before + 1
    assert len(list((lake.path / "catalog").glob("*.parquet"))) == 1
    assert lake.rows().num_rows == 1000


def test_rows_come_in_the_order_of_commit_then_start_then_frame(lake: Lake) -> None:
    with lake.transaction("first") as tx:
        for start, frame in ((20, 0), (10, 30), (10, 0)):
            tx.add(
                Artifact(
                    kind=Kind.CLIP,
                    name=f"{start}-{frame}",
                    start=start,
                    frame_first=frame,
                    seed=start,
                )
            )
    with lake.transaction("second") as tx:
        tx.add(Artifact(kind=Kind.CLIP, name="5-0", start=5, frame_first=0))
    expected = ["10-0", "10-30", "20-0", "5-0"]
    assert lake.rows()["name"].to_pylist() == expected
    assert lake.rows("kind = 'clip'")["name"].to_pylist() == expected


def test_the_error_of_a_damaged_log_entry_names_it(lake: Lake) -> None:
    put_text(lake, "a")
    put_text(lake, "b")
    entry = lake.path / "catalog" / "_delta_log" / "00000000000000000001.json"
    entry.write_bytes(entry.read_bytes()[:100])
    fresh = Lake.open(lake.path)
    with pytest.raises(CorruptError) as caught:
        fresh.rows()
    assert json_values(caught.value) == {
        "kind": "corrupt",
        "what": f"the log entry {entry.name} is damaged",
        "where": str(entry),
        "fix": HEAL,
    }
    findings = doctor(fresh)
    assert not any("\n" in f.what for f in findings)
    assert {f.kind for f in findings} == {"log-damaged"}
    assert any(f.where == str(entry) for f in findings)


@pytest.mark.parametrize("version", [1, 2])
def test_an_emptied_or_altered_log_entry_stops_collection(lake: Lake, version: int) -> None:
    put_text(lake, "a")
    put_text(lake, "b")
    entry = lake.path / "catalog" / "_delta_log" / f"{version:020d}.json"
    content = entry.read_bytes()
    for damaged in (
        b"",
        content.replace(b'"add"', b'"adx"'),
        content.replace(b"ingest", b"jngest"),
    ):
        entry.write_bytes(damaged)
        fresh = Lake.open(lake.path)
        assert any(
            f.where == str(entry) and f.severity is Severity.ERROR for f in verify_catalog(fresh)
        )
        with pytest.raises(CorruptError) as caught:
            collect(fresh, grace=timedelta(0))
        assert caught.value.where == str(entry)
    entry.write_bytes(b"")
    with pytest.raises(CorruptError, match=entry.name):
        Lake.open(lake.path).rows()
    entry.write_bytes(content)
    assert verify_catalog(Lake.open(lake.path)) == ()


def test_an_empty_entry_that_a_power_cut_left_before_it_was_acknowledged_may_be_deleted_as_the_fix_says(
    lake: Lake,
) -> None:
    put_text(lake, "a")
    entry = lake.path / "catalog" / "_delta_log" / f"{2:020d}.json"
    entry.write_bytes(b"")
    with pytest.raises(CorruptError) as caught:
        Lake.open(lake.path).rows()
    assert "delete it" in caught.value.fix
    entry.unlink()
    put_text(lake, "b")
    assert lake.rows()["name"].to_pylist() == ["a", "b"]
    assert doctor(lake) == ()


@pytest.mark.disk(AGES)
def test_another_program_s_vacuum_takes_no_file_that_a_tag_needs(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    month = 30 * 86_400 * 10**9  # ns; Delta's default is to keep replaced files for a week
    now = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: now() - month)
    for i in range(40):
        put_text(lake, f"{i}")
        if i == 5:
            lake.tag("v1")
    monkeypatch.undo()
    for path in (lake.path / "catalog").glob("*.parquet"):
        os.utime(path, ns=(now() - month, now() - month))
    table = DeltaTable(str(lake.path / "catalog"))
    assert (
        len(table.file_uris()) < 20
    )  # the small files have been merged, so the first ones are not the head's
    assert table.vacuum(dry_run=False) == []
    assert Lake.open(lake.path).rows(at="v1").num_rows == 6
    assert doctor(lake) == ()
