"""Meshes: the grid, its topology, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from sim.cloth.mesh import Mesh, grid
from tests.refusals import unrefused


def test_grid_covers_the_rectangle_and_has_the_counts_of_a_triangulated_disc() -> None:
    mesh = grid(width=1.5, height=1.0, columns=30, rows=20)
    assert mesh.vertex_count == 651
    assert len(mesh.faces) == 1200
    assert mesh.areas.sum() == pytest.approx(1.5)
    assert mesh.vertex_areas.sum() == pytest.approx(1.5)
    # Euler: V − E + F = 1 for a disc; every edge is inner or on the boundary, which has as many
    # edges as vertices.
    assert mesh.vertex_count - (len(mesh.hinges) + len(mesh.boundary)) + len(mesh.faces) == 1
    assert len(mesh.boundary) == 2 * (30 + 20)


def test_hinges_of_two_triangles_by_hand() -> None:
    # A unit square cut from (0, 0) to (1, 1): one inner edge of length √2 between two half squares.
    mesh = Mesh(rest=[[0, 0], [1, 0], [1, 1], [0, 1]], faces=[[0, 1, 2], [0, 2, 3]])
    assert mesh.hinges.tolist() == [[0, 2, 3, 1]]
    assert mesh.hinge_lengths[0] == pytest.approx(np.sqrt(2))
    assert mesh.hinge_areas[0] == pytest.approx(1.0)
    assert mesh.hinge_directions[0] == pytest.approx(np.pi / 4)


def test_gradients_differentiate_a_linear_field_exactly(distorted: Mesh) -> None:
    field = 3 * distorted.rest[:, 0] - 2 * distorted.rest[:, 1] + 5
    derivative = np.einsum("fic,fc->fi", distorted.gradients, field[distorted.faces])
    np.testing.assert_allclose(
        derivative, np.tile([3.0, -2.0], (len(distorted.faces), 1)), atol=1e-12
    )


def test_impossible_meshes_are_refused_with_the_reason() -> None:
    cases = [
        ([[0, 0], [1, 0], [0, 1]], [[0, 2, 1]], "inverted"), ([[0, 0], [1, 0], [2, 0]], [[0, 1, 2]], "degenerate"),
        ([[0, 0], [0, 0], [0, 0]], [[0, 1, 2]], "degenerate"), ([[0, 0], [1, 0], [0, np.nan]], [[0, 1, 2]], "finite"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 3]], "outside"),
        ([[0, 0], [1, 0], [0, 1], [5, 5]], [[0, 1, 2]], "no face"),
        ([[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 1, 2], [0, 1, 3]], "twice"), ([[0, 0, 0]], [[0, 1, 2]], "shape"),
        ([[0, 0], [1, 0], [0, 1]], np.zeros((0, 3)), "shape"),
    ]  # fmt: skip
    assert not unrefused(lambda rest, faces: Mesh(rest=rest, faces=faces), cases, InputError)


def test_impossible_grids_are_refused() -> None:
    cases = [(0.0, 3), (-1.0, 3), (1.0, 0), (float("nan"), 2)]
    assert (
        unrefused(
            lambda width, columns: grid(width=width, height=1.0, columns=columns, rows=2),
            cases,
            InputError,
            "grid",
        )
        == []
    )
