"""Records that flagdata exported come back in as what they were."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.align import Pair, given, make_recording
from flagdata.align.film_recording import Alignment
from flagdata.core.schema import CATALOG, Kind
from flagdata.errors import ConflictError, CorruptError
from flagdata.export import Export, export
from flagdata.export.mcap import ROWS
from flagdata.ingest import Labels, classify, ingest_camera, ingest_record, ingest_wind
from flagdata.lake import Lake
from flagdata.record import Record
from tests.confirming import CONFIRMED

OWN = {"branch", "created"}


@dataclass(frozen=True, kw_only=True)
class Made:
    """A lake with a camera, its wind, their recording and its clip, and the folder with the records
    of all."""

    lake: Lake
    folder: Path
    rows: dict[str, dict[str, Any]]

    def record(self, kind: Kind) -> Path:
        return next(
            self.folder / f"{row['artifact']}.mcap"
            for row in self.rows.values()
            if row["kind"] == kind
        )


@pytest.fixture(scope="module")
def made(video: Path, wind_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("records")
    lake = Lake.create(folder / "lake")
    camera = ingest_camera(lake, video, labels=Labels(name="flag", session="field-1")).artifact
    wind = ingest_wind(lake, wind_log, labels=Labels(session="field-1"), confirm=CONFIRMED).artifact
    pair = Pair.of(lake, camera.id, wind.id)
    clock = given("flag", "mast", start=pair.span[0], end=pair.span[1], offset=70.0, sigma=0.2)
    make_recording(lake, pair, Alignment(clock=clock, recipe={"align": "given", "offset": 70.0}))
    export(lake, Export(format="mcap"), folder / "out")
    return Made(
        lake=lake,
        folder=folder / "out",
        rows={row["artifact"]: row for row in lake.rows().to_pylist()},
    )


def without(row: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if name not in OWN}


def test_all_records_of_an_export_restore_the_lake_that_they_came_from(
    made: Made, lake: Lake
) -> None:
    for kind in (Kind.CAMERA, Kind.WIND, Kind.RECORDING):
        assert classify(made.record(kind)).kind == "record"
        assert ingest_record(lake, made.record(kind)).created
    assert {row["artifact"]: without(row) for row in lake.rows().to_pylist()} == {
        artifact: without(row) for artifact, row in made.rows.items()
    }


def test_a_record_comes_in_once(made: Made, lake: Lake) -> None:
    ingest_record(lake, made.record(Kind.CAMERA))
    assert not ingest_record(lake, made.record(Kind.CAMERA)).created
    with pytest.raises(ConflictError, match="'flag'"):
        ingest_record(lake, made.record(Kind.CAMERA), labels=Labels(name="another"))
    assert lake.rows().num_rows == 1


def test_a_recording_without_its_camera_comes_in_with_its_frames_wind_and_clips(
    made: Made, lake: Lake
) -> None:
    result = ingest_record(lake, made.record(Kind.RECORDING))
    assert [finding["kind"] for finding in result.report["findings"]] == ["parents-absent"]
    rows = {row["kind"]: row for row in lake.rows().to_pylist()}
    before = {row["kind"]: row for row in made.rows.values()}
    assert rows["recording"]["parents"] == []
    for kind in ("recording", "clip"):
        for column in (
            "name",
            "session",
            "start",
            "end",
            "frame_count",
            "wind",
            "clock_offset",
            "clock_sigma",
            "object",
        ):
            assert rows[kind][column] == before[kind][column], column


def test_a_record_alone_keeps_its_identity_and_says_that_its_report_is_lacking(
    made: Made, lake: Lake, tmp_path: Path
) -> None:
    for kind in (Kind.CAMERA, Kind.WIND, Kind.RECORDING):
        alone = shutil.copy(made.record(kind), tmp_path / f"{kind}.mcap")
        result = ingest_record(lake, Path(alone))
        assert result.artifact.id == made.record(kind).stem
        assert "report-absent" in result.artifact.quality
    kept = (
        "artifact",
        "kind",
        "source_hash",
        "source_name",
        "recipe",
        "start",
        "end",
        "frame_count",
        "clock_offset",
    )
    found = {row["artifact"]: [row[name] for name in kept] for row in lake.rows().to_pylist()}
    assert found == {artifact: [row[name] for name in kept] for artifact, row in made.rows.items()}


def test_the_part_of_a_record_that_a_clip_covers_is_a_recording_with_that_clip(
    made: Made, lake: Lake
) -> None:
    result = ingest_record(lake, made.record(Kind.CLIP))
    before = next(row for row in made.rows.values() if row["kind"] == Kind.CLIP)
    assert result.artifact.kind is Kind.RECORDING
    (clip,) = lake.rows({"kind": Kind.CLIP}).to_pylist()
    for column in ("name", "session", "start", "end", "wind", "wind_coverage", "clock_sigma"):
        assert clip[column] == before[column], column
    # The part has no wind after the clip, which takes a little part in how fast the wind is found
    # to vary.
    assert clip["wind_sigma"] == pytest.approx(before["wind_sigma"], rel=1e-4)
    original = Record.open(made.lake.object_path(before["object"]))
    frames = Record.open(lake.object_path(clip["object"])).frames(0, clip["frame_count"])
    np.testing.assert_array_equal(
        frames, original.frames(before["frame_first"], before["frame_count"])
    )


def test_a_changed_record_is_refused_and_the_lake_stays(
    made: Made, lake: Lake, tmp_path: Path
) -> None:
    data = bytearray(made.record(Kind.CAMERA).read_bytes())
    place = data.index(b"\xff\xd8\xff") + 400
    data[place] ^= 0xFF
    damaged = tmp_path / made.record(Kind.CAMERA).name
    damaged.write_bytes(data)
    shutil.copy(made.folder / ROWS, tmp_path / ROWS)
    with pytest.raises(CorruptError):
        ingest_record(lake, damaged)
    assert lake.rows().num_rows == 0


def test_the_table_of_rows_has_the_columns_of_the_catalog(made: Made) -> None:
    import pyarrow.parquet as pq

    assert pq.read_table(made.folder / ROWS).column_names == list(CATALOG)
