"""Episodes of LeRobot data sets come in with their pictures and instants."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError, NotFoundError, TimeError, UnknownNameError
from flagdata.export import Export, export
from flagdata.ingest.camera import CameraOptions, open_camera
from flagdata.ingest.classify import classify
from flagdata.ingest.store import CameraIngest, ingest_camera
from flagdata.lake import Lake
from tests.flagdata.export.conftest import NOON
from tests.flagdata.export.conftest import known as known


def options(episode: int | None = 1, **others: Any) -> CameraOptions:
    return CameraOptions(rate="native", size=64, episode=episode, **others)


@pytest.fixture(scope="module", params=["png", "av1"])
def data_set(known: Any, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    folder = tmp_path_factory.mktemp("lerobot") / request.param
    export(known.lake, Export(format="lerobot", where="kind = 'clip'", options={"frames": request.param}), folder)
    return folder


def test_an_episode_of_ours_has_the_instants_and_grays_that_were_recorded(known: Any, data_set: Path) -> None:
    assert classify(data_set).kind == "camera"
    with open_camera(data_set, options()) as stream:
        frames = list(stream)
    assert [frame.time for frame in frames] == known.times[30:60].tolist()
    # 48 rows of pictures stand in the middle of 64; JPEG, and AV1 at crf 30, keep their mean to a level or two.
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


def test_without_instants_of_their_own_frames_count_from_the_start_that_is_given(data_set: Path) -> None:
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
        np.testing.assert_allclose(np.array(times) - NOON, np.arange(30) / info["fps"] * 1e9, atol=200)
        for change in ({"codebase_version": "v2.1"}, {"storage_format": "lance"}):
            where.write_text(json.dumps(info | change))
            with pytest.raises(InputError, match=next(iter(change.values()))):
                open_camera(data_set, options())
    finally:
        where.write_text(whole)
