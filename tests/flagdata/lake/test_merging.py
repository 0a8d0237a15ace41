"""Merging, withdrawing on a branch, deleting branches and tags: what a user of versions relies
on."""

from __future__ import annotations

import json
import weakref
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pyarrow as pa
import pytest

from flagdata.core.findings import Severity
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, CorruptError, NotFoundError, UsageError
from flagdata.export import Export, prepare
from flagdata.lake import Artifact, Lake, collect, doctor
from flagdata.lake.lineage import Removal
from flagdata.lake.marking import mark
from tests.flagdata.lake.conftest import put_text
from tests.program import Ended, invoke

NOW = timedelta(0)
DAY = timedelta(hours=24)


def names(lake: Lake, at: str | None = None) -> list[str]:
    return sorted(lake.rows(at=at)["name"].to_pylist())


def test_what_was_withdrawn_after_a_merge_stays_withdrawn_when_the_branch_is_merged_again(
    lake: Lake,
) -> None:
    put_text(lake, "base")
    lake.branch("b")
    a = put_text(lake, "A", branch="b")
    lake.merge("b", "first")
    lake.withdraw([a.id], "faces of people in it")
    c = put_text(lake, "C", branch="b")
    done = lake.merge("b", "second")
    assert (done.added, done.left_out, done.brought_back) == ((c.id,), {}, {})
    assert names(lake) == ["C", "base"]
    assert names(lake, "b") == ["A", "C", "base"]
    assert lake.merge("main", "bring b up to date", into="b").withdrawn == (a.id,)
    assert names(lake, "b") == ["C", "base"]


def test_a_merge_that_nothing_records_brings_nothing_back_either(lake: Lake) -> None:
    """As lakes have them that were written before merges were recorded: the same row was committed
    on both."""
    lake.branch("b")
    a = put_text(lake, "A", branch="b")
    put_text(lake, "A")
    lake.withdraw([a.id], "faces of people in it")
    done = lake.merge("b", "second")
    assert (done.added, done.left_out) == ((), {a.id: 4})
    assert names(lake) == []


def test_what_is_made_anew_after_it_was_withdrawn_comes_back_and_is_named(lake: Lake) -> None:
    a = put_text(lake, "A")
    lake.withdraw([a.id], "no")
    lake.branch("b")
    lake.branch("c", at="b")
    put_text(lake, "A")
    lake.withdraw([a.id], "no, not on main")
    put_text(lake, "A", branch="b")
    done = lake.merge("b", "it is right after all")
    assert (done.added, done.brought_back) == ((a.id,), {a.id: 6})
    assert names(lake) == ["A"]


def test_a_withdrawal_on_a_branch_hides_a_row_of_main_there_and_goes_to_main_with_a_merge(
    lake: Lake,
) -> None:
    wrong, right = put_text(lake, "wrong"), put_text(lake, "right")
    lake.branch("b")
    lake.withdraw([wrong.id], "to try the data without it", branch="b")
    lake.tag("tried", at="b")
    assert (names(lake), names(lake, "b")) == (["right", "wrong"], ["right"])
    put_text(lake, "wrong", branch="b")
    assert (names(lake, "b"), names(lake, "tried")) == (["right", "wrong"], ["right"])
    lake.withdraw([wrong.id], "again", branch="b")
    done = lake.merge("b", "it is better without")
    assert (done.added, done.withdrawn) == ((), (wrong.id,))
    assert names(lake) == ["right"]
    assert lake.artifact(right.id).name == "right"
    assert doctor(lake, grace=NOW)[0].kind == "orphan"  # which gc takes: no ref shows it any more


def test_what_a_branch_hides_keeps_its_object_for_the_grace_period(lake: Lake) -> None:
    artifact = put_text(lake, "a")
    lake.branch("b")
    lake.withdraw([artifact.id], "from main")
    lake.withdraw([artifact.id], "from b", branch="b")
    assert artifact.object in mark(lake, grace=DAY).objects
    assert mark(lake, grace=NOW).objects == frozenset()


def test_a_row_whose_parent_the_other_side_withdrew_is_a_conflict_that_names_both_and_publishes_nothing(
    lake: Lake,
) -> None:
    one, two = put_text(lake, "one"), put_text(lake, "two")
    lake.branch("b")
    put_text(lake, "made of one", branch="b", parents=(one.id,))
    lake.withdraw([one.id], "wrong")
    with pytest.raises(ConflictError, match="made of one") as caught:
        lake.merge("b", "no")
    assert f"flagdata withdraw {one.id} --with-descendants --branch b" in caught.value.fix
    lake.withdraw([two.id], "wrong", branch="b")
    put_text(lake, "made of two", parents=(two.id,))
    with pytest.raises(ConflictError, match="made of two") as caught:
        lake.merge("main", "no", into="b")
    before = lake.catalog.head()
    with pytest.raises(ConflictError):
        lake.merge("b", "no")
    assert (lake.catalog.head(), names(lake)) == (before, ["made of two", "two"])


def test_a_merge_whose_object_is_missing_is_refused(lake: Lake) -> None:
    lake.branch("b")
    lake.objects.remove(lake.objects.path(str(put_text(lake, "a", branch="b").object)))
    with pytest.raises(NotFoundError, match="missing"):
        lake.merge("b", "no")
    assert names(lake) == []


def test_a_branch_that_is_merged_can_be_deleted_and_its_name_used_again(lake: Lake) -> None:
    put_text(lake, "base")
    lake.branch("b")
    put_text(lake, "A", branch="b")
    lake.tag("kept", at="b")
    lake.branch("c", at="b")
    lake.merge("b", "done")
    commits = {e["message"]: e["commit"] for e in lake.catalog.history() if "commit" in e}
    lake.delete_branch("b")
    assert lake.refs.branches().keys() == {"c"}
    assert (
        names(lake)
        == names(lake, "kept")
        == names(lake, "c")
        == names(lake, commits["ingest A"])
        == ["A", "base"]
    )
    with pytest.raises(NotFoundError, match="no branch 'b'"):
        put_text(lake, "more", branch="b")
    lake.branch("b", at="1")
    assert names(lake, "b") == ["base"]
    assert names(lake, commits["ingest A"]) == ["A", "base"]
    put_text(lake, "B", branch="b")
    assert names(lake, "b") == ["B", "base"]
    assert len(lake.merge("b", "the new one").added) == 1
    assert doctor(lake, grace=NOW) == ()


def test_a_branch_or_tag_that_alone_shows_rows_is_deleted_only_when_they_are_given_up(
    lake: Lake,
) -> None:
    lake.branch("b")
    a = put_text(lake, "A", branch="b")
    with pytest.raises(ConflictError, match="1 artifacts are shown by this branch alone"):
        lake.delete_branch("b")
    lake.tag("v1", at="b")
    lake.delete_branch("b")
    with pytest.raises(ConflictError, match="by this tag alone"):
        lake.delete_tag("v1")
    assert names(lake, "v1") == ["A"]
    lake.delete_tag("v1", discard=True)
    assert lake.refs.tags() == {}
    assert (
        a.object in mark(lake, grace=DAY).objects
    )  # what was deleted a moment ago may have been a mistake
    assert collect(lake, grace=NOW).objects == (a.object,)


def test_the_name_of_a_deleted_tag_never_shows_anything_else(lake: Lake) -> None:
    put_text(lake, "a")
    lake.tag("v1")
    lake.delete_tag("v1")
    put_text(lake, "b")
    with pytest.raises(ConflictError, match="showed other artifacts"):
        lake.tag("v1")
    lake.tag("v1", at="1")
    assert names(lake, "v1") == ["a"]


def test_what_cannot_be_deleted_is_an_error(lake: Lake) -> None:
    lake.tag("v1")
    lake.branch("b")
    with pytest.raises(UsageError, match="main"):
        lake.delete_branch("main", discard=True)
    with pytest.raises(NotFoundError, match="no tag 'v2'") as caught:
        lake.delete_tag("v2")
    assert "v1" in caught.value.fix
    with pytest.raises(NotFoundError, match="no branch 'v1'"):
        lake.delete_branch("v1")
    with pytest.raises(NotFoundError, match="no tag 'b'"):
        lake.delete_tag("b")


def test_a_process_that_dies_between_the_commit_and_the_file_of_a_ref_has_deleted_the_ref(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "base")
    lake.branch("b")
    put_text(lake, "A", branch="b")

    def die(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(type(lake.refs), "remove", die)
        with pytest.raises(KeyboardInterrupt):
            lake.delete_branch("b", discard=True)
    assert (names(lake), lake.refs.branches()) == (["base"], {})
    assert {f.severity for f in doctor(lake, grace=DAY)} <= {Severity.NOTE}
    assert lake.branch("b").name == "b"
    assert names(lake, "b") == ["base"]


def test_versions_whose_data_gc_deleted_are_named_by_doctor_and_by_what_needs_the_data(
    lake: Lake, tmp_path: Path
) -> None:
    request = Export(format="mcap", where="name = 'gone'", at="2", options={})
    kept, gone = put_text(lake, "kept"), put_text(lake, "gone")
    lake.withdraw([gone.id], "faces of people in it")
    assert doctor(lake, grace=DAY) == ()
    collect(lake, grace=NOW)
    (finding,) = doctor(lake, grace=DAY)
    assert (finding.kind, finding.severity, finding.count) == (
        "withdrawn-collected",
        Severity.NOTE,
        1,
    )
    assert finding.where == "versions before 3"
    for use in (
        lake.object_path,
        lake.whole_object,
        lambda _: prepare(lake, request).write(tmp_path / "out"),
    ):
        with pytest.raises(
            NotFoundError, match=r"withdrawn by version 3 \(faces of people in it\).*gc"
        ) as caught:
            use(str(gone.object))
        assert "from 3 on" in caught.value.fix
        assert "doctor" not in caught.value.fix
    lake.objects.remove(lake.objects.path(str(kept.object)))  # nobody withdrew this one
    with pytest.raises(NotFoundError, match="run flagdata doctor"):
        lake.object_path(str(kept.object))
    assert {f.kind for f in doctor(lake, grace=DAY)} == {"withdrawn-collected", "dangling-row"}
    put_text(lake, "gone")
    assert lake.object_path(str(gone.object)).exists()


def test_a_file_that_only_older_versions_need_does_not_end_doctor(lake: Lake) -> None:
    artifact = put_text(lake, "a")
    (old,) = (lake.path / "catalog").glob("*.parquet")
    lake.withdraw([artifact.id], "no")
    old.write_bytes(b"damaged")
    assert "catalog-file-unreadable" in {
        finding.kind for finding in doctor(Lake.open(lake.path), grace=NOW)
    }


@pytest.mark.parametrize(
    "note",
    [
        {"hidden": "{"},
        {"hidden": "3"},
        {"hidden": "9" * 5000},
        {"hidden_on": "[1]"},
        {"hidden_on": '{"b": 3}'},
    ],
)
def test_a_note_of_the_log_that_cannot_be_read_is_damage(note: dict[str, str]) -> None:
    with pytest.raises(CorruptError, match="version 7"):
        _ = Removal({"version": 7, "branch": "b", **note}).hidden("b")
    for view in ({}, {"view": "[1]"}, {"view": '[{"branch": "b"}]'}):
        with pytest.raises(CorruptError, match="version 7"):
            _ = Removal({"version": 7, **view}).view


def test_the_verbs_say_what_a_merge_and_a_deletion_did(lake: Lake) -> None:
    def run(*arguments: str) -> Ended:
        return invoke(*arguments, "--lake", lake.path)

    both, base = put_text(lake, "both"), put_text(lake, "base")
    lake.branch("b")
    new = put_text(lake, "new", branch="b")
    put_text(lake, "new")
    lake.withdraw([new.id], "wrong")
    lake.withdraw([both.id], "wrong", branch="b")
    put_text(lake, "more", branch="b")
    code, out, err = run("merge", "b")
    assert (code, out) == (0, "version 9: 1 added, 0 were there, 1 withdrawn\n")
    assert f"stays withdrawn from main: {new.id[:12]}, since version 6" in err
    assert run("merge", "b")[1] == "nothing new on b\n"
    document = json.loads(run("merge", "b", "--json")[1])
    assert (document["commit"], document["withdrawn"], document["left_out"]) == (None, [], {})
    assert names(lake) == ["base", "more"]
    assert base.id in lake.rows()["artifact"].to_pylist()

    code, out, err = run("branch", "b", "--delete")
    assert code == 1
    assert "--discard" in err
    assert run("branch", "b", "--delete", "--discard")[:2] == (0, "version 10: branch b deleted\n")
    assert run("tag", "v1")[0] == 0
    assert json.loads(run("tag", "v1", "--delete", "-m", "not ready", "--json")[1])["version"] == 12
    assert lake.catalog.history()[0]["message"] == "not ready"
    for wrong in (
        ["tag", "--delete"],
        ["tag", "v", "--delete", "--at", "1"],
        ["branch", "b", "--discard"],
    ):
        assert run(*wrong)[0] == 2
    assert run("log")[0] == 0


def test_a_path_through_many_branches_brings_each_row_once_and_keeps_each_withdrawal(
    lake: Lake,
) -> None:
    def put(name: str, branch: str) -> Artifact:
        artifact = Artifact(kind=Kind.WIND, name=name, recipe={"name": name})
        with lake.transaction(name, branch=branch) as tx:
            tx.add(artifact)
        return artifact

    lake.branch("one")
    lake.branch("two")
    a = put("a", "one")
    lake.merge("one", "to two", into="two")
    lake.merge("one", "to main")
    lake.withdraw([a.id], "wrong")
    put("b", "two")
    assert lake.merge("two", "by way of two").left_out == {}
    assert names(lake) == ["b"]
    lake.merge("main", "back", into="one")
    assert names(lake, "one") == ["b"]


def test_of_many_withdrawals_one_catalog_is_held_at_a_time(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    alive: list[weakref.ref[pa.Table]] = []

    def withdrawn(*_: object, **__: object) -> Iterator[pa.Table]:
        for number in range(4):
            table = pa.table({"object": [f"object-{number}", None]})
            alive.append(weakref.ref(table))
            yield table
            del table
            assert sum(held() is not None for held in alive) <= 1

    monkeypatch.setattr("flagdata.lake.marking._withdrawn", withdrawn)
    assert mark(lake, grace=DAY).objects >= {f"object-{number}" for number in range(4)}
