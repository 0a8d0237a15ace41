"""OBJ files: what cloth simulators write is read, what is wrong is refused with its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, LimitError, NotFoundError
from flagdata.ingest import Obj, read_obj, write_obj
from flagdata.ingest.meshes import wavefront
from tests.refusals import unrefused

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 2 0\nvt 0 3\n"


def read(folder: Path, text: str) -> Obj:
    path = folder / "mesh.obj"
    path.write_text(text)
    return read_obj(path)


def test_corners_join_positions_and_material_coordinates(tmp_path: Path) -> None:
    mesh = read(tmp_path, TRIANGLE + "vn 0 0 1\nf 1/2/1 2/3/1 3/1/1\n")
    np.testing.assert_array_equal(mesh.positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.rest, [[2, 0], [0, 3], [0, 0]])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])
    assert mesh.textured


def test_indices_below_zero_count_from_the_end(tmp_path: Path) -> None:
    mesh = read(tmp_path, TRIANGLE + "f -3/-3 -2/-2 -1/-1\n")
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])
    np.testing.assert_array_equal(mesh.rest, [[0, 0], [2, 0], [0, 3]])


def test_polygons_become_fans(tmp_path: Path) -> None:
    text = (
        "".join(f"v {x} {y} 0\n" for x, y in [(0, 0), (2, 0), (3, 1), (1, 2), (0, 1)])
        + "f 1 2 3 4 5\n"
    )
    mesh = read(tmp_path, text)
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 3, 4]])
    assert not mesh.textured
    np.testing.assert_array_equal(mesh.rest, mesh.positions[:, :2])


def test_velocities_belong_to_the_vertex_before_them(tmp_path: Path) -> None:
    mesh = read(
        tmp_path, "v 0 0 0\nnv 1 2 3\nv 1 0 0\nv 0 1 0\nny 0 0 0\nnv 0 0 4\nf 1 2 3 # a comment\n\n"
    )
    assert mesh.velocities is not None
    np.testing.assert_array_equal(mesh.velocities, [[1, 2, 3], [0, 0, 0], [0, 0, 4]])


def test_a_malformed_line_is_refused_by_its_number(tmp_path: Path) -> None:
    cases = [
        (TRIANGLE + "f 1/1 2/2 4/3\n", "what is not there", 7),
        (TRIANGLE + "f 1/1 2/2 3/4\n", "what is not there", 7),
        (TRIANGLE + "f 0/1 2/2 3/3\n", "what is not there", 7),
        (TRIANGLE + "f -4/1 2/2 3/3\n", "what is not there", 7),
        (TRIANGLE + "f 1/1 2/2\n", "fewer than three", 7),
        (TRIANGLE + "f" + " 1/1" * 10_001 + "\n", "10,001 corners", 7),
        (TRIANGLE + "f 1/1 2/x 3/3\n", "not a corner", 7),
        (TRIANGLE + "f 1/1 2/2 3/3\nf 1/2 2/2 3/3\n", "two material coordinates", 8),
        ("v 0 0 nan\n", "not 3 finite", 1),
        ("v 0 0 inf\n", "not 3 finite", 1),
        ("v 0 0\n", "not 3 finite", 1),
        ("v 0 0 0x\n", "not 3 finite", 1),
        ("vt 0\n", "not 2 finite", 1),
        ("nv 1 2 3\n", "before any vertex", 1),
        ("solid cube\n", "the keyword 'solid' is unknown", 1),
    ]
    for text, word, line in cases:
        refused = unrefused(
            lambda text: read(tmp_path, text), [(text, word)], InputError, where=f"line {line}$"
        )
        assert refused == []


def test_a_mesh_that_is_none_is_refused(tmp_path: Path) -> None:
    cases = [
        ("v 0 0 0\n", "has no faces"),
        ("", "is empty"),
        (TRIANGLE + "f 1/1 2/2 3\n", "some corners"),
    ]
    assert not unrefused(lambda text: read(tmp_path, text), cases, InputError)


def test_a_file_too_large_or_missing_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wavefront, "SIZE_LIMIT", 10)
    with pytest.raises(LimitError):
        read(tmp_path, TRIANGLE)
    with pytest.raises(NotFoundError):
        read_obj(tmp_path / "none.obj")


def test_a_written_mesh_comes_back_to_the_bit_in_single_precision(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    mesh = Obj(
        positions=rng.normal(size=(9, 3)).astype(np.float32).astype(np.float64),
        faces=np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]]),
        rest=rng.normal(size=(9, 2)).astype(np.float32).astype(np.float64),
        velocities=rng.normal(size=(9, 3)).astype(np.float32).astype(np.float64),
    )
    write_obj(tmp_path / "mesh.obj", mesh)
    back = read_obj(tmp_path / "mesh.obj")
    for name in ("positions", "faces", "rest", "velocities"):
        np.testing.assert_array_equal(
            np.float32(getattr(back, name)), np.float32(getattr(mesh, name))
        )
