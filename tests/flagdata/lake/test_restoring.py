"""What is damaged or missing in a lake is taken from another one of its history, whichever of the
two is older."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.errors import ConflictError, FlagdataError, NotFoundError
from flagdata.lake import (
    Lake,
    Objects,
    catalog,
    clone,
    doctor,
    heal,
    object_names,
    pull,
    restoring,
    transfer,
    verify,
    verify_catalog,
)
from flagdata.lake.delta_log import PREVIOUS_HASH
from flagdata.storage import Place
from tests.flagdata.lake.conftest import LINKS, overwrite, put_older_ref, put_text
from tests.flagdata.lake.test_transfer import is_whole, no_bar
from tests.flagdata.lake.test_unfinished import stopped
from tests.program import invoke

Damage = Callable[[Path], None]


def lose(path: Path) -> None:
    path.unlink()


def cut(path: Path) -> None:
    overwrite(path, b"")


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    overwrite(path, bytes(content))


@pytest.fixture(scope="module")
def lakes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of a lake, `lake`; of its clone of two versions before, `older`, and of one after,
    `newer`."""
    folder = tmp_path_factory.mktemp("lakes")
    lake = Lake.create(folder / "lake")
    for text in "ab":
        put_text(lake, text)
    clone(lake, folder / "older", bars=no_bar)
    for text in "cd":
        put_text(lake, text)
    newer, _ = clone(lake, folder / "newer", bars=no_bar)
    put_text(newer, "e")
    return folder


@pytest.fixture
def damaged(lakes: Path, tmp_path: Path) -> Path:
    """A copy of the lake, to be damaged."""
    shutil.copytree(lakes / "lake", tmp_path / "damaged")
    return tmp_path / "damaged"


def files(lake: Path) -> dict[Path, bytes]:
    """The bytes of a lake's files, by their path in it."""
    found = {path.relative_to(lake): path for path in sorted(lake.rglob("*")) if path.is_file()}
    return {name: path.read_bytes() for name, path in found.items() if name.parts[0] != "staging"}


def healed(lake: Place, source: Place) -> restoring.Healed:
    return heal(Lake.found(lake), Lake.found(source), bars=no_bar)


KINDS = {
    "lake.json": "marker",
    "_delta_log": "log entry",
    "catalog": "file of rows",
    "mcap": "object",
    "newest": "mark",
}


def kind_of(name: Path) -> str:
    return KINDS.get(name.name, KINDS.get(name.parent.name, ""))


@pytest.mark.disk("it damages files of a folder")
@pytest.mark.parametrize("damage", [lose, cut, flip])
def test_every_file_that_is_damaged_comes_from_a_newer_lake_and_from_an_older_one_that_has_it(
    lakes: Path, damaged: Path, damage: Damage
) -> None:
    right = files(lakes / "lake")
    for source in ("newer", "older"):
        there = files(lakes / source)
        for name in right:
            if damage is flip and name.name == "lake.json":
                continue  # it may stay a marker
            damage(damaged / name)
            done = healed(damaged, lakes / source)
            known = there.get(name) == right[name] or kind_of(name) == "mark"
            assert ([taken.kind for taken in done.taken], done.left == ()) == (
                [kind_of(name)] * known,
                known,
            ), name
            assert (files(damaged) == right) == known, name
            (damaged / name).unlink(missing_ok=True)
            (damaged / name).write_bytes(right[name])
        assert healed(damaged, lakes / source) == restoring.Healed(taken=(), left=())


@pytest.mark.disk("it damages files of a folder")
def test_what_is_damaged_in_many_places_comes_from_lakes_that_are_damaged_themselves(
    lakes: Path, damaged: Path, tmp_path: Path
) -> None:
    right = files(lakes / "lake")
    for number, name in enumerate(right):
        if kind_of(name) != "mark":
            (lose, cut)[number % 2](damaged / name)
    for part in ("first", "second"):
        shutil.copytree(lakes / "newer", tmp_path / part)
        for number, name in enumerate(right):
            if number % 2 == (part == "second") and kind_of(name) != "mark":
                lose(tmp_path / part / name)
    done = [healed(damaged, tmp_path / part) for part in ("first", "second") * 4]
    assert done[0].left
    assert done[-1] == restoring.Healed(taken=(), left=())
    assert files(damaged) == right
    assert sum(len(one.taken) for one in done) == len(right) - 1


@pytest.mark.disk("it deletes folders")
def test_folders_and_a_log_that_are_gone_come_back_and_nothing_newer_comes(
    lakes: Path, damaged: Path
) -> None:
    right = files(lakes / "lake")
    for gone in (
        ("catalog/_delta_log",),
        ("catalog", "mcap", "staging"),
        ("lake.json", "catalog/_delta_log", "zarr"),
    ):
        for name in gone:
            path = damaged / name
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        done = healed(damaged, lakes / "newer")
        assert done.left == ()
        assert {taken.kind for taken in done.taken} >= {"folder", "log entry"}
        assert files(damaged) == right


@pytest.mark.disk("it deletes folders")
def test_of_a_log_that_is_gone_with_its_mark_all_entries_are_taken(
    lakes: Path, damaged: Path
) -> None:
    shutil.rmtree(damaged / "catalog")
    shutil.rmtree(damaged / "refs")
    assert healed(damaged, lakes / "newer").left == ()
    assert Lake.open(damaged).rows()["name"].to_pylist() == list("abcde")


@pytest.mark.disk("it damages files of a folder")
def test_a_heal_that_was_stopped_at_any_step_goes_on(
    lakes: Path, damaged: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = files(lakes / "lake")
    for number, name in enumerate(right):
        if kind_of(name) != "mark":
            (lose, cut)[number % 2](damaged / name)
    for owner, method, step in (
        (Path, "replace", 0),
        (Path, "replace", 3),
        (Objects, "publish", 1),
    ):
        stopped(monkeypatch, owner, method, lambda: healed(damaged, lakes / "newer"), at=step)
        assert files(damaged) != right
    assert healed(damaged, lakes / "newer").left == ()
    assert {name: content for name, content in files(damaged).items() if name in right} == right
    assert Lake.open(damaged).rows()["name"].to_pylist() == list("abcd")


@pytest.mark.disk("it damages files of a folder")
def test_a_mark_that_makes_no_sense_says_again_what_the_newest_entry_is(
    lakes: Path, damaged: Path
) -> None:
    mark = next((damaged / "refs" / "newest").iterdir())
    right = mark.read_bytes()
    for wrong in (b"", b"no hash\n", bytes([right[0] ^ 64]) + right[1:], right[:60] + b"0000\n"):
        overwrite(mark, wrong)
        assert [taken.kind for taken in healed(damaged, lakes / "older").taken] == ["mark"]
        assert mark.read_bytes() == right


@pytest.mark.disk("it writes entries of a log by hand")
def test_of_a_lake_whose_entries_note_no_hashes_an_entry_is_taken_that_the_same_one_follows(
    lakes: Path, damaged: Path, tmp_path: Path
) -> None:
    shutil.copytree(lakes / "newer", tmp_path / "source")
    for lake in (damaged, tmp_path / "source"):
        shutil.rmtree(lake / "refs" / "newest")
        for entry in (lake / "catalog" / "_delta_log").iterdir():
            text = re.sub(
                rf',"({re.escape(PREVIOUS_HASH)}|flagdata.file_sha256)":"[0-9a-f]+"',
                "",
                entry.read_text(),
            )
            overwrite(entry, text.encode())
    right = files(damaged)
    assert healed(damaged, tmp_path / "source") == restoring.Healed(taken=(), left=())
    for name in right:
        if kind_of(name) in ("log entry", "file of rows") and not name.name.endswith("4.json"):
            lose(damaged / name)
            assert [taken.kind for taken in healed(damaged, tmp_path / "source").taken] == [
                kind_of(name)
            ]
    assert files(damaged) == right


@pytest.mark.disk("it damages files of a folder")
def test_checkpoints_and_summaries_that_have_changed_are_taken_or_deleted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", 4)
    lake, path = Lake.create(tmp_path / "lake"), tmp_path / "lake"
    for number in range(6):
        put_text(lake, str(number))
    shutil.copytree(path, tmp_path / "backup")
    right = files(path)
    saving = [name for name in right if "history" in name.parts or "checkpoint" in name.name]
    assert len(saving) == 3
    older, _ = clone(lake, tmp_path / "without", bars=no_bar)
    for source, taken_back in ((tmp_path / "backup", True), (older.path, False)):
        for name in saving:
            flip(path / name)
            done = healed(lake.path, source)
            assert done.left == ()
            assert {taken.kind for taken in done.taken} <= {"summary", "checkpoint"}
            assert Lake.open(lake.path).rows().num_rows == 6
            if taken_back and name.name != "_last_checkpoint":
                assert (path / name).read_bytes() == right[name]
            for one in saving:
                (path / one).write_bytes(right[one])
    assert is_whole(Lake.open(lake.path))


def test_what_was_erased_does_not_come_back_from_an_older_clone(lake: Lake, tmp_path: Path) -> None:
    gone, stays = put_text(lake, "gone"), put_text(lake, "stays")
    lake.tag("v1")
    older, _ = clone(lake, tmp_path / "older", bars=no_bar)
    lake.erase([gone.id], "asked to")
    lake.objects.remove(lake.objects.path(str(stays.object)))
    done = healed(lake.path, older.path)
    assert [(taken.kind, taken.name) for taken in done.taken] == [("object", stays.object)]
    assert not lake.objects.has(str(gone.object))
    assert healed(lake.path, older.path) == restoring.Healed(taken=(), left=())


def test_a_lake_that_went_on_otherwise_gives_what_both_had(lake: Lake, tmp_path: Path) -> None:
    common = put_text(lake, "common")
    other, _ = clone(lake, tmp_path / "other", bars=no_bar)
    put_text(other, "there")
    put_text(lake, "here")
    lake.objects.remove(lake.objects.path(str(common.object)))
    overwrite(lake.path / "catalog" / "_delta_log" / f"{1:020d}.json", b"")
    assert [taken.kind for taken in healed(lake.path, other.path).taken] == ["log entry", "object"]
    assert Lake.open(lake.path).rows()["name"].to_pylist() == ["common", "here"]


def test_a_lake_of_another_history_and_what_is_no_lake_are_refused(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "first")
    with pytest.raises(ConflictError, match="share no history"):
        healed(lake.path, Lake.create(tmp_path / "another").path)
    (tmp_path / "folder").mkdir()
    with pytest.raises(NotFoundError):
        healed(lake.path, tmp_path / "folder")


@pytest.mark.disk(LINKS)
def test_a_lake_whose_folder_is_a_link_is_refused(
    lakes: Path, damaged: Path, tmp_path: Path
) -> None:
    (damaged / "mcap").rename(tmp_path / "elsewhere")
    (damaged / "mcap").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FlagdataError, match="is a link"):
        healed(damaged, lakes / "newer")


def test_a_lake_in_a_bucket_is_healed_from_a_folder_and_heals_one(
    remote_lake: Lake, tmp_path: Path
) -> None:
    artifacts = [put_text(remote_lake, text) for text in "abc"]
    backup, _ = clone(remote_lake, tmp_path / "backup", bars=no_bar)
    put_text(remote_lake, "d")
    log, names = (
        remote_lake.path / "catalog" / "_delta_log",
        [str(artifact.object) for artifact in artifacts],
    )
    (log / f"{2:020d}.json").unlink()
    (log / f"{3:020d}.json").write_bytes(b"{")
    (remote_lake.path / "lake.json").unlink()
    next(iter((backup.path / "catalog").glob("*.parquet"))).unlink()
    remote_lake.objects.path(names[0]).unlink()
    remote_lake.objects.path(names[1]).write_bytes(b"B")
    copy = tmp_path / "cache" / "objects" / f"{names[2].replace('/', '-')}.mcap"
    copy.write_bytes(b"C")
    done = healed(remote_lake.path, backup.path)
    assert done.left == ()
    assert [taken.kind for taken in done.taken] == [
        "marker",
        "log entry",
        "log entry",
        "object",
        "object",
        "local copy",
    ]
    assert not copy.exists()
    lake = Lake.open(str(remote_lake.path))
    assert lake.rows()["name"].to_pylist() == list("abcd")
    assert is_whole(lake)
    assert [taken.kind for taken in healed(backup.path, lake.path).taken] == ["file of rows"]
    assert is_whole(Lake.open(backup.path))


def test_a_pull_from_a_lake_that_is_behind_takes_what_was_lost_or_found_damaged(
    lake: Lake, tmp_path: Path
) -> None:
    lost, changed = put_text(lake, "lost"), put_text(lake, "changed")
    older, _ = clone(lake, tmp_path / "older", bars=no_bar)
    put_text(lake, "later")
    lake.objects.remove(lake.objects.path(str(lost.object)))
    overwrite(lake.objects.path(str(changed.object)), b"chanted")
    assert len(verify(lake, object_names(lake))) == 2
    done = pull(older, lake, bars=no_bar)
    assert (done.versions, done.head) == (0, lake.catalog.head())
    assert set(done.objects) == {lost.object, changed.object}
    assert (
        *verify(lake, object_names(lake)),
        *verify_catalog(lake),
        *doctor(lake, grace=timedelta(0)),
    ) == ()
    assert pull(older, lake, bars=no_bar).healed == ()


def test_a_push_to_a_lake_that_is_ahead_names_the_pull_that_brings_its_versions(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "first")
    older, _ = clone(lake, tmp_path / "older", bars=no_bar)
    put_text(lake, "second")
    with pytest.raises(ConflictError, match="is ahead") as refused:
        transfer(older, lake, bars=no_bar)
    assert invoke(*str(refused.value.fix).partition(" brings")[0].split()[1:]).code == 0
    assert older.rows().equals(lake.rows())


def test_the_command_says_item_by_item_what_it_took_and_what_is_left(
    lake: Lake, tmp_path: Path
) -> None:
    had = put_text(lake, "had")
    older, _ = clone(lake, tmp_path / "older", bars=no_bar)
    later = put_text(lake, "later")
    for artifact in (had, later):
        lake.objects.remove(lake.objects.path(str(artifact.object)))
    ended = invoke("heal", older.path, "--lake", lake.path)
    assert ended.code == 3
    assert f"object {had.object}: was missing" in ended.out
    assert f"object {later.object} is missing" in ended.out
    assert "flagdata heal FROM" in ended.out
    assert "1 item taken" in ended.err
    document = invoke("heal", older.path, "--lake", lake.path, "--json").document
    assert (document["taken"], [left["kind"] for left in document["left"]]) == (
        [],
        ["object-missing"],
    )


def test_refs_of_earlier_versions_that_are_damaged_or_lost_come_from_an_older_lake(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "first")
    paths = [
        put_older_ref(lake, kind, name)
        for kind, name in (("tags", "v1"), ("tags", "v2"), ("branches", "side"))
    ]
    older, _ = clone(lake, tmp_path / "older", bars=no_bar)
    right = [path.read_bytes() for path in paths]
    overwrite(paths[0], b"{")
    overwrite(paths[1], right[1].replace(b'"v2"', b'"v3"'))
    paths[2].unlink()
    done = healed(lake.path, older.path)
    assert ([taken.kind for taken in done.taken], done.left) == (["ref"] * 3, ())
    assert [path.read_bytes() for path in paths] == right
    lake.delete_tag("v1")
    assert healed(lake.path, older.path) == restoring.Healed(taken=(), left=())
    assert set(Lake.open(lake.path).refs.tags()) == {"v2"}


def test_a_tag_that_the_log_states_needs_no_other_lake_and_is_pulled_from_none(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "first")
    lake.tag("v1")
    older, _ = clone(lake, tmp_path / "older", bars=no_bar)
    put_text(lake, "second")
    path = lake.refs.root / "tags" / "v1.json"
    right = path.read_bytes()
    for damage in (lambda: overwrite(path, b"{"), path.unlink):
        damage()
        assert lake.rows(at="v1").num_rows == 1
        done = pull(older, lake, bars=no_bar)
        assert [taken.kind for taken in done.healed] == ["ref"]
        assert path.read_bytes() == right


@pytest.mark.disk("it makes a folder in a lake")
def test_what_is_no_summary_stays_beside_them(lakes: Path, damaged: Path) -> None:
    history = damaged / "refs" / "history"
    (history / "\x1b[2J").mkdir(parents=True)
    (history / "notes.txt").write_text("not of the lake")
    assert healed(damaged, lakes / "newer") == restoring.Healed(taken=(), left=())
    assert {"\x1b[2J", "notes.txt"} <= {path.name for path in history.iterdir()}
