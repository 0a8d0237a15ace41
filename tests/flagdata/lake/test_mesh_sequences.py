"""Mesh sequences come back bit for bit, equal ones are one object, and damage is an error."""

from __future__ import annotations

import json
import multiprocessing
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.files.checksums import content_hash
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, CorruptError, InputError
from flagdata.lake import (
    Artifact,
    Lake,
    MeshSequence,
    RaggedMeshSequence,
    open_meshes,
    read_meshes,
    write_meshes,
)


def flag(frames: int = 60, rows: int = 21, columns: int = 31) -> MeshSequence:
    """A sheet that waves, 1.5 × 1.0 m, with the rest shape of a grid."""
    u, v = np.meshgrid(np.linspace(0, 1.5, columns), np.linspace(0, 1.0, rows))
    rest = np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float32)
    time = np.arange(frames, dtype=np.int64) * 40_000_000 + 1_700_000_000_000_000_001
    wave = 0.1 * np.sin(4 * rest[None, :, 0] - 0.3 * np.arange(frames)[:, None])
    noise = stream(1, "mesh").normal(scale=1e-3, size=wave.shape)
    positions = np.stack(
        [
            np.broadcast_to(rest[:, 0], wave.shape),
            wave + noise,
            np.broadcast_to(rest[:, 1], wave.shape),
        ],
        2,
    )
    corner = np.arange(rows * columns).reshape(rows, columns)
    lower = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:]], axis=-1).reshape(-1, 3)
    upper = np.stack([corner[:-1, :-1], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 3)
    return MeshSequence(
        time=time,
        positions=positions.astype(np.float32),
        faces=np.concatenate([lower, upper]).astype(np.int32),
        rest=rest,
        attributes={"wind": 4.0, "material": {"name": "ponte", "density": 0.284}},
    )


def ragged() -> RaggedMeshSequence:
    """A triangle, a square of two triangles, and a triangle again."""
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
    positions = np.concatenate([triangle, square, triangle + 1])
    return RaggedMeshSequence(
        time=np.array([0, 40_000_000, 80_000_000], dtype=np.int64),
        positions=positions,
        faces=np.array([[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 1, 2]], dtype=np.int32),
        rest=positions[:, :2].copy(),
        vertex_offset=np.array([0, 3, 7, 10], dtype=np.int64),
        face_offset=np.array([0, 1, 3, 4], dtype=np.int64),
    )


def same(one: MeshSequence | RaggedMeshSequence, other: MeshSequence | RaggedMeshSequence) -> bool:
    names = ["time", "positions", "faces", "rest"]
    names += ["vertex_offset", "face_offset"] if isinstance(one, RaggedMeshSequence) else []
    equal = all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)
    return type(one) is type(other) and equal and one.attributes == other.attributes


@pytest.mark.parametrize(
    "sequence", [flag(), ragged(), flag(frames=1)], ids=["fixed", "ragged", "one-frame"]
)
def test_a_sequence_comes_back_bit_for_bit(
    tmp_path: Path, sequence: MeshSequence | RaggedMeshSequence
) -> None:
    write_meshes(tmp_path / "a.zarr", sequence)
    back = read_meshes(tmp_path / "a.zarr")
    assert same(back, sequence)
    assert back.positions.dtype == np.float32


@pytest.mark.parametrize("sequence", [flag(), ragged()], ids=["fixed", "ragged"])
def test_equal_sequences_have_equal_bytes_and_others_do_not(
    tmp_path: Path, sequence: MeshSequence | RaggedMeshSequence
) -> None:
    write_meshes(tmp_path / "a.zarr", sequence)
    write_meshes(
        tmp_path / "b.zarr",
        replace(sequence, attributes=dict(reversed(sequence.attributes.items()))),
    )
    moved = sequence.positions.copy()
    moved[(0,) * (moved.ndim - 1) + (2,)] += np.float32(1e-6)
    write_meshes(tmp_path / "c.zarr", replace(sequence, positions=moved))
    first, again, other = (content_hash(tmp_path / f"{name}.zarr") for name in "abc")
    assert first == again
    assert first != other


def test_a_part_has_the_frames_asked_for(tmp_path: Path) -> None:
    write_meshes(tmp_path / "fixed.zarr", flag())
    part = read_meshes(tmp_path / "fixed.zarr", first=17, count=30)
    assert np.array_equal(part.time, flag().time[17:47])
    assert np.array_equal(part.frame(0).positions, flag().positions[17])
    write_meshes(tmp_path / "ragged.zarr", ragged())
    square = read_meshes(tmp_path / "ragged.zarr", first=1, count=1).frame(0)
    assert square.positions.shape == (4, 3)
    assert square.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    with pytest.raises(InputError, match="frames 50 to 80 of 60"):
        read_meshes(tmp_path / "fixed.zarr", first=50, count=30)


def test_the_last_frame_of_a_ragged_sequence_is_reached_from_the_end() -> None:
    assert ragged().frame(-1).positions.tolist() == [[1, 1, 1], [2, 1, 1], [1, 2, 1]]


def test_xarray_reads_dimensions_units_and_times(tmp_path: Path) -> None:
    write_meshes(tmp_path / "a.zarr", flag())
    dataset = open_meshes(tmp_path / "a.zarr")
    assert dataset["positions"].dims == ("time", "vertex", "xyz")
    assert dataset["positions"].attrs["units"] == "m"
    assert dataset["faces"].attrs["cf_role"] == "face_node_connectivity"
    # 1.7e18 ns is 2023-11-14T22:13:20 UTC; the sequence begins 1 ns later
    assert dataset["time"].values[0] == np.datetime64("2023-11-14T22:13:20.000000001")
    assert np.array_equal(dataset["positions"].isel(time=3).values, flag().positions[3])


def test_a_sequence_and_its_copy_are_one_object_of_the_lake(lake: Lake) -> None:
    names = []
    for name in ("one", "two"):
        with lake.transaction(f"import {name}") as tx:
            path = tx.staging(".zarr")
            write_meshes(path, flag())
            names.append(tx.put(path))
            tx.add(
                Artifact(
                    kind=Kind.MESHES,
                    name=name,
                    object=names[-1],
                    recipe={"name": name},
                    frame_count=60,
                )
            )
    assert names[0] == names[1]
    assert lake.rows().num_rows == 2
    assert same(read_meshes(lake.object_path(names[0])), flag())


MISFITS: list[tuple[dict[str, object], str]] = [
    ({"positions": np.full((60, 651, 3), np.nan, dtype=np.float32)}, "not finite"),
    ({"positions": flag().positions.astype(np.float64)}, "float64"),
    ({"positions": flag().positions[:30]}, "30"),
    ({"time": flag().time[::-1].copy()}, "does not increase"),
    ({"faces": flag().faces + 1}, "outside 0 to 650"),
    ({"rest": flag().rest[:-1]}, "rest has shape"),
    ({"attributes": {"wind": float("nan")}}, "not JSON"),
]


def test_arrays_that_do_not_fit_are_refused_by_name() -> None:
    for change, message in MISFITS:
        with pytest.raises(InputError, match=message):
            replace(flag(), **change)
    for offset in (
        [0, 3, 7, 9],
        [1, 3, 7, 10],
        [0, 7, 3, 10],
        [0, 3, 10],
    ):  # they do not cover the rows
        with pytest.raises(InputError, match="vertex_offset"):
            replace(ragged(), vertex_offset=np.array(offset, dtype=np.int64))


def test_a_lost_chunk_is_an_error_and_never_filled_in(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    write_meshes(path, flag(frames=3))
    for array in ("positions", "faces", "rest", "time"):
        (path / array / "c").rename(tmp_path / "lost")
        with pytest.raises(CorruptError, match=re.escape(str(path))):
            read_meshes(path)
        (tmp_path / "lost").rename(path / array / "c")
    assert same(read_meshes(path), flag(frames=3))


def test_a_damaged_chunk_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    write_meshes(path, flag())
    shard = path / "positions" / "c" / "0" / "0" / "0"
    content = bytearray(shard.read_bytes())
    content[16:2000] = bytes(1984)
    shard.write_bytes(bytes(content))
    with pytest.raises(CorruptError):
        read_meshes(path)


def test_another_store_and_a_newer_format_are_distinguished(tmp_path: Path) -> None:
    with pytest.raises(CorruptError, match="not a Zarr store"):
        read_meshes(tmp_path)
    path = tmp_path / "a.zarr"
    write_meshes(path, flag(frames=2))
    with pytest.raises(ConflictError):
        write_meshes(path, flag(frames=2))
    marker = path / "zarr.json"
    content = json.loads(marker.read_text())
    content["attributes"]["flagdata_meshes"]["format"] = 2
    marker.write_text(json.dumps(content))
    with pytest.raises(CorruptError, match="format 2 is newer"):
        read_meshes(path)


def _sum_in_child(path: str, queue: multiprocessing.SimpleQueue) -> None:
    queue.put(float(read_meshes(Path(path)).positions.astype(np.float64).sum()))


def test_a_forked_child_reads_after_its_parent_has(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    write_meshes(path, flag())
    expected = float(read_meshes(path).positions.astype(np.float64).sum())
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    child = context.Process(target=_sum_in_child, args=(str(path), queue))
    child.start()
    child.join(timeout=500)
    assert child.exitcode == 0
    assert queue.get() == expected


@pytest.mark.reference
def test_reference_sequences_survive_storage(reference_data: Path, tmp_path: Path) -> None:
    source = np.load(reference_data / "arcsim" / "flag_w4_dt05.npz")
    frames = len(source["positions"])
    sequence = MeshSequence(
        time=np.arange(frames, dtype=np.int64) * 40_000_000,
        positions=source["positions"].astype(np.float32),
        faces=source["faces"].astype(np.int32),
        rest=source["rest"].astype(np.float32),
        attributes=json.loads(str(source["scene"])),
    )
    write_meshes(tmp_path / "a.zarr", sequence)
    assert same(read_meshes(tmp_path / "a.zarr"), sequence)
