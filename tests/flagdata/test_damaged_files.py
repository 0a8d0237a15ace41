"""Every format of file that is read back, with its bytes changed: only errors of flagdata come
out."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError
from flagdata.ingest import MarkerOptions, is_marker_table, read_obj, read_table
from flagdata.ingest.markers import marker_table
from flagdata.lake import (
    Lake,
    MarkerSequence,
    MeshSequence,
    doctor,
    open_meshes,
    read_markers,
    read_meshes,
    write_markers,
    write_meshes,
)
from flagdata.record import Record, RecordWriter, salvage
from flagdata.record.signals import Sensor, WindSeries
from tests.damage import QUICK, changed, damaged, damages, paths, wild

START = 1_767_225_600_000_000_000
GRID = np.stack([np.repeat(np.arange(3.0), 3), np.tile(np.arange(3.0), 3)], axis=1)
Damage = list[tuple[str, float, int]]


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("record") / "sound.mcap"
    with RecordWriter(path, metadata={"camera": {"codec": "made"}}) as writer:
        for k in range(5):
            image = np.full((8, 8), 40 * k, dtype=np.uint8)
            time = START + k * 40_000_000
            writer.frame(log_time=time, publish_time=time, timestamp=time, image=image)
        series = WindSeries(
            time=START + np.arange(20, dtype=np.int64) * 10**9,
            channels={"wind_speed": np.linspace(1, 5, 20)},
            flags=np.zeros(20, dtype=np.uint16),
            sensor=Sensor(name="cup"),
        )
        writer.wind(series)
        writer.truth({"area_weight": 0.2}, log_time=START)
        writer.attach("log.csv", b"time,speed\n" * 9000, media_type="text/csv", log_time=START)
    return path.read_bytes()


def test_a_damaged_record_is_read_as_it_was_or_refused(record: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged.mcap"
    path.write_bytes(record)
    sound = Record.open(path).frames(0, 5)

    @QUICK
    @given(damage=damages)
    def law(damage: Damage) -> None:
        path.write_bytes(damaged(record, damage))
        with suppress(FlagdataError):
            opened = Record.open(path)
            np.testing.assert_array_equal(opened.frames(0, 5), sound)
            assert opened.timestamps(0, 5).tolist() == [START + k * 40_000_000 for k in range(5)]
            wind = opened.wind()
            assert wind is not None
            np.testing.assert_array_equal(wind.channels["wind_speed"], np.linspace(1, 5, 20))
            opened.wind_1hz()
            assert opened.truth == {"area_weight": 0.2}
            assert opened.metadata["camera"] == {"codec": "made"}
            assert opened.attachment("log.csv") == b"time,speed\n" * 9000

    law()


def test_a_damaged_record_is_salvaged_or_refused(record: bytes, tmp_path: Path) -> None:
    path, target = tmp_path / "damaged.mcap", tmp_path / "saved.mcap"

    @QUICK
    @given(damage=damages)
    def law(damage: Damage) -> None:
        path.write_bytes(damaged(record, damage))
        target.unlink(missing_ok=True)
        with suppress(FlagdataError):
            salvage(path, target)
            Record.open(target)

    law()


def write_mesh_store(path: Path) -> None:
    faces = np.array([[0, 3, 1], [1, 3, 4]], dtype=np.int32)
    positions = np.zeros((4, 9, 3), dtype=np.float32)
    positions[..., :2] = GRID
    sequence = MeshSequence(
        time=np.arange(4, dtype=np.int64),
        positions=positions,
        faces=faces,
        rest=GRID.astype(np.float32),
    )
    write_meshes(path, sequence)


def write_marker_store(path: Path) -> None:
    positions = np.zeros((4, 9, 3))
    write_markers(
        path,
        MarkerSequence(
            time=np.arange(4, dtype=np.int64),
            positions=positions,
            rest=GRID,
            names=tuple("abcdefghi"),
        ),
    )


STORES: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "meshes": (write_mesh_store, read_meshes),
    "markers": (write_marker_store, read_markers),
    "xarray": (write_mesh_store, lambda path: open_meshes(path).load()),
}


@pytest.mark.parametrize("kind", ["meshes", "markers"])
def test_a_zarr_store_with_changed_bytes_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    write, read = STORES[kind]
    store = tmp_path / "made.zarr"
    write(store)
    files = {path: path.read_bytes() for path in sorted(store.rglob("*")) if path.is_file()}

    @QUICK
    @given(name=st.sampled_from(sorted(files)), damage=damages)
    def law(name: Path, damage: Damage) -> None:
        name.write_bytes(damaged(files[name], damage))
        try:
            with suppress(FlagdataError):
                read(store)
        finally:
            name.write_bytes(files[name])

    law()


@pytest.mark.parametrize("kind", ["meshes", "markers", "xarray"])
def test_a_chunk_that_states_another_length_than_it_has_is_refused_before_memory_beyond_it_is_read(
    kind: str, tmp_path: Path
) -> None:
    write, read = STORES[kind]
    write(tmp_path / "made.zarr")
    (chunk,) = (
        path for path in (tmp_path / "made.zarr" / "positions" / "c").rglob("*") if path.is_file()
    )
    data = bytearray(chunk.read_bytes())
    length = int.from_bytes(data[12:16], "little")  # of the first of the shard
    data[12:16] = (length + 1).to_bytes(4, "little")
    chunk.write_bytes(data)
    with pytest.raises(
        (CorruptError, ValueError), match=f"a chunk has {length} bytes and states {length + 1}"
    ):
        read(tmp_path / "made.zarr")


@pytest.mark.parametrize("kind", ["meshes", "markers"])
def test_a_zarr_store_made_by_hand_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    write, read = STORES[kind]
    store = tmp_path / "made.zarr"
    write(store)
    documents = {path: json.loads(path.read_text()) for path in sorted(store.rglob("zarr.json"))}
    known = [(path, place) for path, content in documents.items() for place in paths(content)]

    @QUICK
    @given(place=st.sampled_from(known), value=wild)
    def law(place: tuple[Path, tuple[Any, ...]], value: Any) -> None:
        path, keys = place
        path.write_text(json.dumps(changed(documents[path], keys, value)))
        try:
            with suppress(FlagdataError):
                read(store)
        finally:
            path.write_text(json.dumps(documents[path]))

    law()


@pytest.mark.parametrize(
    ("keys", "value"),
    [
        (("shape",), [10**9, 9, 3]),
        (("shape",), [10**18, 9, 3]),
        (("shape",), [4, 10**12, 3]),
        (("chunk_grid", "configuration", "chunk_shape"), [10**12, 9, 3]),
    ],
)
@pytest.mark.parametrize("kind", ["meshes", "markers"])
def test_a_store_that_claims_a_huge_shape_is_refused_before_memory_is_taken(
    kind: str, keys: tuple[str, ...], value: list[int], tmp_path: Path
) -> None:
    write, read = STORES[kind]
    write(tmp_path / "made.zarr")
    path = tmp_path / "made.zarr" / "positions" / "zarr.json"
    path.write_text(json.dumps(changed(json.loads(path.read_text()), keys, value)))
    if kind == "meshes" and keys == (
        "shape",
    ):  # read frame by frame: `time` says how many there are
        time = tmp_path / "made.zarr" / "time" / "zarr.json"
        time.write_text(json.dumps(changed(json.loads(time.read_text()), keys, value[:1])))
    with pytest.raises((LimitError, CorruptError)):
        read(tmp_path / "made.zarr")


def marker_rows(path: Path) -> None:
    names = [str(marker) for _ in range(4) for marker in range(9)]
    columns = {"marker": names, "frame": np.repeat(np.arange(4), 9), "u": np.tile(GRID[:, 0], 4)}
    columns |= {
        "v": np.tile(GRID[:, 1], 4),
        "x": np.zeros(36),
        "y": np.zeros(36),
        "z": np.arange(36.0),
    }
    pyarrow.parquet.write_table(pa.table(columns), path, write_page_checksum=True)


def read_or_refused_when_damaged(path: Path, sound: bytes) -> None:
    @QUICK
    @given(damage=damages)
    def law(damage: Damage) -> None:
        path.write_bytes(damaged(sound, damage))
        is_marker_table(path)
        with suppress(FlagdataError):
            read_table(path, MarkerOptions(rate=25.0))

    law()


def test_a_damaged_parquet_table_of_markers_is_read_or_refused_and_so_is_one_with_a_flipped_byte_of_its_footer(
    tmp_path: Path,
) -> None:
    path = tmp_path / "markers.parquet"
    marker_rows(path)
    sound = path.read_bytes()
    assert set(read_table(path, MarkerOptions(rate=25.0))) == {""}
    read_or_refused_when_damaged(path, sound)
    length = int.from_bytes(sound[-8:-4], "little")
    for place in range(len(sound) - 8 - length, len(sound), 7):
        path.write_bytes(sound[:place] + bytes([sound[place] ^ 0xFF]) + sound[place + 1 :])
        is_marker_table(path)
        with suppress(FlagdataError):
            read_table(path, MarkerOptions(rate=25.0))


def test_a_parquet_table_beyond_the_limit_says_which(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker_rows(tmp_path / "markers.parquet")
    monkeypatch.setattr(marker_table, "POSITIONS_LIMIT", 35)
    with pytest.raises(LimitError, match="at most 35 rows"):
        read_table(tmp_path / "markers.parquet", MarkerOptions(rate=25.0))


def test_a_damaged_table_of_markers_in_text_is_read_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "markers.csv"
    rows = [
        "marker,u,v,x,y,z,frame",
        *(f"{m},{m % 3},{m // 3},0.1,0.2,0.3,{f}" for f in range(3) for m in range(9)),
    ]
    sound = "\n".join(rows).encode()

    read_or_refused_when_damaged(path, sound)


def test_a_damaged_obj_file_is_read_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "0000_00.obj"
    sound = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nny 0 0 1\nf 1/1 2/2 3/3\n"

    @QUICK
    @given(damage=damages)
    def law(damage: Damage) -> None:
        path.write_bytes(damaged(sound, damage))
        with suppress(FlagdataError):
            read_obj(path)

    law()


@pytest.mark.parametrize(
    "name", ["lake.json", "refs/tags/v1.json", "catalog/_delta_log/00000000000000000000.json"]
)
def test_a_lake_whose_small_files_are_damaged_is_opened_or_refused(
    name: str, tmp_path: Path
) -> None:
    made = Lake.create(tmp_path / "made")
    made.tag("v1")
    path = tmp_path / "lake" / name
    shutil.copytree(made.path, tmp_path / "lake")
    sound = path.read_bytes()

    @QUICK
    @given(damage=damages)
    def law(damage: Damage) -> None:
        path.write_bytes(damaged(sound, damage))
        with suppress(FlagdataError):
            lake = Lake.open(tmp_path / "lake")
            doctor(lake)
            lake.rows()
            lake.rows(at="v1")

    law()


def test_a_table_that_is_no_parquet_behind_its_first_bytes_is_refused(tmp_path: Path) -> None:
    (tmp_path / "markers.parquet").write_bytes(b"PAR1" + b"\x00" * 100)
    with pytest.raises(InputError, match="Parquet file cannot be read"):
        read_table(tmp_path / "markers.parquet", MarkerOptions(rate=25.0))
