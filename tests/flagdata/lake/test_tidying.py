"""Every change tidies the catalog, so that a fresh reader opens few files, however it was
filled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, Log, catalog, clone, transfer
from flagdata.lake.rowfiles import RowFiles
from tests.flagdata.lake.conftest import put_text
from tests.flagdata.lake.test_transfer import no_bar

EVERY = 4
MANY = 24


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", EVERY)


def opened(lake: Lake, monkeypatch: pytest.MonkeyPatch) -> tuple[int, int]:
    """How many entries of the log, and files of rows, a fresh process reads to list the rows of
    main."""
    entries: list[int] = []
    files: list[str] = []
    of_one, of_file = Log._read, RowFiles.read
    with monkeypatch.context() as patch:
        patch.setattr(
            Log, "_read", lambda self, version: entries.append(version) or of_one(self, version)
        )
        patch.setattr(
            RowFiles, "read", lambda self, name: files.append(name) or of_file(self, name)
        )
        Lake.open(lake.path).rows()
    return len(entries), len(files)


def label(lake: Lake, number: int) -> None:
    lake.label(lake.rows()["artifact"].to_pylist()[:1], {"n": number}, "again")


def withdraw(lake: Lake, number: int) -> None:
    lake.withdraw([lake.rows()["artifact"][-1].as_py()], f"wrong {number}")


def name(lake: Lake, number: int) -> None:
    lake.tag(f"v{number}")


def remake(lake: Lake, number: int) -> None:
    lake.branch("side")
    lake.delete_branch("side", f"again {number}")


def merge(lake: Lake, number: int) -> None:
    lake.label(lake.rows(at="b")["artifact"].to_pylist()[:1], {"n": number}, "there", branch="b")
    lake.merge("b", "again")


@pytest.mark.parametrize("change", [label, withdraw, name, remake, merge])
def test_a_lake_of_many_changes_is_read_from_few_files(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, change: Callable[[Lake, int], None]
) -> None:
    with lake.transaction("all") as tx:
        for number in range(MANY + 2):
            tx.add(Artifact(kind=Kind.WIND, name=f"wind {number}", recipe={"number": number}))
    lake.branch("b")
    for number in range(MANY):
        change(lake, number)
    entries, files = opened(lake, monkeypatch)
    assert entries <= 2 * EVERY
    assert files <= 2 * EVERY


def test_a_commit_of_notes_adds_no_file(lake: Lake) -> None:
    one = put_text(lake, "one")
    before = set((lake.path / "catalog").glob("*.parquet"))
    lake.label([one.id], {"n": 1}, "a note")
    lake.tag("v1")
    lake.branch("b")
    lake.delete_tag("v1")
    assert set((lake.path / "catalog").glob("*.parquet")) == before
    assert lake.rows(at="b")["name"].to_pylist() == ["one"]


@pytest.mark.disk("it makes clones on a disk")
def test_a_clone_is_summarised_and_has_no_version_of_its_own(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "one")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    for number in range(MANY):
        label(lake, number)
    transfer(lake, copy, bars=no_bar)
    assert copy.catalog.head() == lake.catalog.head()
    assert opened(copy, monkeypatch)[0] <= EVERY
    label(lake, MANY)
    assert transfer(lake, copy, bars=no_bar).head == lake.catalog.head()
