"""Values continued to the ends of a cloth, against polynomials."""

from __future__ import annotations

import numpy as np
import pytest

from sim.ends import ends_of
from sim.mesh import Mesh, grid


@pytest.fixture(params=["grid", "distorted"])
def mesh(request: pytest.FixtureRequest, distorted: Mesh) -> Mesh:
    return distorted if request.param == "distorted" else grid(width=1.5, height=1.0, columns=6, rows=4)


def test_parabolas_and_lines_are_continued_exactly(mesh: Mesh) -> None:
    ends = mesh.ends
    u, v = mesh.rest.T
    at_end = np.flatnonzero((u < 1e-9) | (u > u.max() - 1e-9))
    assert ends.vertices.tolist() == at_end.tolist()
    assert not np.isin(ends.within, at_end).any()
    for weights, field in (
        (ends.line, 2 + 3 * u),
        (ends.parabola, 2 + 3 * u - 5 * u**2),
    ):
        np.testing.assert_allclose((weights * field[ends.within]).sum(1), field[ends.vertices], rtol=1e-9, atol=1e-9)
    inside = (v[ends.vertices] > 1e-9) & (v[ends.vertices] < v.max() - 1e-9)
    if len(ends.within[0]) > 3:  # where vertices are in no rows, across them too
        field = 1 + 3 * u - 5 * u**2 + 2 * v + u * v - 4 * v**2
        continued = (ends.parabola * field[ends.within]).sum(1)
        np.testing.assert_allclose(continued[inside], field[ends.vertices][inside], rtol=1e-9, atol=1e-9)


def test_in_rows_the_three_next_vertices_are_weighed() -> None:
    ends = grid(width=1.5, height=1.0, columns=6, rows=4).ends
    np.testing.assert_allclose(ends.parabola, np.broadcast_to([3.0, -3.0, 1.0], (10, 3)), rtol=1e-9)
    np.testing.assert_allclose(ends.line, np.broadcast_to([2.0, -1.0, 0.0], (10, 3)), rtol=1e-9)


def test_a_cloth_with_too_few_vertices_within_is_left_as_it_is() -> None:
    assert not len(ends_of(grid(width=1.0, height=1.0, columns=2, rows=1).rest).vertices)
