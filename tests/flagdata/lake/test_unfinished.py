"""What was cut off between two of its steps is found in the log, named with the command that goes
on, and finished."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.core.findings import Severity
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, FlagdataError, NotFoundError
from flagdata.lake import (
    Artifact,
    Catalog,
    Lake,
    Objects,
    Refs,
    clone,
    collect,
    doctor,
    expire,
    garbage,
    heal,
    is_healthy,
    object_names,
    transfer,
    verify,
    verify_catalog,
)
from flagdata.lake.refs import made_by
from flagdata.lake.removal import Erasure
from tests.flagdata.lake.conftest import overwrite, put_older_ref, put_text, stored
from tests.flagdata.lake.test_transfer import no_bar
from tests.program import invoke

DAY = timedelta(days=1)


class Killed(BaseException):
    """The process ends here."""


def stopped(
    monkeypatch: pytest.MonkeyPatch,
    owner: type,
    method: str,
    action: Callable[[], object],
    *,
    at: int,
) -> int:
    """Run an action whose process is killed before it calls a method for the time `at`; how often
    it did."""
    whole, calls = getattr(owner, method), 0

    def counted(*arguments: object, **named: object) -> object:
        nonlocal calls
        calls += 1
        if calls > at:
            raise Killed
        return whole(*arguments, **named)

    with monkeypatch.context() as patch:
        patch.setattr(owner, method, counted)
        try:
            action()
        except Killed:
            return calls
    return calls


def is_whole(lake: Lake) -> bool:
    return (
        is_healthy(doctor(lake))
        and (*verify(lake, object_names(lake)), *verify_catalog(lake)) == ()
    )


def put_folder(lake: Lake, text: str, *, parents: tuple[str, ...] = ()) -> Artifact:
    with lake.transaction(f"ingest {text}") as transaction:
        staged = transaction.staging(".zarr")
        (staged / "c").mkdir(parents=True)
        for k in range(3):
            (staged / "c" / str(k)).write_text(f"{text} {k}")
        row = Artifact(
            kind=Kind.MESHES,
            name=text,
            object=transaction.put(staged),
            recipe={"of": text},
            parents=parents,
        )
        transaction.add(row)
    return row


@pytest.mark.parametrize("at", [0, 1, 2])
def test_an_erasure_that_was_killed_between_its_deletions_is_finished_by_the_same_call(
    place: Lake, monkeypatch: pytest.MonkeyPatch, at: int
) -> None:
    film = put_text(place, "film")
    made = put_folder(place, "sheet", parents=(film.id,))
    other = put_text(place, "other")
    third = put_text(place, "third", parents=(film.id,))
    place.tag("v1")

    def erase() -> Erasure:
        return place.erase([film.id], "asked", with_descendants=True)

    assert stopped(monkeypatch, type(place.objects), "delete", erase, at=at) == at + 1
    left = stored(place) - {other.object}
    found = [finding for finding in doctor(place) if finding.kind == "erasure-unfinished"]
    assert len(left) == len(found) == 3 - at
    assert all(
        finding.severity is Severity.ERROR and "flagdata gc" in str(finding.fix)
        for finding in found
    )
    done = erase()
    assert set(done.objects) == left
    assert (set(done.artifacts), stored(place)) == ({film.id, made.id, third.id}, {other.object})
    assert is_whole(place)


def test_a_folder_that_was_half_deleted_is_found_and_deleted(
    place: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    sheet = put_folder(place, "sheet")
    path = place.objects.path(str(sheet.object))
    assert stopped(
        monkeypatch, type(place.objects), "delete", lambda: place.erase([sheet.id], "asked"), at=0
    )
    if (path / ".sums").exists():
        (path / ".sums").unlink()
    (path / "c" / "1").unlink()
    assert "erasure-unfinished" in {finding.kind for finding in doctor(place)}
    assert place.erase([sheet.id], "asked").objects == (sheet.object,)
    assert (stored(place), is_whole(place)) == (set(), True)


def test_an_erasure_takes_its_artifacts_off_all_branches_by_one_commit(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    film = put_text(lake, "film")
    for branch in ("side", "other"):
        lake.branch(branch)
    made = put_text(lake, "made", parents=(film.id,), branch="other")
    put_text(lake, "film", branch="side")
    lake.tag("v1", at="other")
    head = lake.catalog.head()

    def erase() -> Erasure:
        return lake.erase([film.id], "asked", with_descendants=True)

    assert stopped(monkeypatch, Objects, "delete", erase, at=0) == 1
    assert lake.catalog.head() == head + 1
    assert [lake.rows(at=branch).num_rows for branch in ("main", "side", "other", "v1")] == [
        0,
        0,
        0,
        2,
    ]
    assert {finding.kind for finding in doctor(lake)} >= {"erasure-unfinished"}
    assert erase().branches == ()
    assert (stored(lake), is_whole(lake)) == (set(), True)
    assert lake.rows(at=str(head))["artifact"].to_pylist() == [film.id]
    assert lake.merge("side", "nothing").added == ()
    assert {film.id, made.id}.isdisjoint(lake.rows()["artifact"].to_pylist())


def test_an_erasure_that_was_killed_is_found_though_its_bytes_were_withdrawn_of_another_a_while_ago(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    film = put_text(lake, "film")
    with lake.transaction("the same bytes") as transaction:
        twin = replace(film, name="twin", recipe={"of": "twin"})
        transaction.hold(str(film.object))
        transaction.add(twin)
    lake.withdraw([twin.id], "wrong")
    head = lake.catalog.head()
    assert (
        stopped(monkeypatch, Objects, "delete", lambda: lake.erase([film.id], "asked"), at=0) == 1
    )
    assert "erasure-unfinished" in {finding.kind for finding in doctor(lake)}
    assert lake.erase([film.id], "asked").objects == (film.object,)
    assert lake.catalog.head() == head + 1
    assert (stored(lake), is_whole(lake)) == (set(), True)


def test_an_expiry_that_was_killed_is_found_and_finished_by_gc(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone, film = put_text(lake, "gone"), put_text(lake, "film")
    lake.withdraw([gone.id], "wrong")
    assert stopped(monkeypatch, Objects, "delete", lambda: expire(lake, 2), at=0) == 1
    assert "expiry-unfinished" in {finding.kind for finding in doctor(lake)}
    assert collect(lake, grace=timedelta(days=1)).objects == (gone.object,)
    assert (stored(lake), is_whole(lake)) == ({film.object}, True)


@pytest.mark.parametrize(
    ("place", "called"),
    [("folder", "id"), ("folder", "beginning"), ("folder", "name"), ("bucket", "name")],
    indirect=["place"],
)
def test_the_command_is_repeated_as_it_was_typed(
    place: Lake, monkeypatch: pytest.MonkeyPatch, called: str
) -> None:
    film = put_text(place, "film")
    name = {"id": film.id, "beginning": film.id[:10], "name": "film"}[called]
    command = ("withdraw", name, "--everywhere", "-m", "asked", "--lake", place.path)
    with monkeypatch.context() as patch:

        def kill(self: Objects, name: str) -> None:
            raise KeyboardInterrupt

        patch.setattr(type(place.objects), "delete", kill)
        assert invoke(*command).code != 0
    assert stored(place) == {film.object}
    head = place.catalog.head()
    again = invoke(*command)
    assert (again.code, again.out) == (0, f"version {head}: 1 artifact erased, 1 object deleted\n")
    assert (stored(place), place.catalog.head(), is_whole(place)) == (set(), head, True)


def test_gc_deletes_what_was_erased_however_young_it_is(
    place: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    film, orphan = put_text(place, "film"), put_text(place, "orphan")
    place.withdraw([orphan.id], "later")
    stopped(
        monkeypatch, type(place.objects), "delete", lambda: place.erase([film.id], "asked"), at=0
    )
    assert garbage(place, grace=DAY).objects == (film.object,)
    assert collect(place, grace=DAY).objects == (film.object,)
    assert (stored(place), is_whole(place)) == ({orphan.object}, True)


def test_what_came_again_after_it_was_erased_is_left_alone(lake: Lake) -> None:
    film = put_text(lake, "film")
    lake.erase([film.id], "asked")
    put_text(lake, "film")
    assert is_whole(lake)
    assert collect(lake, grace=DAY).objects == ()
    lake.withdraw([film.id], "a plain withdrawal")
    assert is_whole(lake)
    assert collect(lake, grace=DAY).objects == ()
    assert stored(lake) == {film.object}
    with pytest.raises(NotFoundError, match="no ref shows"):
        lake.erase([film.id], "asked once more")
    put_text(lake, "film")
    head = lake.catalog.head()
    assert lake.erase([film.id], "asked once more").version == head + 1
    assert (stored(lake), is_whole(lake)) == (set(), True)


def test_erasing_one_again_leaves_alone_what_was_erased_with_it_and_came_again(lake: Lake) -> None:
    one, other = put_text(lake, "one"), put_text(lake, "other")
    lake.erase([one.id, other.id], "asked")
    put_text(lake, "other")
    lake.erase([one.id], "asked")
    assert (stored(lake), is_whole(lake)) == ({other.object}, True)


def test_what_was_never_there_is_not_erased(lake: Lake) -> None:
    lake.erase([put_text(lake, "film").id], "asked")
    with pytest.raises(NotFoundError):
        lake.erase(["0" * 32], "asked")


def test_a_disk_that_refuses_a_deletion_is_reported_and_the_others_go(
    place: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    films = [put_text(place, name) for name in ("one", "two", "three")]
    stuck = place.objects.path(str(films[1].object))
    whole = type(place.objects).remove

    def refuse(path: object) -> None:
        if path == stuck:
            raise PermissionError(13, "Permission denied", str(path))
        whole(path)  # type: ignore[arg-type]

    command = (
        "withdraw",
        *(film.id for film in films),
        "--everywhere",
        "-m",
        "asked",
        "--lake",
        place.path,
    )
    with monkeypatch.context() as patch:
        patch.setattr(type(place.objects), "remove", staticmethod(refuse))
        done = invoke(*command)
        assert done.code == 1
        assert "1 of 3 objects are still there" in done.err
        assert "Permission denied" in done.err
        assert stored(place) == {films[1].object}
        with pytest.raises(FlagdataError):
            collect(place, grace=DAY)
    assert "erasure-unfinished" in {finding.kind for finding in doctor(place)}
    assert invoke(*command).code == 0
    assert (stored(place), is_whole(place)) == (set(), True)


def test_an_erasure_that_a_clone_pulled_is_finished_there_by_gc(lake: Lake, tmp_path: Path) -> None:
    film = put_text(lake, "film")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    lake.erase([film.id], "asked")
    transfer(lake, copy, bars=no_bar)
    assert "erasure-unfinished" in {finding.kind for finding in doctor(copy)}
    collect(copy, grace=DAY)
    assert (stored(copy), is_whole(copy)) == (set(), True)


@pytest.mark.parametrize(
    ("owner", "method"),
    [(Objects, "publish"), (Catalog, "adopt"), (Catalog, "acknowledge"), (Refs, "write_files")],
)
def test_a_push_that_was_killed_at_any_step_names_the_push_that_heals(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, owner: type, method: str
) -> None:
    put_text(lake, "first")
    for at in range(10):
        copy, _ = clone(lake, tmp_path / f"{at}", bars=no_bar)
        lake.branch(f"side-{at}")
        put_text(lake, f"second {at}", branch=f"side-{at}")
        put_text(lake, f"third {at}")
        lake.tag(f"v{at}")
        if at:
            lake.delete_branch(f"side-{at - 1}", discard=True)
        calls = stopped(
            monkeypatch, owner, method, lambda c=copy: transfer(lake, c, bars=no_bar), at=at
        )
        for finding in (*doctor(copy), *verify_catalog(copy)):
            assert finding.severity is not Severity.ERROR or "flagdata push or pull" in str(
                finding.fix
            )
        transfer(lake, copy, bars=no_bar)
        assert copy.refs.stored() == lake.refs.stored()
        collect(copy, grace=timedelta(0))
        assert is_whole(copy)
        if calls <= at:
            return
    pytest.fail("it was never left to end")


def test_a_deleted_branch_goes_with_the_next_transfer_where_one_was_killed_before_it_did(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "first")
    lake.branch("side")
    lake.tag("v1")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    lake.delete_branch("side")
    lake.delete_tag("v1")
    stopped(monkeypatch, Refs, "write_files", lambda: transfer(lake, copy, bars=no_bar), at=0)
    assert (set(copy.refs.branches()), set(copy.refs.tags())) == (set(), set())
    transfer(lake, copy, bars=no_bar)
    assert copy.refs.stale_files() == []


def test_a_branch_that_was_made_again_goes_to_clones_that_have_the_one_before(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "first")
    lake.branch("dev")
    put_text(lake, "old", branch="dev")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    lake.delete_branch("dev", discard=True)
    put_text(lake, "second")
    lake.branch("dev")
    put_text(lake, "new", branch="dev")
    transfer(lake, copy, bars=no_bar)
    assert copy.rows(at="dev")["name"].to_pylist() == ["first", "second", "new"]
    assert copy.refs.stored() == lake.refs.stored()
    assert is_whole(copy)


def test_a_branch_of_an_earlier_version_that_was_made_again_goes_to_clones(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "first")
    put_older_ref(lake, "branches", "dev", created="2020-01-01T00:00:00+00:00")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    lake.delete_branch("dev")
    put_text(lake, "second")
    lake.branch("dev")
    transfer(lake, copy, bars=no_bar)
    assert copy.rows(at="dev")["name"].to_pylist() == ["first", "second"]
    assert copy.refs.stored() == lake.refs.stored()


def test_a_clone_that_was_killed_is_gone_on_with_by_the_command_that_its_refusal_names(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    film = put_text(lake, "film")
    target = tmp_path / "copy"
    stopped(monkeypatch, Objects, "publish", lambda: clone(lake, target, bars=no_bar), at=0)
    with pytest.raises(ConflictError) as refused:
        clone(lake, target, bars=no_bar)
    command = str(refused.value.fix).partition(" brings")[0].split()
    assert command == ["flagdata", "push", str(target), "--lake", str(lake.path)]
    assert invoke(*command[1:]).code == 0
    assert Lake.open(target).rows()["artifact"].to_pylist() == [film.id]


def test_a_lake_whose_making_was_killed_is_distinguished_from_another_folder(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kill(*arguments: object, **named: object) -> bool:
        raise Killed

    for name, make in (("new", Lake.create), ("copy", lambda target: Lake.adopt(target, lake))):
        target = tmp_path / name
        with monkeypatch.context() as patch:
            patch.setattr("flagdata.lake.lake.put_if_absent", kill)
            patch.setattr(
                Objects, "remove", staticmethod(lambda path: None)
            )  # a killed process tidies nothing
            with pytest.raises(Killed):
                make(target)
        with pytest.raises(ConflictError, match="its making was stopped") as refused:
            make(target)
        assert "delete what is there and give the command again" in str(refused.value.fix)
        shutil.rmtree(target)
        assert make(target).path == target


@pytest.mark.parametrize("kind", ["tags", "branches"])
@pytest.mark.parametrize("content", [b"{", b"", None])
def test_a_ref_is_what_the_log_says_whatever_becomes_of_its_file(
    lake: Lake, kind: str, content: bytes | None
) -> None:
    put_text(lake, "first")
    lake.tag("name", notes={"split": "stated"}) if kind == "tags" else lake.branch("name")
    path = lake.refs.root / kind / "name.json"
    before = path.read_bytes()
    overwrite(path, content) if content is not None else path.unlink()
    put_text(lake, "second")
    assert lake.rows(at="name")["name"].to_pylist() == ["first"]
    for make in (lake.tag, lake.branch):
        with pytest.raises(ConflictError, match="already"):
            make("name")
    found = [finding for finding in doctor(lake) if finding.kind == "ref-file-stale"]
    assert [(finding.severity, finding.count) for finding in found] == [(Severity.NOTE, 1)]
    assert path.read_bytes() == before
    assert is_whole(lake)


def test_a_lake_without_its_refs_folder_has_its_tags_and_branches(lake: Lake) -> None:
    put_text(lake, "first")
    lake.tag("v1", notes={"split": "stated"})
    lake.branch("side")
    put_text(lake, "on side", branch="side")
    shutil.rmtree(lake.refs.root)
    again = Lake.open(lake.path)
    assert again.refs.tags()["v1"].notes == {"split": "stated"}
    assert again.rows(at="side")["name"].to_pylist() == ["first", "on side"]
    doctor(again)
    assert is_whole(again)
    assert {path.stem for path in lake.refs.root.glob("*/*.json")} == {"v1", "side"}
    assert [path.name for path in (lake.refs.root / "newest").iterdir()] == [
        str(lake.catalog.head())
    ]


@pytest.mark.parametrize("kind", ["tags", "branches"])
def test_the_file_of_a_ref_that_was_deleted_is_no_ref(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    put_text(lake, "first")
    make, delete = (
        (lake.tag, lake.delete_tag) if kind == "tags" else (lake.branch, lake.delete_branch)
    )
    make("name")
    assert stopped(monkeypatch, Refs, "remove", lambda: delete("name"), at=0) == 1
    path = lake.refs.root / kind / "name.json"
    assert path.exists()
    assert {*lake.refs.tags(), *lake.refs.branches()} == set()
    assert "ref-file-stale" in {finding.kind for finding in doctor(lake)}
    assert not path.exists()
    make("name")
    assert lake.rows(at="name")["name"].to_pylist() == ["first"]


@pytest.mark.parametrize("kind", ["tags", "branches"])
def test_a_ref_of_an_earlier_version_is_entered_into_the_log_by_the_next_commit(
    lake: Lake, kind: str
) -> None:
    put_text(lake, "first")
    path = put_older_ref(lake, kind, "name")
    put_text(lake, "second")
    path.unlink()
    assert Lake.open(lake.path).rows(at="name")["name"].to_pylist() == ["first"]
    assert made_by(lake.catalog.history()[0])[kind, "name"].name == "name"


@pytest.mark.parametrize("kind", ["tags", "branches"])
def test_a_damaged_ref_of_an_earlier_version_comes_back_by_the_heal_that_is_named(
    lake: Lake, tmp_path: Path, kind: str
) -> None:
    put_text(lake, "first")
    path = put_older_ref(lake, kind, "name")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    overwrite(path, b"{")
    found = [finding for finding in doctor(lake) if finding.kind == "ref-unreadable"]
    assert found
    assert all("flagdata heal FROM" in str(finding.fix) for finding in found)
    assert heal(lake, copy, bars=no_bar).left == ()
    assert lake.refs.stored() == copy.refs.stored()
    assert is_whole(lake)


@pytest.mark.parametrize("name", ["a\x1b]0;x\x07b", "a b", "-", "9" * 200])
def test_a_file_with_a_name_that_no_ref_may_have_is_no_ref(lake: Lake, name: str) -> None:
    put_text(lake, "first")
    put_older_ref(lake, "branches", name)
    assert lake.refs.branches() == {}
    assert {finding.kind for finding in doctor(lake)} == {"stray-file"}
    assert collect(lake, grace=timedelta(0)).objects == ()
