"""Mesh sequences leave as folders that ArcSim's tools, and this project, read again."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.errors import UsageError
from flagdata.export import Export, export
from flagdata.ingest import read_folder
from flagdata.lake import Artifact, Lake, MeshSequence, RaggedMeshSequence, write_meshes

FACES = np.array([[0, 1, 2]], dtype=np.int32)
REST = np.array([[0, 0], [1, 0], [0, 1]], dtype=np.float32)
Put = Callable[..., str]


@pytest.fixture
def put(lake: Lake) -> Put:
    """Stores a sequence at 50 Hz; its artifact."""

    def make(sequence: MeshSequence | RaggedMeshSequence, **parameters: float) -> str:
        with lake.transaction("meshes") as transaction:
            staged = transaction.staging(".zarr")
            write_meshes(staged, sequence)
            artifact = Artifact(
                kind=Kind.MESHES,
                name="m",
                object=transaction.put(staged),
                recipe=parameters,
                rate=50.0,
                seed=4,
                parameters=canonical(parameters),
            )
            transaction.add(artifact)
        return artifact.id

    return make


def moving(first: int = 0, **attributes: object) -> MeshSequence:
    """Three frames of a triangle that rises by a centimetre a frame."""
    lift = np.float32([0, 0.01, 0.02])[:, None] * np.float32([0, 0, 1])
    positions = (np.float32([[0, 0, 0], [0, 1, 0], [0, 0, 1]]) + lift[:, None]).astype(np.float32)
    time = first + np.arange(3, dtype=np.int64) * 20_000_000
    return MeshSequence(
        time=time, positions=positions, faces=FACES, rest=REST, attributes=attributes
    )


def test_a_simulated_sequence_comes_back_with_its_wind(
    lake: Lake, put: Put, tmp_path: Path
) -> None:
    sequence = moving(first=4_000_000_000)
    key = put(sequence, wind_speed=5.0, wind_toward=math.pi / 2, wind_vertical=1.0)
    export(lake, Export(format="obj"), tmp_path / "out")
    back = read_folder(tmp_path / "out" / key)
    assert isinstance(back, MeshSequence)
    for name in ("positions", "faces", "rest"):
        np.testing.assert_array_equal(getattr(back, name), getattr(sequence, name))
    assert back.time.tolist() == [0, 20_000_000, 40_000_000]
    scene = json.loads((tmp_path / "out" / key / "conf.json").read_text())
    np.testing.assert_allclose(scene["wind"]["velocity"], [0, 5, 1], atol=1e-12)
    assert (scene["frame_time"], scene["flagdata"]["first"], scene["flagdata"]["seed"]) == (
        0.02,
        4.0,
        4,
    )


def test_an_arcsim_runs_own_scene_goes_with_it(lake: Lake, put: Put, tmp_path: Path) -> None:
    key = put(moving(source="arcsim", scene={"frame_time": 0.04, "magic": {"friction": 0.1}}))
    export(lake, Export(format="obj"), tmp_path / "out")
    scene = json.loads((tmp_path / "out" / key / "conf.json").read_text())
    assert scene == {
        "frame_time": 0.02,
        "magic": {"friction": 0.1},
    }  # at the rate it was ingested with


def test_a_changing_topology_comes_back(lake: Lake, put: Put, tmp_path: Path) -> None:
    positions = np.zeros((7, 3), dtype=np.float32)
    positions[:, 1:] = np.concatenate([REST, REST, np.float32([[1, 1]])])
    sequence = RaggedMeshSequence(
        time=np.array([0, 20_000_000]),
        positions=positions,
        faces=np.int32([[0, 1, 2], [0, 1, 2], [1, 3, 2]]),
        rest=positions[:, 1:].copy(),
        vertex_offset=np.array([0, 3, 7]),
        face_offset=np.array([0, 1, 3]),
    )
    key = put(sequence)
    export(lake, Export(format="obj"), tmp_path / "out")
    back = read_folder(tmp_path / "out" / key)
    assert isinstance(back, RaggedMeshSequence)
    np.testing.assert_array_equal(back.frame(1).faces, sequence.frame(1).faces)
    np.testing.assert_array_equal(back.frame(1).positions, sequence.frame(1).positions)


def test_the_manifest_is_the_same_again_and_counts_frames(
    lake: Lake, put: Put, tmp_path: Path
) -> None:
    put(moving())
    put(moving(first=1), wind_speed=1.0, wind_toward=0.0, wind_vertical=0.0)
    done: list[int] = []
    first = export(lake, Export(format="obj"), tmp_path / "a", advance=done.append).manifest
    assert export(lake, Export(format="obj"), tmp_path / "b").manifest == first
    assert (first["sequences"], first["frames"], first["artifacts"], sum(done)) == (2, 6, 2, 2)
    assert (
        len(first["files"]) == 2 * (3 + 1) + 1
    )  # croissant.json beside 3 frames and a series of each


def test_what_is_no_mesh_sequence_is_refused(lake: Lake, put: Put, tmp_path: Path) -> None:
    put(moving())
    with lake.transaction("a model") as transaction:
        transaction.add(Artifact(kind=Kind.MODEL, name="model"))
    with pytest.raises(UsageError, match="obj cannot hold 1 of kind model"):
        export(lake, Export(format="obj"), tmp_path / "out")
    export(lake, Export(format="obj", where="kind = 'meshes'"), tmp_path / "out")
