"""Erasing everywhere: bytes gone at once from all refs, rows that say so, and nothing that others
need."""

from __future__ import annotations

import json
from datetime import timedelta
from pathlib import Path

import pytest
from click.testing import CliRunner

from flagdata.cli import root
from flagdata.core.findings import Severity
from flagdata.errors import ConflictError, NotFoundError
from flagdata.export import Export, export
from flagdata.lake import Artifact, Lake, collect, doctor, lost, verify, verify_catalog
from tests.flagdata.lake.conftest import put_text


def test_bytes_go_from_tags_branches_and_old_versions_and_each_says_by_which_version(
    lake: Lake,
) -> None:
    film, other = put_text(lake, "film"), put_text(lake, "other")
    lake.tag("v1")
    lake.branch("b")
    done = lake.erase([film.id], "asked to be erased")
    assert not lake.objects.path(str(film.object)).exists()
    assert (done.branches, done.tags, done.objects) == (("main", "b"), ("v1",), (film.object,))
    for ref in ("main", "b"):
        assert lake.rows(at=ref)["artifact"].to_pylist() == [other.id]
    assert set(lake.rows(at="v1")["artifact"].to_pylist()) == {film.id, other.id}
    with pytest.raises(
        NotFoundError, match=r"erased from all versions by version 5 .asked to be erased."
    ):
        lake.object_path(str(film.object))
    assert list(lost(lake, lake.rows(at="v1"))) == [film.object]
    notes = doctor(lake)
    assert [(note.kind, note.severity, note.where) for note in notes] == [
        ("erased", Severity.NOTE, "ref v1")
    ]
    assert not verify(lake, [str(other.object)])
    assert not verify_catalog(lake)
    assert collect(lake, grace=timedelta(0)).objects == ()


def test_an_old_version_whose_data_gc_took_says_so_to_ls_export_and_doctor_alike(
    lake: Lake, tmp_path: Path
) -> None:
    film = put_text(lake, "film")
    version = str(lake.catalog.head())
    lake.withdraw([film.id], "blurred")
    collect(lake, grace=timedelta(0))
    (why,) = lost(lake, lake.rows(at=version)).values()
    assert "withdrawn by version 2 (blurred)" in why.what
    listed = CliRunner().invoke(root, ["ls", "--at", version, "--lake", str(lake.path)])
    assert "without data: film" in listed.stderr
    with pytest.raises(NotFoundError) as refused:
        export(lake, Export(format="csv", at=version), tmp_path / "out")
    assert refused.value.what == why.what
    assert [note.kind for note in doctor(lake)] == ["withdrawn-collected"]


def test_what_was_erased_and_what_gc_took_differ_where_older_versions_show_both(
    lake: Lake,
) -> None:
    film, other = put_text(lake, "film"), put_text(lake, "other")
    lake.erase([film.id], "asked to be erased")
    (erased,) = doctor(lake)
    assert (erased.kind, erased.count) == ("erased", 1)
    assert "were erased, the last by version 3 (asked to be erased)" in erased.what
    assert "gc" not in erased.what
    lake.withdraw([other.id], "blurred")
    collect(lake, grace=timedelta(0))
    _, collected = notes = doctor(lake)
    assert [(note.kind, note.count) for note in notes] == [
        ("erased", 1),
        ("withdrawn-collected", 1),
    ]
    assert "withdrawn by version 4 (blurred)" in collected.what


def test_what_was_made_of_it_is_named_before_anything_is_deleted(lake: Lake) -> None:
    film = put_text(lake, "film")
    made = put_text(lake, "made", parents=(film.id,))
    with pytest.raises(ConflictError, match="made"):
        lake.erase([film.id], "asked")
    assert lake.objects.path(str(film.object)).exists()
    done = lake.erase([film.id], "asked", with_descendants=True)
    assert set(done.artifacts) == {film.id, made.id}
    assert not any(lake.objects.path(str(one.object)).exists() for one in (film, made))
    with pytest.raises(NotFoundError, match="no ref shows"):
        lake.erase(["0" * 32], "asked")


def test_a_withdrawn_row_that_a_tag_shows_can_still_be_erased(lake: Lake) -> None:
    film = put_text(lake, "film")
    lake.tag("v1")
    lake.withdraw([film.id], "first")
    assert lake.objects.path(str(film.object)).exists()
    done = lake.erase([film.id], "then")
    assert (done.branches, done.tags) == ((), ("v1",))
    assert not lake.objects.path(str(film.object)).exists()


def test_content_that_another_artifact_has_stays_and_what_is_ingested_again_is_whole(
    lake: Lake, tmp_path: Path
) -> None:
    film = put_text(lake, "film")
    lake.tag("v1")
    with lake.transaction("the same bytes") as tx:
        path = tx.staging(".mcap")
        path.write_text("film")
        twin = Artifact(kind=film.kind, name="twin", object=tx.put(path), source_hash="b" * 64)
        tx.add(twin)
    done = lake.erase([film.id], "asked")
    assert done.objects == ()
    assert list(done.kept) == [film.object]
    lake.erase([twin.id], "asked")
    again = put_text(lake, "film")
    assert again.id == film.id
    assert collect(lake, grace=timedelta(0)).objects == ()
    assert lake.object_path(str(again.object)).read_text() == "film"
    assert not doctor(lake)


def test_the_command_reports_what_it_erased_and_ls_marks_the_rows(lake: Lake) -> None:
    put_text(lake, "film")
    lake.tag("v1")
    run = CliRunner()
    where = ["--lake", str(lake.path)]
    done = run.invoke(root, ["withdraw", "film", "-m", "asked", "--everywhere", "--json", *where])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["schema"] == "flagdata.erasure/1"
    assert any("clones" in one for one in found["not_reached"])
    listed = json.loads(run.invoke(root, ["ls", "--at", "v1", "--json", *where]).stdout)
    assert [row["data"] for row in listed["artifacts"]] == ["lost"]
    shown = run.invoke(root, ["ls", "--at", "v1", *where])
    assert "lost" in shown.stdout
    assert "without data: film" in shown.stderr


def test_a_new_branch_shows_nothing_that_was_erased_and_a_new_tag_lists_it_as_older_tags_do(
    place: Lake,
) -> None:
    lake = place
    film, other = put_text(lake, "film"), put_text(lake, "other")  # versions 1 and 2
    lake.tag("before", at="2")
    lake.erase([film.id], "asked")
    lake.tag("after", at="2")
    begun = lake.branch("b", at="2")
    lake.branch("of-a-tag", at="before")
    assert begun.notes == {"erased": "1"}
    for branch in ("b", "of-a-tag"):
        assert lake.rows(at=branch)["artifact"].to_pylist() == [other.id]
    for tag in ("before", "after"):
        assert lake.rows(at=tag)["artifact"].to_pylist() == [film.id, other.id]
    assert {(note.kind, note.where) for note in doctor(lake)} == {
        ("erased", "ref before"),
        ("erased", "ref after"),
    }
    put_text(lake, "later", branch="b")
    lake.merge("b", "bring in")
    assert lake.rows()["name"].to_pylist() == ["other", "later"]


def test_no_ref_keeps_the_bytes_of_an_erasure_that_was_killed(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    film = put_text(lake, "film")
    with monkeypatch.context() as patches:
        patches.setattr(
            "flagdata.lake.removal._delete", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt)
        )
        with pytest.raises(KeyboardInterrupt):
            lake.erase([film.id], "asked")
    lake.branch("b", at="1")
    lake.tag("v1", at="1")
    assert collect(lake, grace=timedelta(days=1)).objects == (film.object,)


def test_what_came_again_since_it_was_erased_is_on_a_new_branch(lake: Lake) -> None:
    film = put_text(lake, "film")
    lake.erase([film.id], "asked")
    put_text(lake, "film")
    lake.branch("b", at="1")
    assert lake.rows(at="b")["artifact"].to_pylist() == [film.id]
    lake.merge("b", "nothing new")
    assert lake.rows()["artifact"].to_pylist() == [film.id]


def test_a_branch_of_what_was_made_from_what_was_erased_is_refused(lake: Lake) -> None:
    film = put_text(lake, "film")
    made = put_text(lake, "made", parents=(film.id,))
    lake.withdraw([made.id], "blurred")
    lake.erase([film.id], "asked")
    with pytest.raises(
        ConflictError, match="wind 'made' of that version was made from what was erased since"
    ):
        lake.branch("b", at="2")


def test_neither_tag_nor_branch_shows_a_version_whose_data_gc_took(place: Lake) -> None:
    lake = place
    film, other = put_text(lake, "film"), put_text(lake, "other")
    lake.withdraw([film.id], "blurred")
    lake.tag("young", at="1")  # within the grace period
    lake.delete_tag("young", discard=True)
    collect(lake, grace=timedelta(0))
    for name in (lake.tag, lake.branch):
        with pytest.raises(
            ConflictError, match=r"withdrawn by version 3 \(blurred\), and gc has deleted it"
        ) as refused:
            name("old", at="2")
        assert refused.value.fix == "choose a newer version, or one that a tag shows"
    lake.tag("new")
    assert lake.rows(at="new")["artifact"].to_pylist() == [other.id]
    assert {note.severity for note in doctor(lake)} <= {Severity.NOTE}


def test_a_tag_that_lists_erased_rows_does_not_stand_for_the_bytes_that_another_row_needs(
    lake: Lake,
) -> None:
    film = put_text(lake, "film")
    lake.tag("v1")
    with lake.transaction("the same bytes") as tx:
        twin = Artifact(kind=film.kind, name="twin", object=film.object, source_hash="b" * 64)
        tx.add(twin)  # version 3
    lake.withdraw([twin.id], "blurred")
    lake.erase([film.id], "asked")
    with pytest.raises(ConflictError, match="is gone"):
        lake.tag("twins", at="3")
