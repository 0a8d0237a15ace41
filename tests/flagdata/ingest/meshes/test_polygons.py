"""Faces of many corners: whatever their shape, the triangles cover them once, or the face is
refused by its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from flagdata.ingest import read_obj
from flagdata.ingest.meshes.wavefront import ears

ELL = [(0.0, 0.0), (0.2, 0.0), (0.2, 0.1), (0.1, 0.1), (0.1, 0.2), (0.0, 0.2)]


def areas(points: FloatArray, triangles: IntArray) -> FloatArray:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def written(
    folder: Path, corners: list[tuple[float, float]], *, text: str = "vt {x} {y}\nv {x} {y} 0\n"
) -> Path:
    path = folder / "mesh.obj"
    names = " ".join(f"{i}/{i}" if "vt" in text else str(i) for i in range(1, len(corners) + 1))
    path.write_text("".join(text.format(x=x, y=y) for x, y in corners) + f"f {names}\n")
    return path


@pytest.mark.parametrize("start", range(6))
@pytest.mark.parametrize("turned", [1, -1])
def test_a_concave_face_is_covered_once_wherever_it_begins(
    tmp_path: Path, start: int, turned: int
) -> None:
    # An L of three squares of 0.1 m: 0.03 m².
    mesh = read_obj(written(tmp_path, [*ELL[start:], *ELL[:start]][::turned]))
    found = areas(mesh.rest, mesh.faces)
    assert len(found) == 4
    assert (found * turned > 0).all()
    assert abs(found.sum()) == pytest.approx(0.03)


@pytest.mark.parametrize("lift", ["v 0 {x} {y}\n", "v {y} 0 {x}\n", "v {x} {y} {x}\n"])
def test_without_texture_the_plane_of_the_face_in_space_counts(tmp_path: Path, lift: str) -> None:
    mesh = read_obj(written(tmp_path, ELL[3:] + ELL[:3], text=lift))
    a, b, c = (mesh.positions[mesh.faces[:, i]] for i in range(3))
    stretch = 2**0.5 if lift == "v {x} {y} {x}\n" else 1.0
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(0.03 * stretch)


def test_every_frame_is_split_alike_however_the_cloth_is_bent(tmp_path: Path) -> None:
    # The square's corners are folded over in space, so that by the plane in space the split would
    # be another one.
    flat = read_obj(written(tmp_path, ELL))
    bent = read_obj(written(tmp_path, ELL, text="vt {x} {y}\nv {y} 0.1 {x}e-1\n"))
    np.testing.assert_array_equal(flat.faces, bent.faces)


def test_corners_in_a_line_make_no_triangle_without_area(tmp_path: Path) -> None:
    mesh = read_obj(
        written(tmp_path, [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)])
    )
    found = areas(mesh.rest, mesh.faces)
    assert found.min() > 0.1
    assert found.sum() == pytest.approx(4)


@pytest.mark.parametrize(
    ("corners", "word"),
    [
        ([(0, 0), (1, 1), (1, 0), (0, 2)], "cross"),
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], "touch"),
        ([(0, 0), (2, 0), (1, 0), (1, 1)], "touch"),
        ([(0, 0), (2, 0), (0, 0), (1, 1), (0, 2)], "touch"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], "touch"),
        ([(0, 0), (1, 0), (2, 0), (3, 0)], "has no area"),
        # A star of five points turns one way only, twice around.
        ([(np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)) for k in range(5)], "cross"),
    ],
)
def test_a_face_that_is_no_simple_polygon_is_refused_by_its_line(
    tmp_path: Path, corners: list[tuple[float, float]], word: str
) -> None:
    with pytest.raises(InputError, match=word) as caught:
        read_obj(written(tmp_path, corners))
    assert (caught.value.where or "").endswith(f"mesh.obj, line {2 * len(corners) + 1}")


@given(
    st.lists(st.floats(0.1, 1.0), min_size=4, max_size=24),
    st.integers(0, 23),
    st.sampled_from([1, -1]),
)
def test_any_star_shaped_polygon_is_covered_once(
    radii: list[float], first: int, turned: int
) -> None:
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    corners = np.roll(
        np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array(radii)[:, None], first, axis=0
    )
    found = areas(corners[::turned], ears(corners[::turned]))
    own = np.array(radii) * np.roll(radii, -1) * np.sin(2 * np.pi / len(radii)) / 2
    assert len(found) == len(radii) - 2
    assert (found * turned > 0).all()
    assert abs(found.sum()) == pytest.approx(own.sum())


def test_indices_below_zero_count_from_the_line_that_names_them(tmp_path: Path) -> None:
    path = tmp_path / "mesh.obj"
    one = "v 0 0 {z}\nv 1 0 {z}\nv 0 1 {z}\nvt 0 0\nvt 1 0\nvt 0 1\nf -3/-3 -2/-2 -1/-1\n"
    path.write_text(one.format(z=0) + one.format(z=5))
    np.testing.assert_array_equal(read_obj(path).faces, [[0, 1, 2], [3, 4, 5]])
    path.write_text(one.format(z=0) + "f -3/-4 -2/-2 -1/-1\n")
    with pytest.raises(InputError, match="what is not there"):
        read_obj(path)
