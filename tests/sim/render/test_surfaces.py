"""What is seen: silhouettes, hidden surfaces, the texture's way round."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from sim.render import stage
from tests.sim.render.conftest import camera_of, look
from tests.sim.render.pieces import linear, meshes, sheet, together

RED, GREEN, BLUE, YELLOW = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0)


def area(image) -> float:
    """Pixels that white before black covers, edges by their share."""
    return float(linear(image)[..., 0].sum())


def test_a_square_that_faces_the_camera_covers_the_pixels_that_similar_triangles_give() -> None:
    image = camera_of().render(meshes(sheet(side=1.3)), look(raster_samples=64))
    # f / d = 300 / 5 px/m. Tolerance: edges are quantised to 1/8 px by 64 samples, at most 4 · 78 /
    # 16 px², and bytes.
    assert area(image[0]) == pytest.approx((1.3 * 60) ** 2, abs=20.0)


@pytest.mark.parametrize("turn", [0.5, -1.2])
def test_a_turned_square_covers_the_area_of_its_projected_corners(turn) -> None:
    piece, zeta = meshes(sheet(side=1.0, turn=turn)), look(raster_samples=64, camera_height=2.0)
    camera = stage(piece, zeta).camera
    corner, _ = camera.project(torch.from_numpy(sheet(side=1.0, turn=turn)[0])[[0, 2, 3, 1]])
    x, y = corner.T.numpy()
    outline = abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))) / 2
    assert area(camera_of().render(piece, zeta)[0]) == pytest.approx(outline, rel=0.01, abs=5.0)


def test_the_nearer_of_two_surfaces_hides_the_other_whatever_their_order() -> None:
    near, far = sheet(side=0.5, middle=(0.0, -0.5, 0.0)), sheet(side=2.0, middle=(0.0, 0.5, 0.0))
    half = np.array(
        [[RED, GREEN]], dtype=np.uint8
    )  # the near one shows the texture's left, the far one its right
    near, far = (
        (near[0], near[1], near[2] * [0, 1] + [0.1, 0]),
        (far[0], far[1], far[2] * [0, 1] + [0.9, 0]),
    )
    for parts in ((near, far), (far, near)):
        image = (
            camera_of(half=half).render(meshes(together(*parts)), look(texture="half"))[0].numpy()
        )
        assert image[150, 150].tolist() == list(RED)
        assert image[150, 110].tolist() == list(GREEN)


def test_surfaces_that_cross_meet_where_their_planes_do() -> None:
    one, other = (
        sheet(side=1.0, turn=0.4),
        sheet(side=1.0, turn=-0.4),
    )  # they cross in the vertical through the middle
    half = np.array([[RED, GREEN]], dtype=np.uint8)
    one, other = (
        (one[0], one[1], one[2] * [0, 1] + [0.1, 0]),
        (other[0], other[1], other[2] * [0, 1] + [0.9, 0]),
    )
    zeta = look(texture="half", camera_angle=math.pi / 2)
    image = camera_of(half=half).render(meshes(together(one, other)), zeta)[0].numpy()
    row = image[150]
    # turn > 0 takes the right side away from the camera: on the left `one` is nearer, on the right
    # `other`.
    assert (row[125:149] == RED).all()
    assert (row[151:175] == GREEN).all()


def test_from_the_front_a_texture_is_upright_and_from_behind_mirrored() -> None:
    quarters = np.repeat(
        np.repeat(np.array([[RED, GREEN], [BLUE, YELLOW]], dtype=np.uint8), 32, axis=0), 32, axis=1
    )
    renderer, piece = camera_of(quarters=quarters), meshes(sheet(side=2.0))

    def corners(angle: float) -> list[tuple[int, ...]]:
        image = renderer.render(piece, look(texture="quarters", camera_angle=angle))[0].numpy()
        return [
            tuple(image[y, x].tolist()) for y, x in ((110, 110), (110, 190), (190, 110), (190, 190))
        ]

    assert corners(math.pi / 2) == [RED, GREEN, BLUE, YELLOW]
    assert corners(-math.pi / 2) == [GREEN, RED, YELLOW, BLUE]


def test_turning_the_world_about_the_vertical_changes_nothing() -> None:
    from dataclasses import replace

    piece = sheet(side=1.2, turn=0.3, cells=5)
    zeta = look(
        sun_strength=3.0,
        sun_softness=0.3,
        sun_azimuth=2.0,
        pole_radius=0.03,
        mesh_height=1.0,
        raster_samples=4,
    )
    angle, c, s = 0.9, math.cos(0.9), math.sin(0.9)
    turned = (piece[0] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), piece[1], piece[2])
    first = camera_of().render(meshes(piece), zeta).int()
    other = camera_of().render(replace(meshes(turned), heading=angle), zeta).int()
    # The camera aims at the middle of a bounding box along the axes, the same here for a piece
    # symmetric about it. A sample in a thousand falls on the other side of an edge for rounding.
    assert float(((first - other).abs() > 2).float().mean()) < 2e-3


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize(
    ("turn", "offset"), [(math.pi / 2, 0.0), (0.0, 0.9)], ids=["edge-on", "out of frame"]
)
def test_what_shows_no_surface_leaves_the_background(monkeypatch, turn, offset, compiled) -> None:
    if not compiled:
        monkeypatch.setattr("sim.render.raster.library", lambda: None)
    zeta = look(background="white", texture="black", frame_offset_x=offset, raster_samples=2)
    assert int(camera_of().render(meshes(sheet(turn=turn)), zeta).min()) == 255


def test_cloth_before_the_camera_is_refused_only_when_it_is_not_in_front() -> None:
    from flagdata.errors import InputError

    with pytest.raises(InputError, match="behind the camera"):
        camera_of().render(
            meshes(together(sheet(), sheet(middle=(0, -6, 0)), sheet(middle=(0, 6, 0)))), look()
        )
