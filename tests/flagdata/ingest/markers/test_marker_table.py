"""Marker tables: what a row says, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flagdata.core.schema import Kind
from flagdata.errors import CorruptError, InputError, UnknownNameError, UsageError
from flagdata.ingest import MarkerOptions, ingest_markers, is_marker_table, read_table
from flagdata.lake import Lake, read_markers
from tests.program import invoke
from tests.refusals import unrefused

HEADER = "time,marker,u,v,x,y,z"
ROWS = (
    "0.00,a,0,0,0,0,1",
    "0.00,b,1.5,0,1.2,0.1,0.9",
    "0.04,a,0,0,0,0,1",
    "0.08,a,0,0,,,",
    "0.08,b,1.5,0,1.3,0.1,0.9",
)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "tracks.csv"
    path.write_text("\n".join([HEADER, *ROWS]) + "\n")
    return path


def _written(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "table.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_missing_row_and_an_empty_position_are_both_not_tracked(table: Path):
    sequence = read_table(table)[""]
    assert sequence.names == ("a", "b")
    assert sequence.time.tolist() == [0, 40_000_000, 80_000_000]
    np.testing.assert_array_equal(sequence.rest, [[0, 0], [1.5, 0]])
    np.testing.assert_array_equal(
        np.isnan(sequence.positions).all(axis=2), [[False, False], [False, True], [True, False]]
    )
    np.testing.assert_array_equal(sequence.positions[2, 1], [1.3, 0.1, 0.9])


def test_units_scale_space_and_rest_each_by_their_own(tmp_path: Path):
    path = _written(tmp_path, "frame,marker,u,v,x,y,z", "0,a,150,0,1000,0,0", "1,a,150,0,0,2000,0")
    sequence = read_table(path, MarkerOptions(rate=50.0, unit="mm", rest_unit="cm"))[""]
    np.testing.assert_allclose(sequence.rest, [[1.5, 0.0]])
    np.testing.assert_allclose(sequence.positions[:, 0], [[1, 0, 0], [0, 2, 0]])
    assert sequence.time.tolist() == [0, 20_000_000]


def test_csv_with_semicolons_and_parquet_say_the_same(table: Path, tmp_path: Path):
    semicolons = _written(tmp_path, *(line.replace(",", ";") for line in (HEADER, *ROWS)))
    cells = [line.split(",") for line in ROWS]
    columns = dict(zip(HEADER.split(","), zip(*cells, strict=True), strict=True))
    arrays = {
        name: pa.array(list(values))
        if name == "marker"
        else pa.array([float(v) if v else None for v in values])
        for name, values in columns.items()
    }
    parquet = tmp_path / "tracks.parquet"
    pq.write_table(pa.table(arrays), parquet)
    expected = read_table(table)[""]
    for path in (semicolons, parquet):
        np.testing.assert_array_equal(read_table(path)[""].positions, expected.positions)


def test_one_table_may_hold_several_recordings(tmp_path: Path):
    path = _written(
        tmp_path,
        "recording," + HEADER,
        "slow,0,a,0,0,1,2,3",
        "slow,0.1,a,0,0,1,2,4",
        "fast,5,a,0,0,7,8,9",
    )
    found = read_table(path)
    assert list(found) == ["slow", "fast"]
    assert [len(s.time) for s in found.values()] == [2, 1]
    np.testing.assert_array_equal(found["fast"].positions[0, 0], [7, 8, 9])


def test_malformed_tables_are_refused_with_the_reason(tmp_path: Path):
    cases = [
        (["time,marker,u,v,x,y", "0,a,0,0,0,0"], MarkerOptions(), InputError, "columns missing: z"),
        ([HEADER + ",qualty", "0,a,0,0,0,0,0,1"], MarkerOptions(), UnknownNameError, "qualty"),
        ([HEADER, "0,a,0,0,0,0,zero"], MarkerOptions(), InputError, "not a table of numbers"),
        (
            [HEADER, "0,a,0,0,0,0,0", "0,a,0,0,0,0,0"],
            MarkerOptions(),
            InputError,
            "twice in a frame",
        ),
        (
            [HEADER, "0,a,0,0,0,0,0", "1,a,0.5,0,0,0,0"],
            MarkerOptions(),
            InputError,
            "has u from 0 to 0.5",
        ),
        ([HEADER, "0,a,,0,0,0,0"], MarkerOptions(), InputError, "has no u"),
        ([HEADER, ",a,0,0,0,0,0"], MarkerOptions(), InputError, "has no time"),
        ([HEADER, "0,a,0,0,0,0,0"], MarkerOptions(rate=25.0), UsageError, "times of its own"),
        (
            ["frame,marker,u,v,x,y,z", "0,a,0,0,0,0,0"],
            MarkerOptions(),
            UsageError,
            "frame numbers only",
        ),
        (
            ["frame,marker,u,v,x,y,z", "0.5,a,0,0,0,0,0"],
            MarkerOptions(rate=25.0),
            InputError,
            "decimals",
        ),
        ([HEADER], MarkerOptions(), InputError, "no rows"),
    ]
    assert not unrefused(
        lambda lines, options: read_table(_written(tmp_path, *lines), options), cases
    )


def test_ingesting_twice_adds_nothing_and_the_store_gives_the_table_back(
    table: Path, tmp_path: Path
):
    lake = Lake.create(tmp_path / "lake")
    (first,), (second,) = ingest_markers(lake, table), ingest_markers(lake, table)
    assert (first.created, second.created, second.artifact.id) == (True, False, first.artifact.id)
    assert (first.artifact.kind, first.artifact.frame_count, first.artifact.rate) == (
        Kind.MARKERS,
        3,
        25.0,
    )
    assert first.artifact.quality == ("markers-not-tracked",)
    stored = read_markers(lake.object_path(first.artifact.object or ""))
    np.testing.assert_array_equal(stored.positions, read_table(table)[""].positions)
    assert stored.names == ("a", "b")


def test_a_chunk_lost_from_the_store_does_not_pass_for_markers_lost(table: Path, tmp_path: Path):
    lake = Lake.create(tmp_path / "lake")
    (result,) = ingest_markers(lake, table)
    path = lake.object_path(result.artifact.object or "")
    shard = next(
        p for p in (path / "positions").rglob("*") if p.is_file() and p.name != "zarr.json"
    )
    shard.parent.chmod(0o755)
    shard.unlink()
    with pytest.raises(CorruptError, match="4 were tracked"):
        read_markers(path)


def test_the_command_identifies_marker_tables_by_their_columns(table: Path, tmp_path: Path):
    assert is_marker_table(table)
    assert not is_marker_table(_written(tmp_path, "time,wind_speed", "0,3"))
    lake = Lake.create(tmp_path / "lake")
    ended = invoke("ingest", table, "--lake", lake.path, "--json")
    assert ended.code == 0
    (entry,) = ended.document["results"]
    assert entry["report"]["kind"] == "markers"
    assert entry["report"]["tracked"] == 4


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8"])
def test_text_that_ends_within_a_letter_is_refused(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "markers.csv"
    path.write_bytes(
        "marker,u,v,x,y,z,frame\n1,0,0,0,0,0,0\n2,0,1,0,0,0,0\nü".encode(encoding)[:-1]
    )
    with pytest.raises(InputError):
        read_table(path, MarkerOptions(rate=25.0))
