"""Summaries of the log: a fresh process reads few files, and never what the log does not state."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from flagdata.core.schema import catalog_schema
from flagdata.errors import CorruptError
from flagdata.lake import Lake, Log, catalog, log_summaries
from tests.flagdata.lake.conftest import overwrite

EVERY = 4


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", EVERY)
    monkeypatch.setattr(log_summaries, "_MANY", 3)
    monkeypatch.setattr(log_summaries, "_LARGE", 6 * EVERY)


def commit(lake: Lake, versions: int, message: str) -> None:
    """Versions that add nothing, until there are so many."""
    while lake.catalog.head() < versions:
        lake.catalog.tidy()
        info = {"message": f"{message} {lake.catalog.head() + 1}", "branch": "main"}
        lake.catalog.append(catalog_schema().empty_table(), base=lake.catalog.head(), info=info)


def stated(lake: Lake) -> list[dict[str, Any]]:
    """What a process that finds no summary reads of the log's own entries, newest first."""
    log = lake.catalog._entries
    versions = range(lake.catalog.head() + 1)
    return [
        lake.catalog._version_entry(*pair)
        for pair in zip(versions, log.entries(versions, head=-1), strict=True)
    ][::-1]


def test_a_fresh_process_reads_the_history_in_few_files(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    commit(lake, 50, "version")
    files = [path.name for path in (lake.path / "refs" / "history").iterdir()]
    assert len(files) <= 2 + 3
    read: list[int] = []
    of_one = Log._read
    monkeypatch.setattr(
        Log, "_read", lambda self, version: read.append(version) or of_one(self, version)
    )
    found = Lake.open(lake.path).catalog.history()
    assert len(read) <= EVERY
    assert found == stated(lake)
    assert [entry["version"] for entry in found] == list(range(lake.catalog.head(), -1, -1))


@pytest.mark.disk("it puts an older copy of files in place")
def test_a_log_that_was_restored_and_went_on_otherwise_is_read_as_it_is(
    lake: Lake, tmp_path: Path
) -> None:
    assert isinstance(lake.path, Path)
    commit(lake, 10, "before")
    kept = ("catalog", "refs/newest")
    for name in kept:
        shutil.copytree(lake.path / name, tmp_path / "copy" / name)
    commit(lake, 22, "lost")
    for name in kept:
        shutil.rmtree(lake.path / name)
        shutil.copytree(tmp_path / "copy" / name, lake.path / name)
    for versions in (10, 11, 16, 22, 30):
        commit(Lake.open(lake.path), versions, "after")
        found = Lake.open(lake.path).catalog.history()
        assert found == stated(Lake.open(lake.path))
        assert not any(entry.get("message", "").startswith("lost") for entry in found)


def test_a_summary_that_has_changed_is_named_and_can_be_deleted(lake: Lake) -> None:
    commit(lake, 10, "version")
    expected = lake.catalog.history()
    path = min((lake.path / "refs" / "history").iterdir())  # type: ignore[type-var]
    overwrite(path, path.read_bytes().replace(b"version 1", b"version 7"))
    with pytest.raises(CorruptError, match="checksum is wrong") as caught:
        Lake.open(lake.path).catalog.history()
    assert caught.value.where == str(path)
    assert caught.value.fix is not None
    assert "delete it" in caught.value.fix
    path.unlink()
    assert Lake.open(lake.path).catalog.history() == expected
