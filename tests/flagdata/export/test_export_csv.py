"""CSV of the wind, read back by pandas."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from flagdata.core.schema import Kind, SampleFlag
from flagdata.errors import InputError, UsageError
from flagdata.export import Export, export
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries

NOON = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z


def _ns(column: Any) -> list[int]:
    return (
        pd.to_datetime(column, format="ISO8601")
        .astype("datetime64[ns, UTC]")
        .astype("int64")
        .tolist()
    )


def _wind(lake: Lake, *, wind: bool = True) -> str:
    series = WindSeries(
        time=NOON + np.array([0, 1_000_000_001, 2_000_000_000]),
        channels={
            "wind_speed": np.array([1 / 3, np.nan, 4.0]),
            "wind_direction": np.array([0.1, 0.2, np.nan]),
        },
        flags=np.array(
            [0, SampleFlag.MISSING, SampleFlag.STALE | SampleFlag.OUT_OF_RANGE], dtype=np.uint16
        ),
        sensor=Sensor(name="cup"),
    )
    with lake.transaction("wind") as tx:
        path = tx.staging(".mcap")
        with RecordWriter(path, metadata={"provenance": {"source_name": "log.csv"}}) as writer:
            if wind:
                writer.wind(series)
        artifact = Artifact(
            kind=Kind.WIND, name="log", object=tx.put(path), source_hash="b" * 64, start=NOON
        )
        tx.add(artifact)
    return artifact.id


def test_every_sample_is_a_row_that_reads_back_exactly(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    artifact = _wind(lake)
    export(lake, Export(format="csv", where="kind = 'wind'"), tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / f"{artifact}.csv", keep_default_na=False, dtype=str)
    assert list(table) == [
        "time",
        "device_time",
        "wind_speed [m/s]",
        "wind_direction [rad]",
        "flags",
    ]
    assert _ns(table["time"]) == [NOON, NOON + 1_000_000_001, NOON + 2_000_000_000]
    assert [float(cell) if cell else None for cell in table["wind_speed [m/s]"]] == [
        1 / 3,
        None,
        4.0,
    ]
    assert [float(cell) if cell else None for cell in table["wind_direction [rad]"]] == [
        0.1,
        0.2,
        None,
    ]
    assert table["flags"].tolist() == ["", "MISSING", "STALE;OUT_OF_RANGE"]
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["samples"] == 3
    assert manifest["units"] == {"wind_speed": "m/s", "wind_direction": "rad"}
    assert "wind_direction" in manifest["frames"]


def test_a_recording_gives_all_of_its_wind(known: Any, tmp_path: Path) -> None:
    export(known.lake, Export(format="csv", where="kind = 'recording'"), tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / f"{known.recording}.csv")
    assert _ns(table["time"]) == known.wind_time.tolist()
    assert table["wind_speed [m/s]"].tolist() == known.wind_speed.tolist()


def test_clips_hold_no_wind_of_their_own(known: Any, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="csv cannot hold 3 of kind clip"):
        export(known.lake, Export(format="csv", where="kind = 'clip'"), tmp_path / "out")


def test_a_record_without_wind_is_named(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    artifact = _wind(lake, wind=False)
    with pytest.raises(InputError, match="without wind") as raised:
        export(lake, Export(format="csv"), tmp_path / "out")
    assert raised.value.where == artifact
    assert not (tmp_path / "out").exists()
