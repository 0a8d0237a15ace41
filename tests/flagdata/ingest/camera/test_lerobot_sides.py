"""The split that a LeRobot data set states is the side of its films, out of a lake and into one."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import flagdata
from flagdata.core.schema import Kind
from flagdata.dataset import HashedSplit, clip_rows
from flagdata.dataset.sides import clips_of, divide
from flagdata.errors import CorruptError
from flagdata.export import Export, export
from flagdata.ingest import CameraIngest, CameraOptions, ingest_camera
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from tests.flagdata.dataset.conftest import picture
from tests.program import invoke

START, PERIOD, FRAMES = 1_577_836_800_000_000_000, 40_000_000, 32
FILMS = {"test": 1, "train": 2}
DIVIDED = {"train": "0:2", "test": "2:3"}


def fill(lake: Lake, **columns: Any) -> None:
    """Films of simulations of their own, which all begin at one instant."""
    number = 0
    for side, count in FILMS.items():
        for _ in range(count):
            number += 1
            stated = columns or {"dataset": "made", "side": side}
            with lake.transaction(f"film {number}") as transaction:
                staged = transaction.staging(".mcap")
                with RecordWriter(staged, metadata={"camera": {"name": "made"}}) as record:
                    for k in range(FRAMES):
                        at = START + k * PERIOD
                        record.frame(
                            log_time=at, publish_time=at, timestamp=at, image=picture(number, k, 32)
                        )
                    record.truth({"wind_speed": 2.0 + number}, log_time=START)
                stored = transaction.put(staged)
                recording = Artifact(
                    kind=Kind.RECORDING,
                    name=f"film {number}",
                    seed=number,
                    object=stored,
                    rate=25.0,
                    recipe={},
                    **stated,
                )
                transaction.add(recording)
                for clip in clip_rows(Record.open(lake.object_path(stored)), recording):
                    transaction.add(clip)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    made = Lake.create(tmp_path_factory.mktemp("source") / "lake")
    fill(made)
    return made


@pytest.fixture(scope="module")
def data_set(source: Lake) -> Path:
    """All sides in one data set."""
    folder = Path(str(source.path)).parent / "all"
    export(
        source, Export(format="lerobot", where="kind = 'clip'", options={"frames": "png"}), folder
    )
    return folder


def described(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "meta" / "info.json").read_text())


def foreign(data_set: Path, folder: Path, splits: Any) -> Path:
    """As another program leaves it: its splits alone."""
    shutil.copytree(data_set, folder)
    info = {key: value for key, value in described(folder).items() if key != "flagdata"}
    (folder / "meta" / "info.json").write_text(json.dumps({**info, "splits": splits}))
    return folder


def came_in(folder: Path, lake: Lake, episode: int) -> Artifact:
    options = CameraOptions(rate="native", size=32, episode=episode)
    return ingest_camera(lake, folder, CameraIngest(camera=options)).artifact


def test_a_description_states_the_episodes_of_each_side_and_who_decided(data_set: Path) -> None:
    info = described(data_set)
    assert info["splits"] == DIVIDED
    assert (info["flagdata"]["split_by"]["rule"], info["flagdata"]["split_by"]["datasets"]) == (
        "stated",
        ["made"],
    )
    assert {
        side: size["clips"] for side, size in info["flagdata"]["split_by"]["sides"].items()
    } == {
        "train": 2,
        "test": 1,
    }


@pytest.mark.parametrize(("side", "count"), [("train", 2), ("test", 1)])
def test_an_export_of_one_side_states_that_side(
    source: Lake, tmp_path: Path, side: str, count: int
) -> None:
    request = Export(format="lerobot", where="kind = 'clip'", split=side, options={"frames": "png"})
    export(source, request, tmp_path / "out")
    assert described(tmp_path / "out")["splits"] == {side: f"0:{count}"}


def test_films_of_no_side_are_stated_as_lerobot_does_and_come_in_without_one(
    tmp_path: Path,
) -> None:
    made = Lake.create(tmp_path / "lake")
    fill(made, dataset=None, side=None)
    export(
        made,
        Export(format="lerobot", where="kind = 'clip'", options={"frames": "png"}),
        tmp_path / "out",
    )
    info = described(tmp_path / "out")
    assert (info["splits"], info["flagdata"]["split_by"]) == ({"train": "0:3"}, None)
    assert came_in(tmp_path / "out", Lake.create(tmp_path / "other"), 0).side is None


def test_a_hashed_side_is_the_side_of_what_comes_in(tmp_path: Path) -> None:
    made = Lake.create(tmp_path / "lake")
    fill(made, dataset=None, side=None)
    sizes = flagdata.open(made.path).sides()
    side = max(sizes, key=lambda name: sizes[name].clips)
    request = Export(format="lerobot", where="kind = 'clip'", split=side, options={"frames": "png"})
    export(made, request, tmp_path / "hashed")
    assert described(tmp_path / "hashed")["flagdata"]["split_by"]["rule"] == "hashed"
    film = came_in(tmp_path / "hashed", Lake.create(tmp_path / "other"), 0)
    assert (film.dataset, film.side) == ("hashed", side)


def test_sides_come_in_and_stay_with_the_recordings_and_clips_that_are_made(
    data_set: Path, tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    for episode, side in enumerate(["train", "train", "test"]):
        film = came_in(data_set, lake, episode)
        assert (film.dataset, film.side) == ("made", side)
        declared = invoke(
            "declare", film.id, "--speed", "5", "--sigma", "0.1", "--lake", str(lake.path)
        )
        assert declared.code == 0, declared.err
    catalog = lake.table(lake.view(None))
    clips = clips_of(catalog, None)
    assert clips.num_rows == 3
    assert {
        side: len(on) for side, on in divide(catalog, clips, hashed=HashedSplit()).artifacts.items()
    } == {
        "train": 2,
        "test": 1,
    }


def test_the_splits_of_another_program_are_sides_of_the_folder(
    data_set: Path, tmp_path: Path
) -> None:
    folder = foreign(data_set, tmp_path / "theirs", {"train": "0:1", "val": "1:2"})
    lake = Lake.create(tmp_path / "lake")
    found = [came_in(folder, lake, episode) for episode in range(3)]
    assert [film.side for film in found] == ["train", "val", None]


def test_one_split_of_all_episodes_states_nothing_and_is_reported(
    data_set: Path, tmp_path: Path
) -> None:
    folder = foreign(data_set, tmp_path / "theirs", {"train": "0:3"})
    film = came_in(folder, Lake.create(tmp_path / "lake"), 0)
    assert film.side is None
    assert "side-not-stated" in str(film.report)


@pytest.mark.parametrize(
    "splits",
    [
        {"train": "all"},
        {"train": 3},
        ["train"],
        {"": "0:1"},
        {"a\nb": "0:1"},
        {"train": f"0:{'9' * 5000}"},
    ],
)
def test_splits_that_are_no_ranges_are_damage(data_set: Path, tmp_path: Path, splits: Any) -> None:
    with pytest.raises(CorruptError, match="no ranges of episodes"):
        came_in(foreign(data_set, tmp_path / "theirs", splits), Lake.create(tmp_path / "lake"), 0)


def test_an_episode_in_two_splits_is_damage(data_set: Path, tmp_path: Path) -> None:
    folder = foreign(data_set, tmp_path / "theirs", {"train": "0:2", "test": "1:3"})
    with pytest.raises(CorruptError, match="episode 1 is in the splits 'train' and 'test'"):
        came_in(folder, Lake.create(tmp_path / "lake"), 1)
