"""Commits, catalog reads and mesh sequences, beside what others take for the same.

Wall time. Peers of a commit: the Delta library's own append (which neither flushes to the disk nor
checks identities) and SQLite with full synchronisation. Peers of a mesh read: a memory-mapped .npy,
and Zarr with its defaults.
"""

from __future__ import annotations

import sqlite3
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import zarr
from deltalake import write_deltalake

from flagdata.core.files.checksums import size_of
from flagdata.core.rng import stream
from flagdata.core.schema import CATALOG, CLIP_FRAMES, Kind, catalog_schema
from flagdata.lake import Artifact, Lake, MeshSequence, read_meshes, write_meshes

ROWS = 10_000
COMMITS = 64  # two rounds of tidying
MESH_FRAMES, MESH_ROWS, MESH_COLUMNS = 500, 41, 61


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Median milliseconds of commits and reads over a catalog of `ROWS` rows; size and speed of a
    mesh sequence."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        return {"rows": ROWS, **_catalog(folder), "meshes": _meshes(folder, seed)}


def _catalog(folder: Path) -> dict[str, Any]:
    lake = Lake.create(folder / "lake")
    empty = _commits(lake, "empty")
    began = time.perf_counter()
    with lake.transaction("a batch") as tx:
        for i in range(ROWS):
            tx.add(_clip(i))
    batch = time.perf_counter() - began
    full = _commits(lake, "full")
    selected = "kind = 'clip' and wind between 3 and 6"
    reads = {
        "cold": _milliseconds(lambda _: Lake.open(lake.path).rows()),
        "again": _milliseconds(lambda _: lake.rows()),
        "filtered": _milliseconds(lambda _: lake.rows(selected)),
        "one artifact": _milliseconds(lambda _: lake.artifact(_clip(77).id)),
    }
    winds = lake.rows()["wind"].to_pylist()
    assert lake.rows(selected).num_rows == sum(
        wind is not None and 3 <= wind <= 6 for wind in winds
    )
    return {
        "commit_ms": {
            "on an empty catalog": empty,
            f"on {ROWS} rows": full,
            "deltalake append, not flushed": _delta_peer(folder / "peer"),
            "SQLite, synchronous=FULL": _sqlite_peer(folder / "peer.db"),
        },
        "batch_of_all_rows_s": batch,
        "read_ms": reads,
    }


def _clip(i: int) -> Artifact:
    return Artifact(
        kind=Kind.CLIP,
        name=f"clip {i}",
        source_hash="a" * 64,
        frame_first=30 * i,
        frame_count=30,
        start=i,
        end=i + 1,
        rate=25.0,
        wind=i % 100 / 10,
        wind_sigma=0.1,
        session="s",
        day="2026-05-01",
        recipe={"window": 60.0},
    )


def _commits(lake: Lake, label: str) -> float:
    def commit(i: int) -> None:
        with lake.transaction("one row") as tx:
            tx.add(Artifact(kind=Kind.MEASUREMENT, name="m", recipe={"label": label, "i": i}))

    return _milliseconds(commit)


def _delta_peer(path: Path) -> float:
    rows = pa.Table.from_pylist([_clip(0).row()], schema=catalog_schema())
    return _milliseconds(lambda _: write_deltalake(str(path), rows, mode="append"))


def _sqlite_peer(path: Path) -> float:
    row = [str(value) for value in _clip(0).row().values()]
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA synchronous=FULL")
    columns = ", ".join(f'"{name}"' for name in CATALOG)
    connection.execute(f"CREATE TABLE catalog ({columns})")
    marks = ", ".join("?" * len(CATALOG))

    def commit(_: int) -> None:
        with connection:
            connection.execute(f"INSERT INTO catalog VALUES ({marks})", row)

    took = _milliseconds(commit)
    connection.close()
    return took


def _meshes(folder: Path, seed: int) -> dict[str, Any]:
    sequence = _flag(seed)
    ours, plain, mapped = folder / "ours.zarr", folder / "plain.zarr", folder / "mapped.npy"
    write = {
        "flagdata": _milliseconds(lambda _: write_meshes(ours, sequence), times=1),
        "zarr, defaults": _milliseconds(
            lambda _: zarr.save_array(plain, sequence.positions), times=1
        ),
        "numpy .npy": _milliseconds(lambda _: np.save(mapped, sequence.positions), times=1),
    }
    starts = stream(seed, "starts").integers(0, len(sequence) - CLIP_FRAMES, COMMITS).tolist()
    readers: dict[str, Callable[[int], np.ndarray]] = {
        "flagdata": lambda first: read_meshes(ours, first=first, count=CLIP_FRAMES).positions,
        "zarr, defaults": lambda first: np.asarray(
            zarr.open_array(plain, mode="r")[first : first + CLIP_FRAMES]
        ),
        "numpy .npy, mapped": lambda first: np.load(mapped, mmap_mode="r")[
            first : first + CLIP_FRAMES
        ].copy(),
    }
    for read in readers.values():
        np.testing.assert_array_equal(
            read(starts[0]), sequence.positions[starts[0] : starts[0] + CLIP_FRAMES]
        )
    raw = sequence.positions.nbytes
    return {
        "shape": list(sequence.positions.shape),
        "bytes_over_raw": {"flagdata": size_of(ours) / raw, "zarr, defaults": size_of(plain) / raw},
        "write_ms": write,
        f"read_{CLIP_FRAMES}_frames_ms": {
            name: _milliseconds(lambda i, read=read: read(starts[i]))
            for name, read in readers.items()
        },
    }


def _flag(seed: int) -> MeshSequence:
    """A sheet with a travelling wave and a little noise."""
    u, v = np.meshgrid(np.linspace(0, 1.5, MESH_COLUMNS), np.linspace(0, 1.0, MESH_ROWS))
    rest = np.stack([u.ravel(), v.ravel()], axis=1)
    phase = 4 * rest[None, :, 0] - 0.3 * np.arange(MESH_FRAMES)[:, None]
    wave = 0.1 * np.sin(phase) + stream(seed, "mesh").normal(scale=1e-4, size=phase.shape)
    along = rest[None, :, 0] + 0.01 * np.cos(phase)
    positions = np.stack([along, wave, rest[None, :, 1] - 0.005 * np.cos(0.7 * phase)], axis=2)
    return MeshSequence(
        time=np.arange(MESH_FRAMES, dtype=np.int64) * 40_000_000,
        positions=positions.astype(np.float32),
        faces=np.array([[0, 1, MESH_COLUMNS]], dtype=np.int32),
        rest=rest.astype(np.float32),
    )


def _milliseconds(action: Callable[[int], object], *, times: int = COMMITS) -> float:
    """Median over `times` calls, each given its number."""
    took = []
    for i in range(times):
        began = time.perf_counter()
        action(i)
        took.append(time.perf_counter() - began)
    return float(np.median(took)) * 1e3
