"""What a user of the lake relies on: rows and objects appear together, once, and are found
again."""

from __future__ import annotations

import shutil
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.core.schema import Kind, catalog_schema
from flagdata.errors import ConflictError, NotFoundError, UsageError
from flagdata.lake import Artifact, Lake, doctor, object_names, verify
from tests.flagdata.lake.conftest import put_text


def test_a_committed_row_and_its_object_are_found_by_a_fresh_handle(lake: Lake) -> None:
    identity = put_text(lake, "gusts").id
    again = Lake.open(lake.path)
    artifact = again.artifact(identity[:8])
    assert artifact.name == "gusts"
    assert artifact.id == identity
    assert artifact.object is not None
    assert again.object_path(artifact.object).read_text() == "gusts"
    assert artifact.object_bytes == len("gusts")
    assert again.rows().schema.equals(catalog_schema(), check_metadata=True)


def test_an_exception_inside_the_block_publishes_nothing(lake: Lake) -> None:
    def fail_half_way() -> None:
        with lake.transaction("half") as tx:
            path = tx.staging(".mcap")
            path.write_text("x")
            tx.add(Artifact(kind=Kind.WIND, name="x", object=tx.put(path)))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert lake.rows().num_rows == 0
    assert [p.name for p in lake.staging.iterdir() if p.is_dir()] == []


def test_a_transaction_is_of_no_use_outside_its_block(lake: Lake) -> None:
    with lake.transaction("nothing") as tx:
        pass
    assert tx.result is not None
    assert (tx.result.commit, tx.result.added) == (None, ())
    for use in (
        lambda: tx.staging(".mcap"),
        lambda: tx.put(lake.path),
        lambda: lake.transaction(" "),
    ):
        with pytest.raises(UsageError):
            use()
    with pytest.raises(NotFoundError), lake.transaction("nowhere", branch="nope"):
        pass


def test_the_same_identity_is_published_once(lake: Lake) -> None:
    first = put_text(lake, "gusts")
    before = lake.resolve(None)
    assert put_text(lake, "gusts") == first
    assert lake.resolve(None) == before
    assert lake.rows().num_rows == 1


def test_a_tag_keeps_showing_what_it_named(lake: Lake) -> None:
    put_text(lake, "a")
    lake.tag("v1")
    put_text(lake, "b")
    assert lake.rows(at="v1", columns=["name"]).to_pylist() == [{"name": "a"}]
    assert lake.rows(columns=["name"]).to_pylist() == [{"name": "a"}, {"name": "b"}]
    with pytest.raises(ConflictError):
        lake.tag("v1")


def test_a_branch_shows_its_base_and_its_own_rows_and_main_does_not_see_them(lake: Lake) -> None:
    put_text(lake, "a")
    lake.branch("try")
    put_text(lake, "b")
    put_text(lake, "c", branch="try")
    assert [r["name"] for r in lake.rows(at="try").to_pylist()] == ["a", "c"]
    assert [r["name"] for r in lake.rows().to_pylist()] == ["a", "b"]


def test_a_filter_selects_by_sql_and_a_bad_one_is_a_usage_error(lake: Lake) -> None:
    put_text(lake, "a")
    put_text(lake, "b")
    assert lake.rows("name = 'b' and \"end\" is null")["name"].to_pylist() == ["b"]
    for bad in (
        "nmae = 'b'",
        "1=1) union select 1",
        "name = 'b'; drop table x",
        "",
        "exists (from read_csv('/etc/passwd'))",
    ):
        with pytest.raises(UsageError):
            lake.rows(bad)


def test_unknown_refs_are_refused_with_the_nearest_name(lake: Lake) -> None:
    lake.tag("release-1")
    with pytest.raises(NotFoundError, match="release-1"):
        lake.rows(at="relase-1")
    with pytest.raises(NotFoundError):
        lake.rows(at="99")


def test_a_row_whose_object_was_never_put_is_refused(lake: Lake) -> None:
    with pytest.raises(NotFoundError), lake.transaction("dangling") as tx:
        tx.add(Artifact(kind=Kind.WIND, name="x", object="mcap/" + "0" * 64))


def test_a_merge_brings_a_branch_s_own_rows_to_main_once(lake: Lake) -> None:
    base = put_text(lake, "base")
    lake.branch("try")
    put_text(lake, "made on try", branch="try", parents=(base.id,))
    put_text(lake, "on both")
    put_text(lake, "on both", branch="try")
    result = lake.merge("try", "it worked")
    assert (len(result.added), len(result.existing)) == (1, 1)
    assert lake.rows()["name"].to_pylist() == ["base", "on both", "made on try"]
    again = lake.merge("try", "once more")
    assert (again.added, again.commit) == ((), None)
    for pair in (("main", "main"), ("try", "try")):
        with pytest.raises(UsageError):
            lake.merge(pair[0], "no", into=pair[1])
    with pytest.raises(NotFoundError):
        lake.merge("other", "no")


def test_a_merge_brings_all_that_the_branch_shows_what_it_began_from_too(lake: Lake) -> None:
    lake.branch("one")
    parent = put_text(lake, "parent", branch="one")
    lake.branch("two", at="one")
    put_text(lake, "child", branch="two", parents=(parent.id,))
    assert len(lake.merge("two", "both").added) == 2
    assert lake.rows()["name"].to_pylist() == ["parent", "child"]
    assert lake.merge("one", "nothing is left of it").commit is None


def test_a_merge_brings_parents_and_children_whatever_begins_earlier(lake: Lake) -> None:
    lake.branch("try")
    wind = Artifact(kind=Kind.WIND, name="log", start=200, end=300)
    recording = Artifact(
        kind=Kind.RECORDING, name="made of it", start=100, end=300, parents=(wind.id,)
    )
    with lake.transaction("both", branch="try") as tx:
        tx.add(wind)
        tx.add(recording)
    assert lake.rows(at="try")["name"].to_pylist() == ["made of it", "log"]
    assert len(lake.merge("try", "it worked").added) == 2
    assert lake.rows()["name"].to_pylist() == ["made of it", "log"]


def test_threads_that_share_a_lake_lose_no_row_and_repeat_none(lake: Lake) -> None:
    texts = [f"{i}" for i in range(12)] * 3
    with ThreadPoolExecutor(max_workers=6) as pool:
        ids = {artifact.id for artifact in pool.map(lambda text: put_text(lake, text), texts)}
    assert len(ids) == 12
    assert sorted(lake.rows()["artifact"].to_pylist()) == sorted(ids)


@pytest.mark.disk("a folder of a bucket is put file by file, and is whole with its `.sums`")
def test_a_folder_that_another_writer_publishes_in_the_same_moment_is_kept_once(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    rename = Path.rename
    raced: list[Path] = []

    def after_the_other(path: Path, target: Path) -> Path:
        if target.parent.name == "zarr" and not raced:
            raced.append(target)
            shutil.copytree(path, target)
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", after_the_other)
    with lake.transaction("ingest a folder") as tx:
        staged = tx.staging(".zarr")
        (staged / "time").mkdir(parents=True)
        (staged / "time" / "0").write_bytes(b"one")
        name = tx.put(staged)
        tx.add(Artifact(kind=Kind.WIND, name="a folder", object=name, source_hash="0" * 64))
    assert raced == [lake.object_path(name)]
    assert verify(lake, object_names(lake)) == ()
    assert doctor(lake, grace=timedelta(0)) == ()
