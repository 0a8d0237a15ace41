"""Where camera, sun, cloth and pole stand for given ζ."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.render import stage
from tests.sim.render.conftest import look
from tests.sim.render.pieces import meshes, sheet

ANCHOR = (2.0, -1.0, 0.7)


@pytest.fixture
def subject():
    """A square about a point beside and below its anchor, with its heading a third of a turn from
    +x."""
    return replace(meshes(sheet(middle=(2.0, -1.4, 0.2))), anchor=ANCHOR, heading=2 * math.pi / 3)


def test_the_anchor_stands_at_the_mesh_height_above_the_origin(subject) -> None:
    placed = stage(subject, look(mesh_height=4.6))
    assert np.add(ANCHOR, placed.shift).tolist() == pytest.approx([0.0, 0.0, 4.6])


@pytest.mark.parametrize("angle", [0.3, math.pi / 2, -1.1, 3.0])
def test_the_camera_stands_at_its_height_radius_and_angle_from_the_cloths_middle(
    subject, angle
) -> None:
    zeta = look(mesh_height=4.6, camera_height=0.9, camera_radius=5.5, camera_angle=angle)
    placed = stage(subject, zeta)
    camera = placed.camera
    middle = np.add((2.0, -1.4, 0.2), placed.shift)
    away = middle - camera.position
    assert camera.position[2] == pytest.approx(0.9)
    assert math.hypot(away[0], away[1]) == pytest.approx(5.5)
    axis = math.atan2(camera.forward[1], camera.forward[0])
    assert math.remainder(axis - subject.heading - angle, 2 * math.pi) == pytest.approx(
        0.0, abs=1e-6
    )
    assert np.cross(away, camera.forward).tolist() == pytest.approx([0.0] * 3, abs=1e-6)


def test_across_the_heading_the_air_goes_to_the_right(subject) -> None:
    placed = stage(subject, look(camera_angle=math.pi / 2))
    downwind = torch.tensor(
        [[0.0, 0, 0], [math.cos(subject.heading), math.sin(subject.heading), 0.0]]
    )
    places, _ = placed.camera.project(downwind)
    assert places[1, 0] > places[0, 0] + 10


def test_the_sun_stands_over_its_radius_in_its_azimuth(subject) -> None:
    zeta = look(
        sun_height=4.0, sun_radius=3.0, sun_azimuth=math.pi / 3
    )  # with the heading, half a turn: −x
    assert stage(subject, zeta).to_sun == pytest.approx((-0.6, 0.0, 0.8))


def test_the_pole_touches_the_anchor_from_upwind_and_reaches_the_ground(subject) -> None:
    placed = stage(subject, look(mesh_height=4.6, pole_radius=0.04))
    ring = placed.pole_positions.numpy()
    middle = np.array([-0.04 * math.cos(subject.heading), -0.04 * math.sin(subject.heading)])
    sides = ring[:-1, :2] - middle
    assert np.linalg.norm(sides, axis=1) == pytest.approx(np.full(len(sides), 0.04), abs=1e-6)
    assert ring[:, 2].min() == 0.0
    assert 4.6 < ring[:, 2].max() < 4.7
    corners = ring[placed.pole_faces.numpy()]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = corners.mean(axis=1) - [*middle, 2.0]
    assert ((normal * outward).sum(axis=1) > 0).all()


def test_no_radius_no_pole(subject) -> None:
    assert len(stage(subject, look(pole_radius=0.0)).pole_faces) == 0
