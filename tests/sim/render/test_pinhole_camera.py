"""The camera against geometry worked out by hand."""

from __future__ import annotations

import math

import pytest
import torch

from flagdata.errors import InputError
from sim.render import Camera
from tests.refusals import unrefused

NORTH = {"position": (0.0, -5.0, 1.6), "target": (0.0, 0.0, 1.6), "view_angle": 2 * math.atan(0.5)}


@pytest.mark.parametrize(
    ("point", "place", "depth"),
    [
        ((0.0, 0.0, 1.6), (150.0, 150.0), 5.0),
        ((1.0, 0.0, 1.6), (150.0 + 300 / 5, 150.0), 5.0),  # f = 150 / 0.5 = 300 px
        (
            (0.0, 0.0, 2.6),
            (150.0, 150.0 - 300 / 5),
            5.0,
        ),  # up in the world is up in the image: smaller y
        ((-1.0, 5.0, 0.6), (150.0 - 300 / 10, 150.0 + 300 / 10), 10.0),
    ],
)
def test_corners_fall_where_similar_triangles_put_them(point, place, depth) -> None:
    camera = Camera.looking(**NORTH, width=300, height=300)
    found, away = camera.project(torch.tensor(point, dtype=torch.float64))
    assert found.tolist() == pytest.approx(place, abs=1e-9)
    assert float(away) == pytest.approx(depth, rel=1e-12)


def test_the_angle_of_view_spans_the_longer_side() -> None:
    for width, height in ((400, 200), (200, 400)):
        camera = Camera.looking(**NORTH, width=width, height=height)
        edge = torch.tensor(
            [[2.5, 0.0, 1.6], [0.0, 0.0, 4.1]], dtype=torch.float64
        )  # 5 m · tan(angle / 2) aside, above
        place, _ = camera.project(edge)
        shown = place[0, 0] if width > height else place[1, 1]
        assert float(shown) == pytest.approx(400.0 if width > height else 0.0, abs=1e-9)
        assert float(place[1 if width > height else 0, 0]) == pytest.approx(
            width / 2 + (0 if width > height else 200)
        )


def test_what_it_aims_at_lies_in_the_middle_moved_by_the_offset() -> None:
    camera = Camera.looking(
        position=(3.0, -4.0, 0.5),
        target=(0.2, 0.3, 4.0),
        view_angle=0.6,
        width=300,
        height=200,
        frame_offset=(0.1, -0.05),
    )
    place, depth = camera.project(torch.tensor([0.2, 0.3, 4.0], dtype=torch.float64))
    assert place.tolist() == pytest.approx([150 + 30, 100 - 15], abs=1e-9)
    assert float(depth) == pytest.approx(math.dist((3.0, -4.0, 0.5), (0.2, 0.3, 4.0)), rel=1e-12)


def test_a_camera_that_looks_up_sees_the_horizon_below_the_middle() -> None:
    tilt = math.radians(20)
    camera = Camera.looking(
        position=(0.0, 0.0, 0.0),
        target=(10 * math.cos(tilt), 0.0, 10 * math.sin(tilt)),
        view_angle=math.pi / 2,
        width=300,
        height=300,
    )
    horizon, _ = camera.project(
        torch.tensor([[100.0, 0.0, 0.0], [100.0, 30.0, 0.0]], dtype=torch.float64)
    )
    assert horizon[:, 1].tolist() == pytest.approx(
        [150 + 150 * math.tan(tilt)] * 2, abs=1e-9
    )  # level: a level line
    assert horizon[1, 0] < horizon[0, 0]  # looking along +x, +y is to the left


def test_its_axes_are_right_handed_unit_vectors() -> None:
    camera = Camera.looking(
        position=(1.0, 2.0, 3.0), target=(-2.0, 0.0, 3.5), view_angle=0.5, width=30, height=30
    )
    axes = torch.tensor([camera.right, camera.down, camera.forward], dtype=torch.float64)
    assert torch.allclose(axes @ axes.T, torch.eye(3, dtype=torch.float64), atol=1e-12)
    assert float(torch.det(axes)) == pytest.approx(1.0)
    assert camera.right[2] == 0.0


def test_a_camera_straight_above_or_in_its_target_is_refused() -> None:
    cases = [(0.0, 0.0, 9.0), (0.0, 0.0, 1.0)]
    assert (
        unrefused(
            lambda target: Camera.looking(
                position=(0.0, 0.0, 1.0), target=target, view_angle=0.5, width=30, height=30
            ),
            zip(cases),
            InputError,
            "level",
        )
        == []
    )
