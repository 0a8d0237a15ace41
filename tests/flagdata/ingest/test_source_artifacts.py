"""From a source file to an artifact: identity, provenance, and a lake that is unchanged by what
fails."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.json_values import json_values
from flagdata.core.provenance import file_hash
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, InputError, NotFoundError, TimeError
from flagdata.ingest import (
    CameraIngest,
    CameraOptions,
    CropBox,
    Labels,
    WindIngest,
    WindOptions,
    ingest_camera,
    ingest_wind,
    open_camera,
    source_artifacts,
)
from flagdata.lake import Lake
from flagdata.record import Coding, Record
from tests.confirming import CONFIRMED
from tests.flagdata.conftest import write_video

START = 1_777_629_600_000_000_000  # 2026-05-01T10:00:00Z


def _everything(lake: Lake) -> list[str]:
    return sorted(
        str(p.relative_to(lake.path))
        for p in lake.path.rglob("*")
        if p.is_file() and "staging" not in p.parts
    )


def test_a_camera_file_becomes_one_row_and_one_record_on_its_own_clock(
    lake: Lake, video: Path
) -> None:
    result = ingest_camera(lake, video, labels=Labels(session="field-1"))
    assert result.created
    row = lake.rows().to_pylist()[0]
    assert (row["kind"], row["name"], row["session"], row["day"]) == (
        "camera",
        "field",
        "field-1",
        "2026-05-01",
    )
    assert (row["source_name"], row["source_hash"]) == ("field.mp4", file_hash(video))
    # 100 frames at 50 Hz last from 0 to 1.98 s; at 25 Hz that is every second frame, 0 to 1.96 s.
    assert (row["frame_count"], row["rate"], row["start"], row["end"]) == (
        50,
        25.0,
        START,
        START + 1_960_000_000,
    )
    record = Record.open(lake.object_path(row["object"]))
    np.testing.assert_array_equal(record.frame_times, START + 40_000_000 * np.arange(50))
    np.testing.assert_array_equal(record.device_frame_times, record.frame_times)
    assert record.frames(0, 50).shape == (50, 300, 300)
    assert record.metadata["camera"]["codec"] == "h264"
    assert record.metadata["provenance"]["source_hash"] == file_hash(video)
    assert json.loads(record.metadata["provenance"]["recipe"]) == json.loads(row["recipe"])


def test_the_frames_stored_are_the_frames_of_the_stream(lake: Lake, video: Path) -> None:
    artifact = ingest_camera(lake, video).artifact
    assert artifact.object is not None
    stored = Record.open(lake.object_path(artifact.object)).frames(0, 50)
    with open_camera(video) as stream:
        frames = np.stack([frame.image for frame in stream])
    # JPEG at quality 90: a few grey levels, on edges more.
    assert np.abs(stored.astype(int) - frames).mean() < 2


def test_a_log_becomes_one_row_with_the_vendor_file_attached(lake: Lake, wind_log: Path) -> None:
    result = ingest_wind(lake, wind_log)
    row = lake.rows().to_pylist()[0]
    assert (row["kind"], row["name"], row["rate"], row["frame_count"]) == (
        "wind",
        "mast",
        1.0,
        None,
    )
    assert (row["start"], row["end"]) == (START, START + 119_000_000_000)
    record = Record.open(lake.object_path(row["object"]))
    assert record.attachment("mast.csv") == wind_log.read_bytes()
    series = record.wind()
    assert series is not None
    assert len(series) == 120
    assert np.flatnonzero(np.isnan(series.channels["wind_speed"])).tolist() == [30]
    assert series.channels["wind_direction"][0] == pytest.approx(np.deg2rad(200))
    means = record.wind_1hz()
    assert means is not None
    assert len(means.time) == 119
    assert result.report["samples"] == 120
    assert "missing-values" in row["quality"]


@pytest.mark.parametrize("kind", [Kind.CAMERA, Kind.WIND])
def test_ingesting_again_finds_what_is_there_and_writes_nothing(
    lake: Lake, video: Path, wind_log: Path, kind: Kind, tmp_path: Path
) -> None:
    def ingest(path: Path) -> source_artifacts.IngestResult:
        return ingest_camera(lake, path) if kind is Kind.CAMERA else ingest_wind(lake, path)

    source = video if kind is Kind.CAMERA else wind_log
    first = ingest(source)
    before = _everything(lake)
    again = ingest(source)
    renamed = tmp_path / f"other{source.suffix}"
    renamed.write_bytes(source.read_bytes())
    third = ingest(renamed)
    assert (first.created, again.created, third.created) == (True, False, False)
    assert again.artifact == third.artifact
    assert again.artifact.id == first.artifact.id
    assert again.report == first.report
    assert _everything(lake) == before


def test_other_options_are_another_artifact(lake: Lake, video: Path) -> None:
    whole = ingest_camera(lake, video)
    cropped = ingest_camera(
        lake, video, CameraIngest(camera=CameraOptions(crop=CropBox(x=8, y=0, width=48, height=48)))
    )
    archived = ingest_camera(lake, video, CameraIngest(coding=Coding.H264))
    assert len({whole.artifact.id, cropped.artifact.id, archived.artifact.id}) == 3


def test_a_file_that_is_read_by_other_options_names_the_one_before(
    lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "mast.csv"
    path.write_text(
        "time,wind_speed (m/s)\n"
        + "".join(f"2026-05-01 12:00:{k:02d},{5 + k % 3}\n" for k in range(60))
    )
    wrong = ingest_wind(lake, path, WindIngest(wind=WindOptions(zone="UTC")))
    right = ingest_wind(lake, path, WindIngest(wind=WindOptions(zone="+02:00")))
    (found,) = [found for found in right.report["findings"] if found["kind"] == "ingested-before"]
    assert "zone UTC, now +02:00" in found["what"]
    named = found["fix"].partition("flagdata withdraw ")[2].split()[0]
    assert named
    assert wrong.artifact.id.startswith(named)
    assert not [found for found in wrong.report["findings"] if found["kind"] == "ingested-before"]
    assert "ingested-before" not in right.artifact.quality


@pytest.mark.parametrize("kind", [Kind.CAMERA, Kind.WIND])
def test_other_labels_than_the_artifact_has_are_refused_and_the_same_ones_find_it(
    lake: Lake, video: Path, wind_log: Path, kind: Kind
) -> None:
    def ingest(**labels: str) -> source_artifacts.IngestResult:
        ingest, source = (ingest_camera, video) if kind is Kind.CAMERA else (ingest_wind, wind_log)
        return ingest(lake, source, labels=Labels(**labels))

    first = ingest(session="a").artifact
    before = _everything(lake)
    if kind is Kind.CAMERA:
        with pytest.raises(ConflictError, match=r"the session 'a', not 'b'.*flagdata withdraw"):
            ingest(session="b")
    with pytest.raises(ConflictError, match=f"the name '{first.name}', not 'b'"):
        ingest(name="b")
    for labels in ({}, {"session": "a"}, {"name": str(first.name), "session": "a"}):
        assert ingest(**labels).artifact.id == first.id
    assert _everything(lake) == before


def test_the_same_constant_log_enters_once_for_each_session(lake: Lake, tmp_path: Path) -> None:
    rows = "".join(f"2026-05-01 12:00:{k:02d},5.0\n" for k in range(60))
    paths = [tmp_path / name for name in ("first-film.csv", "second-film.csv")]
    for path in paths:
        path.write_text(f"time,wind_speed (m/s)\n{rows}")

    def ingest(path: Path, session: str | None) -> source_artifacts.IngestResult:
        options = WindIngest(wind=WindOptions(zone="UTC", expect=("constant",)))
        return ingest_wind(lake, path, options, labels=Labels(session=session), confirm=CONFIRMED)

    first, second = ingest(paths[0], "a"), ingest(paths[1], "b")
    assert (first.created, second.created) == (True, True)
    assert (second.artifact.session, second.artifact.name) == ("b", "second-film")
    assert not [found for found in second.report["findings"] if found["kind"] == "ingested-before"]
    assert [ingest(paths[0], "b").artifact.id, ingest(paths[1], "a").artifact.id] == [
        second.artifact.id,
        first.artifact.id,
    ]
    assert ingest(paths[1], None).artifact.id == first.artifact.id
    assert len(lake.rows()) == 2


def test_a_session_for_an_artifact_without_one_is_refused(lake: Lake, wind_log: Path) -> None:
    ingest_wind(lake, wind_log)
    with pytest.raises(ConflictError, match="no session, not 'field-1'"):
        ingest_wind(lake, wind_log, labels=Labels(session="field-1"))


def test_the_same_ingest_in_two_lakes_gives_the_same_object(
    tmp_path: Path, video: Path, wind_log: Path
) -> None:
    lakes = [Lake.create(tmp_path / name) for name in ("a", "b")]
    assert len({ingest_camera(lake, video).artifact.object for lake in lakes}) == 1
    assert len({ingest_wind(lake, wind_log).artifact.object for lake in lakes}) == 1


def test_a_recipe_file_counts_by_its_content_and_is_attached(
    lake: Lake, wind_log: Path, tmp_path: Path
) -> None:
    recipe = tmp_path / "mine.toml"
    text = """
name = "mine"
about = "a test"
source = "this test"
[file]
delimiter = ","
[time]
columns = ["time"]
format = "iso"
[channels.wind_speed]
column = "wind_speed (m/s)"
unit = "{unit}"
[sensor]
name = "mine"
"""
    recipe.write_text(text.format(unit="m/s"))
    options = WindIngest(wind=WindOptions(recipe=str(recipe)))
    first = ingest_wind(lake, wind_log, options)
    assert first.artifact.object is not None
    record = Record.open(lake.object_path(first.artifact.object))
    assert record.attachment("mine.recipe.toml") == recipe.read_bytes()
    assert str(tmp_path) not in json.dumps(json_values(first))
    recipe.write_text(text.format(unit="km/h"))
    second = ingest_wind(lake, wind_log, WindIngest(wind=WindOptions(recipe=str(recipe))))
    assert second.artifact.id != first.artifact.id
    assert second.report["mean_speed"] == pytest.approx(first.report["mean_speed"] / 3.6)


def test_an_interruption_leaves_the_lake_unchanged(lake: Lake, video: Path) -> None:
    before = _everything(lake)

    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ingest_camera(lake, video, progress=interrupt)
    assert _everything(lake) == before
    assert lake.rows().num_rows == 0
    assert list(lake.staging.rglob("*.mcap")) == []


def test_a_source_that_changes_while_it_is_read_is_refused(lake: Lake, tmp_path: Path) -> None:
    growing = write_video(tmp_path / "growing.mp4")

    def grow(_: int) -> None:
        with growing.open("ab") as stream:
            stream.write(b"more")

    with pytest.raises(ConflictError, match="changed"):
        ingest_camera(lake, growing, progress=grow)
    assert lake.rows().num_rows == 0


def test_a_missing_start_is_a_time_error_and_a_missing_file_is_named(
    lake: Lake, tmp_path: Path
) -> None:
    with pytest.raises(TimeError, match="--start"):
        ingest_camera(lake, write_video(tmp_path / "a.mp4", creation_time=None))
    with pytest.raises((InputError, NotFoundError), match="nothing"):
        ingest_wind(lake, tmp_path / "nothing.csv")


def test_a_log_over_the_attachment_limit_is_ingested_and_says_so(
    lake: Lake, wind_log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(source_artifacts, "ATTACHMENT_LIMIT", 100)
    result = ingest_wind(lake, wind_log)
    assert "log-not-attached" in result.artifact.quality
    assert result.artifact.object is not None
    assert Record.open(lake.object_path(result.artifact.object)).attachments == (
        "drafted.recipe.toml",
    )


def test_a_crop_from_motion_is_attached_as_a_picture(lake: Lake, video: Path) -> None:
    artifact = ingest_camera(lake, video, CameraIngest(camera=CameraOptions(crop="auto"))).artifact
    assert artifact.object is not None
    picture = Record.open(lake.object_path(artifact.object)).attachment(
        source_artifacts.CROP_PICTURE
    )
    assert picture.startswith(b"\x89PNG")


def test_memory_does_not_grow_with_the_video(lake: Lake, tmp_path: Path) -> None:
    """400 frames of 300×300 are 36 MB; a stream keeps a chunk of 1 MiB and a few frames."""
    path = write_video(tmp_path / "long.mp4", frames=400, rate=25)
    tracemalloc.start()
    ingest_camera(lake, path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 12e6
