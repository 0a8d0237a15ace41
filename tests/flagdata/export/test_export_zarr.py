"""Zarr groups, read back by xarray."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from flagdata.export import Export, export
from flagdata.record import Record


def test_xarray_reads_back_frames_samples_and_instants(known: Any, tmp_path: Path) -> None:
    export(known.lake, Export(format="zarr", where="kind = 'recording'"), tmp_path / "out")
    with xarray.open_zarr(tmp_path / "out" / f"{known.recording}.zarr", consolidated=False) as data:
        # From a minute before the first frame, 80 s after noon, to the last.
        inside = (known.wind_time >= known.times[0] - 60 * 10**9) & (
            known.wind_time <= known.times[-1]
        )
        np.testing.assert_array_equal(data["time"].values.astype(np.int64), known.wind_time[inside])
        np.testing.assert_array_equal(data["wind_speed"].values, known.wind_speed[inside])
        assert data["wind_speed"].attrs["units"] == "m/s"
        assert data["wind_speed"].attrs["standard_name"] == "wind_speed"
        np.testing.assert_array_equal(data["frame_time"].values.astype(np.int64), known.times)
        np.testing.assert_array_equal(
            data["device_time"].values.astype(np.int64), known.times - 7 * 10**9
        )
        row = known.lake.rows({"kind": "recording"}).to_pylist()[0]
        stored = Record.open(known.lake.object_path(row["object"])).frames(0, 90)
        np.testing.assert_array_equal(data["image"].values, stored)
        assert data.attrs["clock_sigma"] == 0.02
        assert json.loads(data.attrs["flagdata_label"])["artifact"] == known.recording
