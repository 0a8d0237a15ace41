"""Light against radiometry worked out by hand: Lambert's law, shadows, penumbras, what goes
through."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from sim.render import stage
from sim.render.sampling import Samples
from tests.sim.render.conftest import camera_of, look
from tests.sim.render.pieces import linear, meshes, sheet, together

BYTE = 0.006  # linear; half a step of the bytes near white

# The sun behind the camera, as high as far: its light meets a sheet that faces −y at 45°.
SLANTED = {
    "sun_strength": math.pi,
    "sky_strength": 0.0,
    "sun_softness": 0.0,
    "sun_azimuth": -math.pi / 2,
    "sun_height": 3.0,
    "sun_radius": 3.0,
}


@pytest.mark.parametrize("turn", [0.0, 0.5, -0.9])
def test_brightness_follows_the_cosine_of_the_suns_angle(turn) -> None:
    image = camera_of().render(meshes(sheet(turn=turn, side=1.5)), look(**SLANTED))
    # White that faces the sun is 1. Normal (−sin t, …): the sun's horizontal part is cos 45° along
    # −y.
    assert linear(image[0])[150, 150, 0] == pytest.approx(
        math.cos(math.pi / 4) * math.cos(turn), abs=BYTE
    )


def test_sky_and_sun_add_up() -> None:
    image = camera_of().render(meshes(sheet()), look(**SLANTED | {"sky_strength": 0.25}))
    # Gain 1 / (π / π + 0.25).
    assert linear(image[0])[150, 150, 0] == pytest.approx(
        (math.cos(math.pi / 4) + 0.25) / 1.25, abs=BYTE
    )


def test_the_far_side_gets_what_goes_through_and_the_near_side_loses_it() -> None:
    for angle, share in ((math.pi / 2, 0.7), (-math.pi / 2, 0.3)):
        zeta = look(**SLANTED, translucency=0.3, camera_angle=angle)
        image = camera_of().render(meshes(sheet()), zeta)
        assert linear(image[0])[150, 150, 0] == pytest.approx(
            share * math.cos(math.pi / 4), abs=BYTE
        )


def test_exposure_doubles_with_each_stop() -> None:
    dark, darker = (
        linear(camera_of().render(meshes(sheet()), look(exposure_bias=bias))[0])[150, 150, 0]
        for bias in (-1.0, -2.0)
    )
    assert (dark, darker) == (pytest.approx(0.5, abs=BYTE), pytest.approx(0.25, abs=BYTE))


def brightness(image, camera, points: list[tuple[float, float, float]]) -> list[float]:
    """Linear values of the pixels that points of the world fall into."""
    places, _ = camera.project(torch.tensor(points, dtype=torch.float64))
    return [float(linear(image)[int(y), int(x), 0]) for x, y in places.tolist()]


def test_a_shadow_falls_where_the_suns_rays_put_it() -> None:
    # A square 0.5 m before a wall shades the one of its size 0.5 m lower, out of the view of a
    # camera that looks up.
    scene = meshes(together(sheet(side=2.4), sheet(side=0.4, middle=(0.1, -0.5, 0.7))))
    zeta = look(**SLANTED, camera_height=-3.0)
    camera, image = stage(scene, zeta).camera, camera_of().render(scene, zeta)[0]
    inside = [(0.1 + dx, 0.0, 0.2 + dz) for dx in (-0.15, 0, 0.15) for dz in (-0.15, 0, 0.15)]
    outside = [
        (0.1 + 0.25 * dx, 0.0, 0.2 + 0.25 * dz) for dx, dz in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    # A pixel is 1/60 m, a texel of the shadow map 1/100 m: 0.05 m from an edge neither reaches over
    # it.
    assert brightness(image, camera, inside) == pytest.approx([0.0] * 9, abs=BYTE)
    assert brightness(image, camera, outside) == pytest.approx(
        [math.cos(math.pi / 4)] * 4, abs=BYTE
    )


def test_a_penumbra_rises_as_the_part_of_the_suns_disc_that_an_edge_leaves_free() -> None:
    # The sun in the wall's normal; an upright edge at x = 0, 0.8 m before the wall; the sun's
    # angular radius atan 0.15.
    scene = meshes(together(sheet(side=2.4), sheet(side=3.0, middle=(-1.5, -0.8, 0.0))))
    sun = SLANTED | {"sun_height": 1e-3, "sun_radius": 3.0, "sun_softness": 0.15}
    zeta = look(**sun, raster_samples=96, camera_angle=math.pi / 2 + 0.6, view_angle=1.0)
    x = np.linspace(-0.05, 0.2, 11)
    found = brightness(
        camera_of().render(scene, zeta)[0],
        stage(scene, zeta).camera,
        [(float(value), 0.0, 0.0) for value in x],
    )
    s = np.clip(x / (0.8 * 0.15), -1, 1)
    expected = 0.5 + (s * np.sqrt(1 - s**2) + np.arcsin(s)) / math.pi
    # A pixel and a texel, 0.02 and 0.015 m, move it by up to a tenth of the penumbra's half width.
    assert found == pytest.approx(expected.tolist(), abs=0.1)


@pytest.mark.parametrize("softness", [0.0, 0.3, 2.0, 10.0])
def test_the_suns_points_light_a_surface_that_faces_it_with_its_strength(softness) -> None:
    samples = Samples.of(
        look(sun_strength=5.0, sun_softness=softness, raster_samples=64), to_sun=(0.6, 0.0, 0.8)
    )
    directions = samples.to_sun.reshape(-1, 3)
    received = samples.sun_weight * np.maximum(directions @ [0.6, 0.0, 0.8], 0).sum()
    assert received == pytest.approx(5.0, rel=1e-3)  # the midpoint rule in the cosine is exact
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(128))
    mean = directions.mean(axis=0)
    assert mean / np.linalg.norm(mean) == pytest.approx([0.6, 0.0, 0.8], abs=0.05)
    assert (directions @ [0.6, 0.0, 0.8] >= math.cos(math.atan(softness)) - 1e-12).all()
