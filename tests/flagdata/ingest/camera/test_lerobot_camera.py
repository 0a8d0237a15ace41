"""Episodes of LeRobot data sets come in with their pictures and instants."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flagdata.errors import CorruptError, InputError, NotFoundError, TimeError, UnknownNameError
from flagdata.export import Export, export
from flagdata.ingest import CameraIngest, CameraOptions, classify, ingest_camera, open_camera
from flagdata.ingest.camera.lerobot_camera import stamps_of
from flagdata.lake import Lake
from tests.flagdata.export.conftest import NOON
from tests.flagdata.export.conftest import known as known


def options(episode: int | None = 1, **others: Any) -> CameraOptions:
    return CameraOptions(rate="native", size=64, episode=episode, **others)


@pytest.fixture(scope="module", params=["png", "av1"])
def data_set(
    known: Any, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest
) -> Path:
    folder = tmp_path_factory.mktemp("lerobot") / request.param
    export(
        known.lake,
        Export(format="lerobot", where="kind = 'clip'", options={"frames": request.param}),
        folder,
    )
    return folder


def test_an_episode_of_ours_has_the_instants_and_grays_that_were_recorded(
    known: Any, data_set: Path
) -> None:
    assert classify(data_set).kind == "camera"
    with open_camera(data_set, options()) as stream:
        frames = list(stream)
    assert [frame.time for frame in frames] == known.times[30:60].tolist()
    # 48 rows of pictures stand in the middle of 64; JPEG, and AV1 at crf 30, keep their mean to a
    # level or two.
    means = np.array([frame.image[8:56].mean() for frame in frames])
    np.testing.assert_allclose(means, known.images[30:60].mean(axis=(1, 2)), atol=2)


def test_an_episode_becomes_a_camera_of_the_lake_once(data_set: Path, lake: Lake) -> None:
    made = ingest_camera(lake, data_set, CameraIngest(camera=options(2)))
    assert made.created
    assert made.artifact.frame_count == 30
    assert not ingest_camera(lake, data_set, CameraIngest(camera=options(2))).created
    assert ingest_camera(lake, data_set, CameraIngest(camera=options(0))).created


def test_a_choice_that_is_missing_or_wrong_is_refused_with_what_there_is(data_set: Path) -> None:
    with pytest.raises(InputError, match="3 episodes") as raised:
        open_camera(data_set, options(None))
    assert "--episode 0 to 2" in raised.value.fix
    with pytest.raises(NotFoundError, match="no episode 7"):
        open_camera(data_set, options(7))
    with pytest.raises(UnknownNameError, match="unknown camera"):
        open_camera(data_set, options(topic="observation.images.camra"))


def test_without_instants_of_their_own_frames_count_from_the_start_that_is_given(
    data_set: Path,
) -> None:
    where = data_set / "meta" / "info.json"
    whole = where.read_text()
    info = json.loads(whole)
    del info["features"]["flagdata.time"]
    try:
        where.write_text(json.dumps(info))
        with pytest.raises(TimeError, match="--start"):
            open_camera(data_set, options())
        with open_camera(data_set, options(start=NOON)) as stream:
            times = [frame.time for frame in stream]
        assert "stamps-synthetic" in {finding.kind for finding in stream.findings}
        np.testing.assert_allclose(
            np.array(times) - NOON, np.arange(30) / info["fps"] * 1e9, atol=200
        )
        for change in ({"codebase_version": "v2.1"}, {"storage_format": "lance"}):
            where.write_text(json.dumps(info | change))
            with pytest.raises(InputError, match=next(iter(change.values()))):
                open_camera(data_set, options())
    finally:
        where.write_text(whole)


@pytest.mark.parametrize(
    "path",
    [
        "../{chunk_index}.parquet",
        "/etc/{file_index}",
        "data/{episode}.parquet",
        "{chunk_index:>999999999}",
    ],
)
def test_a_path_of_the_description_that_leaves_the_data_set_or_names_no_file_is_refused(
    data_set: Path, tmp_path: Path, path: str
) -> None:
    folder = changed(data_set, tmp_path, data_path=path)
    with pytest.raises(CorruptError, match=r"leads out of|names no file"):
        open_camera(folder, options())


def test_a_description_without_a_frame_rate_is_refused(data_set: Path, tmp_path: Path) -> None:
    with pytest.raises(CorruptError, match="frame rate"):
        open_camera(changed(data_set, tmp_path, fps=0), options())


@pytest.mark.parametrize("missing", ["data/file_index", "episode_index"])
def test_a_table_of_episodes_that_lacks_a_number_is_damaged(
    data_set: Path, tmp_path: Path, missing: str
) -> None:
    folder = changed(data_set, tmp_path)
    path = folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet"
    pq.write_table(pq.read_table(path).slice(1, 1).drop_columns([missing]), path)
    with pytest.raises(CorruptError, match=f"does not state {missing}"):
        open_camera(folder, options(None))


def test_a_film_that_ends_before_it_begins_and_one_that_is_a_list_of_other_files_are_refused(
    known: Any, data_set: Path, tmp_path: Path
) -> None:
    if data_set.name != "av1":
        return
    folder = changed(data_set, tmp_path)
    table = folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet"
    rows = pq.read_table(table)
    column = "videos/observation.images.camera/to_timestamp"
    wrong = rows.set_column(
        rows.column_names.index(column), column, pa.array([0.0] * rows.num_rows)
    )
    pq.write_table(wrong, table)
    with pytest.raises(CorruptError, match="its film lasts from"):
        open_camera(folder, options())
    pq.write_table(rows, table)
    (film,) = folder.rglob("*.mp4")
    film.write_text("#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n/etc/passwd\n#EXT-X-ENDLIST\n")
    with pytest.raises(InputError, match="cannot be opened as a video"):
        open_camera(folder, options())


@pytest.mark.parametrize(
    "values",
    [
        pa.array([0.0, float("nan")]),
        pa.array([0.0, None]),
        pa.array(["0", "1"]),
        pa.array([0.0, 1e300]),
    ],
)
def test_stamps_that_are_no_instants_are_damage(values: pa.Array) -> None:
    with pytest.raises(CorruptError, match="no instants"):
        stamps_of(pa.table({"timestamp": values}), "here")
    np.testing.assert_array_equal(
        stamps_of(pa.table({"timestamp": [0.0, 0.25]}), "here"), [0, 250_000_000]
    )


def changed(data_set: Path, tmp_path: Path, **description: Any) -> Path:
    """A copy of a data set with another description."""
    folder = tmp_path / "copy"
    shutil.copytree(data_set, folder)
    where = folder / "meta" / "info.json"
    where.write_text(json.dumps(json.loads(where.read_text()) | description))
    return folder
