"""Parquet exports, read back by pyarrow, pandas and polars."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest

from flagdata.errors import UsageError
from flagdata.export import Export, export

CLIPS = "kind = 'clip'"


def test_the_catalog_reads_back_in_pandas_and_polars_with_its_values(
    known: Any, tmp_path: Path
) -> None:
    export(known.lake, Export(format="parquet"), tmp_path / "out")
    frames = {
        "pandas": pd.read_parquet(tmp_path / "out" / "rows").sort_values("start"),
        "polars": pl.read_parquet(tmp_path / "out" / "rows" / "*.parquet").sort("start"),
    }
    for table in frames.values():
        clips = (
            table[table["kind"] == "clip"]
            if isinstance(table, pd.DataFrame)
            else table.filter(pl.col("kind") == "clip")
        )
        assert list(clips["artifact"]) == list(known.clips)
        assert list(clips["wind"]) == [3.5, 4.5, 5.5]
        assert list(clips["wind_sigma"]) == [0.125] * 3
        assert list(clips["start"]) == known.times[[0, 30, 60]].tolist()
        assert [list(flags) for flags in clips["quality"]] == [[], ["wind-stale"], []]
    assert len(frames["pandas"]) == len(frames["polars"]) == 4  # the recording and its three clips


def test_units_are_in_the_fields_metadata(known: Any, tmp_path: Path) -> None:
    export(
        known.lake,
        Export(format="parquet", where=CLIPS, options={"frames": "jpg"}),
        tmp_path / "out",
    )
    schema = pq.read_schema(tmp_path / "out" / "rows" / "part-00000.parquet")
    units = {
        name: (schema.field(name).metadata or {})[b"unit"]
        for name in ("wind", "start", "rate", "frame_times")
    }
    assert units == {"wind": b"m/s", "start": b"ns", "rate": b"Hz", "frame_times": b"ns"}
    assert (schema.field("wind").metadata or {})[b"about"]


def test_frames_are_the_stored_bytes_with_their_instants(known: Any, tmp_path: Path) -> None:
    export(
        known.lake,
        Export(format="parquet", where=CLIPS, options={"frames": "jpg"}),
        tmp_path / "out",
    )
    table = pl.read_parquet(tmp_path / "out" / "rows" / "*.parquet").sort("start")
    assert table["frames"].to_list() == [list(known.jpegs[i : i + 30]) for i in (0, 30, 60)]
    assert table["frame_times"].to_list() == [known.times[i : i + 30].tolist() for i in (0, 30, 60)]


def test_parts_hold_no_more_frame_bytes_than_asked_for(known: Any, tmp_path: Path) -> None:
    clip_bytes = [sum(map(len, known.jpegs[i : i + 30])) for i in (0, 30, 60)]
    limit = max(clip_bytes) + 10  # one clip fits, two do not
    request = Export(format="parquet", where=CLIPS, options={"frames": "jpg", "shard_bytes": limit})
    export(known.lake, request, tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out" / "rows").glob("*.parquet")) == [
        f"part-0000{i}.parquet" for i in range(3)
    ]
    assert pl.read_parquet(tmp_path / "out" / "rows" / "*.parquet").height == 3


def test_arrays_are_not_a_parquet_column(known: Any, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="none or jpg"):
        export(known.lake, Export(format="parquet", options={"frames": "npy"}), tmp_path / "out")
