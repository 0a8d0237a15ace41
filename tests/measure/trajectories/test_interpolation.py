"""Thin-plate splines between points of the flat cloth, and points followed through a mesh that is
remeshed."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.lake import RaggedMeshSequence
from measure.trajectories import from_sequence, onto, sample
from sim.cloth.material_points import locate
from sim.cloth.mesh import Mesh, grid


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(0).uniform([0, 0], [1.5, 1.0], (50, 2))


def test_a_linear_field_is_reproduced_everywhere(points: np.ndarray):
    target = np.array([[0.0, 0.0], [0.7, 0.2], [1.6, 1.2]])
    field = np.array([1.0, -2.0, 0.5])
    values = np.c_[np.ones(50), points] @ field
    # The linear part of the spline is exact; 1e-9 is the conditioning of its equations.
    np.testing.assert_allclose(
        onto(points, target) @ values, np.c_[np.ones(3), target] @ field, atol=1e-9
    )


def test_where_points_coincide_it_is_the_identity_to_the_bit(points: np.ndarray):
    single = points.astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(onto(points, single[::3]), np.eye(50)[::3])


def test_it_is_the_thin_plate_spline(points: np.ndarray):
    # Hand-written: weights w and a plane, Σ w = Σ w u = Σ w v = 0, with the kernel r² log r
    # (Duchon, 1977).
    target = np.array([[0.4, 0.4], [1.2, 0.1]])
    values = np.sin(3 * points[:, 0]) * points[:, 1]

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(a[:, None] - b, axis=2)
        return np.where(r > 0, r**2 * np.log(np.where(r > 0, r, 1.0)), 0.0)

    plane = np.c_[np.ones(50), points]
    system = np.block([[kernel(points, points), plane], [plane.T, np.zeros((3, 3))]])
    solution = np.linalg.solve(system, np.r_[values, np.zeros(3)])
    expected = kernel(target, points) @ solution[:50] + np.c_[np.ones(2), target] @ solution[50:]
    np.testing.assert_allclose(onto(points, target) @ values, expected, atol=1e-9)


def test_the_same_points_give_the_same_matrix_which_nobody_can_change(points: np.ndarray):
    matrix = onto(points, points[:5] + 0.01)
    assert onto(points.copy(), points[:5] + 0.01) is matrix
    with pytest.raises(ValueError, match="read-only"):
        matrix[0, 0] = 1.0


@pytest.mark.parametrize(
    ("source", "what"),
    [
        ([[0, 0], [1, 0]], "2 source points"),
        ([[0, 0], [1, 0], [2, 0], [3, 0]], "on a line"),
        ([[0, 0], [1, 0], [0, 1], [0, 1]], "at the same point"),
        ([[0, 0], [1, 0], [0, np.nan]], "not finite"),
    ],
)
def test_points_that_define_no_spline_are_refused(source: list[list[float]], what: str):
    with pytest.raises(InputError, match=what):
        onto(np.array(source, dtype=np.float64), np.zeros((1, 2)))


def _affine(rest: np.ndarray, frame: int) -> np.ndarray:
    return np.c_[rest[:, 0] + 0.1 * frame, rest @ [0.2, 0.9], rest @ [0.1 * frame, -0.3]]


def remeshed() -> RaggedMeshSequence:
    """An affine motion of a cloth that has another grid in every frame."""
    meshes: list[Mesh] = [
        grid(width=1.5, height=1.0, columns=3 + k, rows=2 + 2 * k) for k in range(4)
    ]
    return RaggedMeshSequence(
        time=np.arange(4, dtype=np.int64) * 40_000_000,
        positions=np.concatenate([_affine(m.rest, k) for k, m in enumerate(meshes)]).astype(
            np.float32
        ),
        faces=np.concatenate([m.faces for m in meshes]).astype(np.int32),
        rest=np.concatenate([m.rest for m in meshes]).astype(np.float32),
        vertex_offset=np.cumsum([0, *(m.vertex_count for m in meshes)]).astype(np.int64),
        face_offset=np.cumsum([0, *(len(m.faces) for m in meshes)]).astype(np.int64),
    )


def test_an_affine_motion_survives_any_remeshing(points: np.ndarray):
    positions = sample(remeshed(), points)
    for k in range(4):
        np.testing.assert_allclose(
            positions[k], _affine(points, k), atol=1e-6
        )  # meshes are kept in single precision


def test_a_remeshed_cloth_is_followed_at_about_200_points_that_include_its_corners():
    seen = from_sequence(remeshed(), name="remeshed")
    assert 180 <= len(seen.markers) <= 220
    for corner in ([0.0, 0.0], [1.5, 0.0], [1.5, 1.0], [0.0, 1.0]):
        assert np.hypot(*(seen.markers - corner).T).min() < 1e-6
    assert [finding.kind for finding in seen.findings] == ["mesh-resampled"]


def test_a_point_off_the_cloth_is_refused():
    mesh = grid(width=1.5, height=1.0, columns=3, rows=2)
    with pytest.raises(InputError, match=r"\(1.6, 0.5\) is on no face"):
        locate(mesh.rest, mesh.faces, np.array([[0.1, 0.1], [1.6, 0.5]]), where="frame 0")
