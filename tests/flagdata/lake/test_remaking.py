"""What makes an artifact puts its object back where that is damaged or missing, and never says
"already" of it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.core import provenance
from flagdata.core.files.object_cache import forget
from flagdata.core.schema import Kind
from flagdata.errors import FlagdataError
from flagdata.ingest import (
    IngestResult,
    Labels,
    MeshIngest,
    ingest_camera,
    ingest_markers,
    ingest_meshes,
    ingest_wind,
    records,
)
from flagdata.lake import (
    Artifact,
    Lake,
    clone,
    doctor,
    is_healthy,
    labels_of,
    object_names,
    read_refs,
    results,
    transfer,
    verify,
)
from flagdata.storage import Place
from tests.flagdata.lake.conftest import overwrite, put_text
from tests.flagdata.lake.test_transfer import no_bar
from tests.program import invoke
from tests.small import SCENE

Damage = Callable[[Lake, str], None]
SQUARE = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nvt 0 0\nvt 0.1 0\nvt 0 0.1\nf 1/1 2/2 3/3\n"


def largest(place: Place) -> Place:
    """The largest file of an object."""
    if not place.is_dir():
        return place
    return max(
        (file for file in place.rglob("*") if file.is_file()), key=lambda file: file.stat().st_size
    )


def flip(lake: Lake, name: str) -> None:
    file = largest(lake.objects.path(name))
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    overwrite(file, bytes(data))
    forget(name, lake.objects.path(name).suffix)


def cut(lake: Lake, name: str) -> None:
    file = largest(lake.objects.path(name))
    overwrite(file, file.read_bytes()[:-1])
    forget(name, lake.objects.path(name).suffix)


def lose_a_file(lake: Lake, name: str) -> None:
    largest(lake.objects.path(name)).unlink()
    forget(name, lake.objects.path(name).suffix)


def lose(lake: Lake, name: str) -> None:
    lake.objects.remove(lake.objects.path(name))
    forget(name, lake.objects.path(name).suffix)


DAMAGES = [flip, cut, lose_a_file, lose]
OF_A_FILE = [flip, cut, lose]
"""Of records, whose only file is the object."""


def is_whole(lake: Lake) -> bool:
    return is_healthy(doctor(lake)) and verify(lake, object_names(lake), read_refs(lake)) == ()


@pytest.mark.parametrize("damage", OF_A_FILE)
def test_a_film_and_a_log_that_are_ingested_again_replace_what_was_damaged(
    place: Lake, damage: Damage, video: Path, wind_log: Path
) -> None:
    def ingested() -> list[IngestResult]:
        return [ingest_camera(place, video), ingest_wind(place, wind_log)]

    made = [str(one.artifact.object) for one in ingested()]
    place.tag("v1")
    for name in made:
        damage(place, name)
    assert (
        len(verify(place, object_names(place), read_refs(place))) == 2
    )  # of a bucket it is this that finds a flip
    again = ingested()
    assert [one.created for one in again] == [False, False]
    assert [(one.healed.before, one.healed.now) for one in again if one.healed] == [
        (name, name) for name in made
    ]
    assert is_whole(place)
    assert [one.healed for one in ingested()] == [None, None]


@pytest.mark.parametrize("damage", OF_A_FILE)
def test_in_a_folder_the_bytes_are_compared_without_a_verify_before(
    lake: Lake, damage: Damage, video: Path
) -> None:
    damage(lake, str(ingest_camera(lake, video).artifact.object))
    assert ingest_camera(lake, video).healed is not None
    assert is_whole(lake)


@pytest.mark.parametrize("damage", DAMAGES)
def test_meshes_markers_and_records_are_put_back_by_their_sources(
    lake: Lake, damage: Damage, tmp_path: Path, video: Path
) -> None:
    (folder := tmp_path / "sheet").mkdir()
    for k in range(3):
        (folder / f"{k:04d}.obj").write_text(SQUARE.replace("v 0 0 0", f"v 0 0 {k / 100}", 1))
    table = tmp_path / "markers.csv"
    rows = [
        f"{k / 10},{name},{u},0,{k},{u},1" for k in range(5) for name, u in (("a", 0), ("b", 1))
    ]
    table.write_text("\n".join(("time,marker,u,v,x,y,z", *rows)) + "\n")
    record = tmp_path / "film.mcap"
    other = Lake.create(tmp_path / "other")
    shutil.copyfile(other.object_path(str(ingest_camera(other, video).artifact.object)), record)

    def ingested() -> list[IngestResult]:
        return [
            ingest_meshes(lake, folder, MeshIngest(rate=25)),
            *ingest_markers(lake, table),
            records.ingest_record(lake, record),
        ]

    made = [str(one.artifact.object) for one in ingested()]
    assert {name.partition("/")[0] for name in made} == {"mcap", "zarr"}
    for name in made:
        damage(lake, name)
    assert all(one.healed is not None and not one.created for one in ingested())
    assert is_whole(lake)


@pytest.mark.parametrize(
    ("place", "damage"),
    [*(("folder", damage) for damage in DAMAGES), ("bucket", flip)],
    indirect=["place"],
)
def test_a_simulation_that_is_repeated_makes_only_what_is_damaged(
    place: Lake, damage: Damage, tmp_path: Path
) -> None:
    (scene := tmp_path / "scene.toml").write_text(SCENE.replace("count = 1", "count = 2"))

    def simulated() -> dict[str, object]:
        done = invoke("simulate", scene, "--workers", 1, "--json", "--lake", place.path)
        assert done.code == 0, done.err
        return json.loads(done.out)

    first = simulated()
    rows = place.rows(columns=["artifact", "object"]).to_pylist()
    damage(place, rows[0]["object"])
    assert len(verify(place, object_names(place))) == 1
    again = simulated()
    assert again["added"] == []
    assert again["existing"] == [rows[1]["artifact"]]
    assert list(again["healed"]) == [rows[0]["artifact"]]  # type: ignore[call-overload]
    assert is_whole(place)
    assert simulated()["existing"] == first["added"]


@pytest.mark.parametrize("damage", OF_A_FILE)
def test_a_recording_is_put_back_by_the_command_that_aligned_or_declared_it(
    lake: Lake, damage: Damage, video: Path, wind_log: Path
) -> None:
    film, wind = ingest_camera(lake, video).artifact, ingest_wind(lake, wind_log).artifact
    for command in (
        ("align", film.id, wind.id, "--by", "stamps", "--offset-sigma", 0.1),
        ("declare", film.id, "--speed", 5, "--sigma", 0.1),
    ):
        assert invoke(*command, "--lake", lake.path).code == 0
        made = lake.rows({"kind": Kind.RECORDING}, columns=["object"])["object"].to_pylist()[-1]
        damage(lake, made)
        again = invoke(*command, "--lake", lake.path)
        assert (again.code, "replaced the damaged or missing object" in again.out) == (0, True)
        assert is_whole(lake)
        assert "replaced" not in invoke(*command, "--lake", lake.path).out


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_result_that_is_kept_again_by_the_same_code_replaces_its_damaged_object(
    lake: Lake, damage: Damage
) -> None:
    row = Artifact(kind=Kind.MEASUREMENT, name="flag", recipe={"measure": 1})

    def write(path: Path) -> None:
        (path / "c").mkdir(parents=True)
        (path / "c" / "0").write_text("speeds")
        (path / "zarr.json").write_text("{}")

    def kept() -> results.Placed:
        return results.keep(lake, row, write, "measure")

    damage(lake, str(lake.artifact(kept().artifact.id).object))
    again = kept()
    assert (again.new, again.healed is not None, "replaced" in again.sentence) == (
        False,
        True,
        True,
    )
    assert is_whole(lake)
    assert kept().sentence == "there already"


def test_a_record_that_is_made_again_by_later_code_has_the_bytes_that_tags_need(
    lake: Lake, video: Path, wind_log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [ingest_camera(lake, video).artifact, ingest_wind(lake, wind_log).artifact]
    lake.tag("v1")
    for one in made:
        lose(lake, str(one.object))
    monkeypatch.setattr(provenance, "code_version", lambda: "9.0.0")
    for name in (
        "flagdata.ingest.source_artifacts",
        "flagdata.lake.remaking",
        "flagdata.lake.transaction",
    ):
        monkeypatch.setattr(f"{name}.code_version", lambda: "9.0.0", raising=False)
    again = [ingest_camera(lake, video), ingest_wind(lake, wind_log)]
    assert [one.artifact.object for one in again] == [one.object for one in made]
    assert is_whole(lake)


def put_bytes(lake: Lake, text: str, *, branch: str = "main") -> dict[str, object]:
    """An artifact of one identity whatever its bytes are, and a part of it, as an encoder of
    another version makes."""
    with lake.transaction("ingest", branch=branch) as transaction:
        staged = transaction.staging(".mcap")
        staged.write_text(text)
        row = Artifact(
            kind=Kind.RECORDING, name="film", object=transaction.put(staged), recipe={"ingest": "x"}
        )
        transaction.add(row)
        transaction.add(
            Artifact(
                kind=Kind.CLIP,
                name="film 0",
                object=row.object,
                parents=[row.id],
                recording=row.id,
                frame_first=0,
                frame_count=3,
            )
        )
    return dict(transaction.result.healed)


def test_other_bytes_take_the_place_of_damaged_ones_and_what_still_lacks_these_is_named(
    lake: Lake,
) -> None:
    put_bytes(lake, "by one encoder")
    before = str(lake.rows()["object"][0])
    lake.tag("v1")
    lake.branch("side")
    assert put_bytes(lake, "by another encoder") == {}
    assert set(lake.rows()["object"].to_pylist()) == {before}  # a sound object stays
    flip(lake, before)
    (healed, part) = put_bytes(lake, "by another encoder").values()
    assert healed == part
    assert (healed.before, healed.refs) == (before, ("side", "v1"))  # type: ignore[attr-defined]
    assert set(lake.rows()["object"].to_pylist()) == {healed.now}  # type: ignore[attr-defined]
    assert len(lake.rows()) == 2
    (error,) = verify(lake, object_names(lake), read_refs(lake))
    assert (error.kind, before in error.what) == ("object-changed", True)
    put_bytes(lake, "by another encoder", branch="side")
    assert set(lake.rows(at="side")["object"].to_pylist()) == {healed.now}  # type: ignore[attr-defined]
    lake.delete_tag("v1", discard=True)
    lake.delete_branch("side", discard=True)
    lose(lake, before)
    assert is_whole(lake)


def test_other_bytes_keep_the_name_session_and_labels_of_the_artifact(lake: Lake) -> None:
    put_bytes(lake, "by one encoder")
    identity = lake.artifact("film").id
    lake.label([identity], {"site": "roof"}, "label")
    lose(lake, str(lake.artifact(identity).object))
    with lake.transaction("ingest") as transaction:
        staged = transaction.staging(".mcap")
        staged.write_text("by another encoder")
        row = Artifact(
            kind=Kind.RECORDING,
            name="other",
            object=transaction.put(staged),
            recipe={"ingest": "x"},
        )
        assert not transaction.add(row)
    assert lake.artifact(identity).name == "film"
    assert labels_of(lake.table(lake.view(None)))[identity] == {"site": "roof"}


@pytest.mark.parametrize("damage", [cut, lose])
def test_a_pull_from_a_clone_puts_back_what_is_damaged(
    lake: Lake, damage: Damage, tmp_path: Path
) -> None:
    made = put_text(lake, "film")
    copy, _ = clone(lake, tmp_path / "copy", bars=no_bar)
    damage(lake, str(made.object))
    assert transfer(copy, lake, bars=no_bar).objects == (made.object,)
    assert is_whole(lake)


def test_a_pull_puts_back_what_verify_found_changed(place: Lake, tmp_path: Path) -> None:
    made = put_text(place, "film")
    copy, _ = clone(place, tmp_path / "copy", bars=no_bar)
    flip(place, str(made.object))
    assert len(verify(place, object_names(place))) == 1
    assert transfer(copy, place, bars=no_bar).objects == (made.object,)
    assert is_whole(place)
    assert transfer(copy, place, bars=no_bar).objects == ()


def test_a_note_of_damage_is_no_stray_file_and_goes_where_the_object_is_restored_by_hand(
    lake: Lake,
) -> None:
    made = put_text(lake, "film")
    path = lake.objects.path(str(made.object))
    flip(lake, str(made.object))
    assert len(verify(lake, object_names(lake))) == 1
    assert is_healthy(doctor(lake))
    overwrite(path, b"film")
    assert not lake.objects.is_sound(str(made.object), 4)  # nobody has looked yet
    assert is_whole(lake)
    assert lake.objects.is_sound(str(made.object), 4)


def test_what_is_asked_for_of_many_objects_is_what_is_asked_for_of_each(place: Lake) -> None:
    sizes: dict[str, int | None] = {}
    with place.transaction("films") as transaction:
        for k in range(18):
            staged = transaction.staging(".mcap")
            staged.write_text(f"film {k}")
            sizes[transaction.put(staged)] = len(f"film {k}")
    names = list(sizes)
    lose(place, names[3])
    cut(place, names[5])
    flip(place, names[7])
    verify(place, [names[7]])
    assert place.objects.unsound(sizes) == {names[3], names[5], names[7]}
    assert {name for name in names if not place.objects.is_sound(name, sizes[name])} == {
        names[3],
        names[5],
        names[7],
    }


def test_the_remedy_says_which_source_is_ingested_again_on_which_branch(
    lake: Lake, video: Path, wind_log: Path
) -> None:
    lake.branch("side")
    film = ingest_camera(lake, video).artifact
    wind = ingest_wind(lake, wind_log, labels=Labels(session="roof"), branch="side").artifact
    for one in (film, wind):
        flip(lake, str(one.object))
    found = verify(lake, object_names(lake), read_refs(lake))
    remedies = " ".join(str(finding.fix) for finding in found)
    assert "flagdata ingest field.mp4 again" in remedies
    assert "flagdata ingest mast.csv --branch side again" in remedies
    for one in (film, wind):
        lose(lake, str(one.object))
    remedies = " ".join(
        str(finding.fix) for finding in doctor(lake) if finding.kind == "dangling-row"
    )
    assert "flagdata ingest mast.csv --branch side again" in remedies


def test_a_lake_that_cannot_be_written_is_verified_all_the_same(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = put_text(lake, "film")
    flip(lake, str(made.object))

    def refuse(self: Path, data: bytes) -> int:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    assert [finding.kind for finding in verify(lake, object_names(lake))] == ["object-changed"]
    with pytest.raises(FlagdataError):
        lake.whole_object(str(made.object))
