"""Model meshes: about as many vertices as asked for, over the whole cloth and nothing else, held
where it is held."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.trajectories import Hold, hold, model_mesh
from measure.trajectories.cloth_mesh import area, outline, rectangle
from sim.cloth.mesh import grid

OUTLINES = {
    "pennant": np.array([[0.0, 0.0], [2.0, 0.5], [0.0, 1.0]]),
    "swallowtail": np.array([[0.0, 0.0], [1.5, 0.0], [1.2, 0.5], [1.5, 1.0], [0.0, 1.0]]),
    "round": np.stack(
        [f(np.linspace(0, 2 * np.pi, 120, endpoint=False)) for f in (np.cos, np.sin)], axis=1
    ),
}


@pytest.mark.parametrize("sides", [(1.5, 1.0), (1.0, 1.0), (3.0, 0.5)])
def test_a_rectangle_has_nearly_square_cells_and_about_200_vertices(sides: tuple[float, float]):
    mesh = rectangle(*sides)
    assert 170 <= mesh.vertex_count <= 230
    assert mesh.areas.sum() == pytest.approx(sides[0] * sides[1], rel=1e-12)
    cell = [np.diff(np.unique(mesh.rest[:, axis].round(9))).mean() for axis in (0, 1)]
    assert cell[0] == pytest.approx(cell[1], rel=0.15)


@pytest.mark.parametrize("name", OUTLINES)
def test_other_outlines_are_filled(name: str):
    mesh = model_mesh(OUTLINES[name])
    assert 150 <= mesh.vertex_count <= 250
    # Straight edges are met exactly; a circle's chords leave out less than its 120-gon does at this
    # spacing.
    assert mesh.areas.sum() == pytest.approx(area(OUTLINES[name]), rel=5e-3)


def test_the_outline_of_a_mesh_is_its_edge():
    mesh = grid(width=1.5, height=1.0, columns=6, rows=4)
    corners = outline(mesh.rest, mesh.faces, where="mesh")
    assert area(corners) == pytest.approx(1.5)
    assert len(corners) == 20


def test_a_cloth_with_a_hole_is_refused():
    mesh = grid(width=1.0, height=1.0, columns=5, rows=5)
    middle = np.abs(mesh.rest[mesh.faces].mean(axis=1) - 0.5).max(axis=1) > 0.1
    with pytest.raises(InputError, match="holes"):
        outline(mesh.rest, mesh.faces[middle], where="mesh")


def test_a_pin_between_vertices_gets_one_and_the_corners_stay():
    mesh = rectangle(1.5, 1.0)
    pins = np.array([[0.0, 0.013], [0.4, 0.33], [1.5, 1.0]])
    pinned, held = hold(mesh, pins)
    np.testing.assert_allclose(pinned.rest[list(held)], pins, atol=1e-12)
    assert pinned.areas.sum() == pytest.approx(1.5, rel=1e-12)
    for corner in ([0.0, 0.0], [1.5, 0.0], [1.5, 1.0], [0.0, 1.0]):
        assert np.hypot(*(pinned.rest - corner).T).min() < 1e-9


def test_named_holds_are_where_their_names_say():
    mesh = rectangle(1.5, 1.0)
    at = {name: mesh.rest[list(hold(mesh, name)[1])] for name in Hold}
    np.testing.assert_allclose(at[Hold.HOIST_CORNERS], [[0, 0], [0, 1]], atol=1e-12)
    np.testing.assert_allclose(at[Hold.TOP_CORNERS], [[0, 1], [1.5, 1]], atol=1e-12)
    assert len(at[Hold.HOIST]) > 5
    assert (at[Hold.HOIST][:, 0] == 0).all()
