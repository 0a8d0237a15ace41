"""Versions move between lakes as they are: a tag means the same in a clone, and nothing is moved
twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.core.files.object_cache import forget
from flagdata.errors import ConflictError, CorruptError
from flagdata.lake import (
    Lake,
    clone,
    collect,
    doctor,
    object_names,
    transfer,
    verify,
    verify_catalog,
)
from tests.flagdata.lake.conftest import overwrite, put_older_ref, put_text
from tests.program import invoke

NOW = timedelta(0)


@contextmanager
def no_bar(total: int, label: str, unit: str) -> Iterator[Callable[[int], None]]:
    yield lambda done: None


def is_whole(lake: Lake) -> bool:
    return (
        *doctor(lake, grace=NOW),
        *verify(lake, object_names(lake)),
        *verify_catalog(lake),
    ) == ()


def test_a_clone_has_the_versions_tags_and_branches_of_its_source(
    lake: Lake, tmp_path: Path
) -> None:
    first = put_text(lake, "first")
    lake.tag("v1")
    lake.branch("side")
    put_text(lake, "second", branch="side")
    put_text(lake, "third")
    lake.withdraw([first.id], "wrong")
    copy, done = clone(lake, tmp_path / "copy", bars=no_bar)
    assert (done.head, done.versions) == (lake.catalog.head(), lake.catalog.head())
    assert len(done.objects) == 3
    for at in (None, "v1", "side", "1", lake.catalog.history()[1]["commit"]):
        assert copy.rows(at=at).equals(lake.rows(at=at))
    assert [entry["message"] for entry in copy.catalog.history()] == [
        e["message"] for e in lake.catalog.history()
    ]
    assert is_whole(copy)


def test_what_was_moved_before_is_not_moved_again(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "first")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    later = put_text(lake, "second")
    lake.tag("v2")
    done = transfer(lake, copy, bars=no_bar)
    assert (done.versions, done.objects, done.size, done.refs) == (
        2,
        (later.object,),
        len("second"),
        ("v2",),
    )
    again = transfer(lake, copy, bars=no_bar)
    assert (again.versions, again.objects, again.refs) == (0, (), ())
    assert copy.rows(at="v2").equals(lake.rows(at="v2"))


def test_commits_of_a_clone_are_pushed_back(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "first")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    put_text(copy, "second")
    transfer(copy, lake, bars=no_bar)
    assert lake.rows().equals(copy.rows())
    assert is_whole(lake)


def test_a_transfer_that_was_stopped_goes_on(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for text in ("first", "second", "third"):
        put_text(lake, text)
    lake.tag("v1")
    whole, seen = lake.objects.whole, []

    def stopped(name: str) -> Path:
        seen.append(name)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return whole(name)

    monkeypatch.setattr(lake.objects, "whole", stopped)
    with pytest.raises(KeyboardInterrupt):
        clone(lake, tmp_path / "copy", bars=no_bar)
    monkeypatch.undo()
    copy = Lake.open(tmp_path / "copy")
    assert copy.rows().num_rows == 0
    done = transfer(lake, copy, bars=no_bar)
    assert len(done.objects) == 1  # two were there
    assert copy.rows(at="v1").equals(lake.rows(at="v1"))
    assert is_whole(copy)


def test_a_log_that_names_a_file_outside_its_folder_is_damaged(lake: Lake) -> None:
    put_text(lake, "first")
    head = lake.catalog.head()
    stored, files = lake.catalog.entry(head)
    (name,) = files
    entry = lake.path / "catalog" / "_delta_log" / f"{head:020d}.json"
    for wrong in (f"../{name}", f"/tmp/{name}", ".."):
        entry.write_bytes(stored.replace(name.encode(), wrong.encode()))
        with pytest.raises(CorruptError, match="is damaged"):
            lake.catalog.entry(head)


def test_lakes_that_went_apart_are_refused_and_stay_as_they_are(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "first")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    put_text(lake, "here")
    put_text(copy, "there")
    for one, other in ((lake, copy), (copy, lake)):
        with pytest.raises(ConflictError, match="versions that the other lacks"):
            transfer(one, other, bars=no_bar)
    assert copy.rows()["name"].to_pylist() == ["first", "there"]
    with pytest.raises(ConflictError, match="no history"):
        transfer(lake, Lake.create(tmp_path / "another"), bars=no_bar)


def test_a_tag_of_the_same_name_that_is_another_is_refused(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "first")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    put_older_ref(copy, "tags", "v1")
    put_text(lake, "second")
    lake.tag("v1")
    with pytest.raises(ConflictError, match="tag 'v1'"):
        transfer(lake, copy, bars=no_bar)
    assert copy.rows().num_rows == 1


def test_a_tag_of_a_clone_is_a_commit_of_the_clone(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "first")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    copy.tag("v1")
    assert transfer(copy, lake, bars=no_bar).refs == ("v1",)
    assert lake.refs.tags() == copy.refs.tags()
    put_text(lake, "second")
    copy.tag("v2")
    with pytest.raises(ConflictError, match="versions that the other lacks"):
        transfer(lake, copy, bars=no_bar)


def test_a_tag_that_was_deleted_goes_from_the_clone_too(lake: Lake, tmp_path: Path) -> None:
    put_text(lake, "first")
    lake.tag("v1")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    lake.delete_tag("v1")
    transfer(lake, copy, bars=no_bar)
    assert copy.refs.tags() == {}


def test_a_damaged_object_is_not_moved(lake: Lake, tmp_path: Path) -> None:
    place = lake.objects.path(name := str(put_text(lake, "first").object))
    overwrite(place, b"furst")
    forget(name, place.suffix)  # of a lake in a bucket this machine keeps a sound copy
    with pytest.raises(CorruptError):
        clone(lake, tmp_path / "copy", bars=no_bar)
    assert Lake.open(tmp_path / "copy").rows().num_rows == 0


@pytest.mark.disk("it clones a lake on a disk to a bucket")
def test_a_lake_is_cloned_to_a_bucket_and_back(
    lake: Lake, bucket_folder: str, tmp_path: Path
) -> None:
    put_text(lake, "first")
    lake.tag("v1")
    assert invoke("clone", lake.path, bucket_folder, "--json").document["refs"] == ["v1"]
    later = put_text(lake, "second")
    pushed = invoke("push", bucket_folder, "--lake", lake.path, "--json").document
    assert (pushed["versions"], pushed["objects"]) == (1, [later.object])
    assert invoke("clone", bucket_folder, tmp_path / "back").code == 0
    back = Lake.open(tmp_path / "back")
    assert back.rows().equals(lake.rows())
    assert back.rows(at="v1").equals(lake.rows(at="v1"))
    assert is_whole(back)
    put_text(Lake.open(bucket_folder), "third")
    assert invoke("pull", bucket_folder, "--lake", back.path, "--json").document["versions"] == 1
    assert collect(Lake.open(bucket_folder), grace=NOW).objects == ()


def test_a_lake_of_which_something_was_erased_is_cloned_without_it(
    lake: Lake, tmp_path: Path
) -> None:
    gone, kept = put_text(lake, "gone"), put_text(lake, "kept")
    lake.tag("v1")
    lake.erase([gone.id], "consent withdrawn")
    copy, done = clone(lake, tmp_path / "copy", bars=no_bar)
    assert done.objects == (kept.object,)
    assert copy.rows(at="v1").equals(lake.rows(at="v1"))
