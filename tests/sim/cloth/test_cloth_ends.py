"""Values continued to the ends of a cloth, against parabolas."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sim.cloth.cloth_ends import ends_of
from sim.cloth.mesh import Mesh, grid


@pytest.fixture(params=["grid", "distorted"])
def mesh(request: pytest.FixtureRequest, distorted: Mesh) -> Mesh:
    return (
        distorted
        if request.param == "distorted"
        else grid(width=1.5, height=1.0, columns=6, rows=4)
    )


def test_parabolas_are_continued_exactly(mesh: Mesh) -> None:
    ends = mesh.ends
    u, v = mesh.rest.T
    at_end = np.flatnonzero((u < 1e-9) | (u > u.max() - 1e-9))
    assert ends.vertices.tolist() == at_end.tolist()
    assert not np.isin(ends.within, at_end).any()
    field = 2 + 3 * u - 5 * u**2 + 2 * v
    spoilt = np.where(np.isin(np.arange(len(u)), at_end), 100.0, field)
    continued = ends.continue_field(torch.tensor(np.stack([spoilt, -spoilt], axis=1))).numpy()
    np.testing.assert_allclose(continued, np.stack([field, -field], axis=1), rtol=1e-9, atol=1e-9)


def test_in_rows_the_three_next_vertices_are_weighed() -> None:
    ends = grid(width=1.5, height=1.0, columns=6, rows=4).ends
    np.testing.assert_allclose(ends.weights, np.broadcast_to([3.0, -3.0, 1.0], (10, 3)), rtol=1e-9)


def test_a_cloth_with_too_few_vertices_within_is_left_as_it_is() -> None:
    assert not len(ends_of(grid(width=1.0, height=1.0, columns=2, rows=1).rest).vertices)
