"""The pieces of force fields: at the corners of a flag, and in winds where they can be worked out
by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.effects import Flat, Seen, heavier

SHAPES = ("everywhere", "hoist", "fly", "upper", "lower", "upper_fly", "lower_fly")
FIELDS = (
    "downwind",
    "leftward",
    "upward",
    "downwind_squared",
    "leftward_squared",
    "upward_squared",
    "toward_pole",
    "toward_height",
    "against_motion",
    "against_normal_motion",
    "across",
    "across_squared",
    "along",
    "along_squared",
    "to_pole",
    "left_of_motion",
    "across_even",
    "rising",
    "crossing",
    "along_width",
    "along_height",
)


def seen(
    *,
    wind: tuple[float, float, float],
    velocity: tuple[float, float, float] = (0, 0, 0),
    turn: float = 0.0,
    bulge: float = 0.1,
) -> Seen:
    """A flag near the plane of x and z, turned about z with its wind and its velocity."""
    system, _ = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0, columns=6)],
        dtype=torch.float64,
    )
    rest = torch.tensor(system.cloth.mesh.rest)
    c, s = np.cos(turn), np.sin(turn)
    about = torch.tensor([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    x = torch.stack([rest[:, 0], bulge * torch.sin(5 * rest[:, 0]), rest[:, 1]], 1) @ about.T
    moving = (torch.tensor(velocity, dtype=torch.float64) * torch.cos(3 * rest[:, :1])) @ about.T
    air = about @ torch.tensor(wind, dtype=torch.float64)
    return Seen(
        cloth=system.cloth,
        position=x[..., None],
        offset=x[..., None] - torch.tensor([0.0, 0.0, 0.5])[:, None],
        velocity=moving[..., None],
        wind=air[:, None],
    )


@pytest.mark.parametrize(
    ("name", "corners"),
    [
        ("everywhere", (1, 1, 1, 1)),
        ("hoist", (1, 0, 1, 0)),
        ("fly", (0, 1, 0, 1)),
        ("upper", (0, 0, 1, 1)),
        ("lower", (1, 1, 0, 0)),
        ("upper_fly", (0, 0, 0, 1)),
        ("lower_fly", (0, 1, 0, 0)),
    ],
)
def test_shapes_are_0_or_1_at_the_corners(name: str, corners: tuple[int, ...]) -> None:
    own = seen(wind=(4, 0, 0))
    rest = own.cloth.mesh.rest
    places = [(0.0, 0.0), (rest[:, 0].max(), 0.0), (0.0, rest[:, 1].max()), tuple(rest.max(axis=0))]
    values = getattr(own, name)[:, 0, 0].numpy()
    for place, expected in zip(places, corners, strict=True):
        vertex = int(np.argmin(np.linalg.norm(rest - place, axis=1)))
        assert values[vertex] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("downwind", (0.6, 0.8, 0)),
        ("leftward", (-0.8, 0.6, 0)),
        ("upward", (0, 0, 1)),
        ("downwind_squared", (15, 20, 0)),
        ("leftward_squared", (-20, 15, 0)),
        ("upward_squared", (0, 0, 25)),
    ],
)
def test_pushes_follow_the_horizontal_wind(name: str, expected: tuple[float, ...]) -> None:
    """A wind of (3, 4, 1) m/s: 5 m/s horizontally."""
    np.testing.assert_allclose(
        getattr(seen(wind=(3, 4, 1)), name)[0, :, 0].numpy(), expected, atol=1e-12
    )


def test_springs_pull_to_the_axis_and_to_the_height_of_the_attachments() -> None:
    own = seen(wind=(4, 0, 0))
    total = own.toward_pole + own.toward_height
    torch.testing.assert_close(total, -own.offset)
    assert not own.toward_pole[:, 2].any()
    assert not own.toward_height[:, :2].any()


def test_across_and_along_a_flat_flag_are_the_wind_across_and_along_its_plane() -> None:
    """In the plane of x and z, in a relative wind of (3, 2, 4) m/s."""
    own = seen(wind=(3, 2, 4), bulge=0.0)
    for name, expected in {
        "across": (0, 2, 0),
        "across_squared": (0, 4, 0),
        "along": (3, 0, 4),
        "along_squared": (15, 0, 20),
    }.items():
        values = getattr(own, name)[:, :, 0].numpy()
        np.testing.assert_allclose(values, np.tile(expected, (len(values), 1)), atol=1e-12)


def test_local_shapes_fall_with_the_distance_to_their_place() -> None:
    """By e^(−1/2) where it is a tenth of the root of the area away."""
    own = Flat(cloth=seen(wind=(4, 0, 0)).cloth)
    rest = own.cloth.mesh.rest
    width, height = rest.max(axis=0)
    for values, square in (
        (own.near(0.7, 0.3), (rest[:, 0] - 0.7 * width) ** 2 + (rest[:, 1] - 0.3 * height) ** 2),
        (own.stripe(0.7), (rest[:, 0] - 0.7 * width) ** 2),
        (own.band(0.3), (rest[:, 1] - 0.3 * height) ** 2),
    ):
        expected = np.exp(-square / (2 * 0.01 * width * height))
        np.testing.assert_allclose(values[:, 0, 0].numpy(), expected, rtol=1e-10)


def test_a_heavier_cloth_has_that_share_more_mass() -> None:
    cloth = seen(wind=(4, 0, 0)).cloth
    share = Flat(cloth=cloth).lower
    torch.testing.assert_close(
        heavier(cloth, 0.5 * share).mass, cloth.mass * (1 + 0.5 * share[:, :, 0])
    )


def test_the_pull_to_the_pole_points_to_it_and_is_one_far_away() -> None:
    own = seen(wind=(4, 0, 0))
    arm = own.offset.clone()
    arm[:, 2] = 0
    far = int(torch.argmax(arm.norm(dim=1)[:, 0]))
    distance = float(arm[far].norm())
    radius = 0.1 * np.sqrt(np.prod(own.cloth.mesh.rest.max(axis=0)))
    torch.testing.assert_close(own.to_pole[far], -arm[far] / np.hypot(distance, radius))


def test_an_even_pressure_does_not_turn_with_the_wind() -> None:
    one, other = (seen(wind=wind, bulge=0.0).across_even for wind in ((0, 2, 0), (0, -2, 0)))
    torch.testing.assert_close(one, other)
    torch.testing.assert_close(one.norm(dim=1), torch.full_like(one[:, 0], 4.0))


def test_a_wind_upward_presses_on_what_leans() -> None:
    """On a sheet that leans by 0.4: the derivative of |w·n| (w·n) n in a wind along z is 2 |w·n|
    (z·n) n."""
    own = seen(wind=(0, 3, 0), bulge=0.0)
    lean = own.position.clone()
    lean[:, 1] = 0.4 * lean[:, 2]

    def pressed(up: float) -> Tensor:
        air = torch.tensor([[0.0], [3.0], [up]], dtype=torch.float64)
        return replace(own, position=lean, wind=air).across_squared

    difference = (pressed(1e-5) - pressed(-1e-5)) / 2e-5
    torch.testing.assert_close(
        2 * replace(own, position=lean).rising, difference, rtol=1e-6, atol=1e-8
    )


def test_friction_along_the_threads_is_that_along_width_and_height() -> None:
    """On a flat flag in the plane of x and z, hoist upright: along x and along z."""
    own = seen(wind=(3, 2, 4), bulge=0.0)
    for name, expected in (("along_width", (3, 0, 0)), ("along_height", (0, 0, 4))):
        values = getattr(own, name)[:, :, 0].numpy()
        np.testing.assert_allclose(values, np.tile(expected, (len(values), 1)), atol=1e-12)


def test_a_turning_frame_pushes_to_the_left_of_the_motion() -> None:
    own = seen(wind=(4, 0, 0), velocity=(1, -2, 3))
    x, y, _ = own.velocity.unbind(1)
    torch.testing.assert_close(own.left_of_motion, torch.stack([-y, x, torch.zeros_like(x)], 1))


def test_resistances_oppose_the_motion_and_its_part_along_the_normal() -> None:
    own = seen(wind=(4, 0, 0), velocity=(1, -2, 3), bulge=0.0)
    torch.testing.assert_close(own.against_motion, -own.velocity)
    torch.testing.assert_close(own.against_normal_motion[:, 1], -own.velocity[:, 1])
    assert not own.against_normal_motion[:, [0, 2]].any()


@pytest.mark.parametrize("name", FIELDS)
def test_turning_flag_and_wind_turns_the_field(name: str) -> None:
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    about = torch.tensor([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def of(turn: float) -> Tensor:
        own = seen(wind=(4, 1, 0.5), velocity=(0.5, 1, -2), turn=turn)
        return getattr(own, name).expand(len(own.position), 3, 1)

    torch.testing.assert_close(
        of(angle), torch.einsum("ij,vjb->vib", about, of(0.0)), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("name", FIELDS)
def test_fields_are_finite_in_still_air(name: str) -> None:
    assert torch.isfinite(getattr(seen(wind=(0, 0, 0)), name)).all()
