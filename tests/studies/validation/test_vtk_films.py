"""Films by VTK: motion, view and files are what a design says, so that what they are measured by is
the truth."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.errors import NotFoundError
from tests.studies.validation.environments import VTK
from tests.studies.validation.vtk_films.designs import ALL_RATES, designs
from tests.studies.validation.vtk_films.runs import RATE, Motion
from tests.studies.validation.vtk_films.scene import (
    Body,
    Camera,
    Light,
    Scene,
    View,
    film,
    pictures,
)


@pytest.fixture(scope="session")
def vtk() -> Path:
    """The Python of VTK's environment."""
    try:
        return VTK.find()
    except NotFoundError as error:
        pytest.skip(f"{error.what}: {error.fix}")


def _motion(frequency: float) -> Motion:
    """A vertex that swings along y, beside three that stand still."""
    times = np.arange(100) / RATE
    positions = np.zeros((100, 4, 3))
    positions[:, :, [0, 2]] = [[0, 0], [1, 0], [1, 1], [0, 1]]
    positions[:, 1, 1] = np.sin(2 * np.pi * frequency * times)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Motion(positions=positions, faces=faces, rest=positions[0][:, [0, 2]], wind=5.0)


def test_between_its_frames_a_run_moves_as_its_sines_do() -> None:
    times = np.linspace(1.0, 3.0, 241)
    for frequency, error in (
        (2.0, 1e-4),
        (6.0, 0.02),
    ):  # of an amplitude of 1; 6 Hz is half of the limit of 25 Hz
        shown = _motion(frequency).at(times)[:, 1, 1]
        assert np.abs(shown - np.sin(2 * np.pi * frequency * times)).max() < error


def test_names_are_unique_and_every_rate_is_there() -> None:
    found = designs()
    assert len({one.name for one in found}) == len(found)
    assert {one.rate for one in found if one.part == "rates"} == set(ALL_RATES)
    assert sum(one.part == "coverage" for one in found) == 60


def _square(view: View, *, rate: Fraction = Fraction(25), frames: int = 3, crf: int = 1) -> Scene:
    """A white square of 0.4 m about the target, before black, that steps 0.5 m to the right with
    each frame."""
    corners = np.array([[-0.2, 0, -0.2], [0.2, 0, -0.2], [0.2, 0, 0.2], [-0.2, 0, 0.2]])
    moved = corners[None] + np.arange(frames)[:, None, None] * np.array([0.5, 0.0, 0.0])
    body = Body(
        positions=moved,
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
        lit=False,
        ambient=1.0,
        diffuse=0.0,
        gloss=0.0,
    )
    light = Light(towards=(0.0, -1.0, 0.0), intensity=1.0)
    return Scene(
        bodies=[body],
        lights=[light],
        view=view,
        rate=rate,
        frames=frames,
        camera=Camera(noise=0.0, crf=crf),
    )


def _view(turned: np.ndarray, side: int = -1) -> View:
    return View(
        size=(160, 120),
        target=(0.0, 0.0, 0.0),
        yaw=0.0,
        elevation=0.0,
        side=side,
        distance=8.0,
        extent=2.4,
        turned=turned,
    )


def _place(picture: np.ndarray) -> tuple[float, float]:
    y, x = np.nonzero(picture[..., 1] > 128)
    return float(x.mean() + 0.5), float(y.mean() + 0.5)


def test_a_body_is_where_the_view_puts_it(vtk: Path) -> None:
    """2.4 m are 120 px, so 0.5 m are 25 px: to the right where the wind blows to the right."""
    for side, sign in ((-1, 1), (1, -1)):
        shown = list(pictures(vtk, _square(_view(np.zeros((3, 3)), side))))
        for frame, picture in enumerate(shown):
            assert _place(picture) == pytest.approx((80 + 25 * sign * frame, 60), abs=0.5)
            assert np.count_nonzero(picture[..., 1] > 128) == pytest.approx(
                400, rel=0.05
            )  # (0.4 m · 50 px/m)²


def test_the_camera_turns_by_pixels_and_shutters_blur(vtk: Path) -> None:
    turned = np.array([[0, 0, 0], [6, 0, 0], [0, 4, 0]], dtype=np.float64)
    still = _square(_view(turned), frames=3)
    still = replace(
        still, bodies=[replace(still.bodies[0], positions=still.bodies[0].positions[:1])]
    )
    places = np.array([_place(picture) for picture in pictures(vtk, still)])
    assert np.abs(places[1] - places[0]) == pytest.approx((6, 0), abs=0.5)
    assert np.abs(places[2] - places[0]) == pytest.approx((0, 4), abs=0.5)
    blurred = replace(_square(_view(np.zeros((3, 3)))), frames=1, subframes=3)
    shown = next(iter(pictures(vtk, blurred)))
    half = 255 * (1 / 3) ** (1 / 2.2)  # a third of the light
    assert shown[60, [80, 105, 130], 1] == pytest.approx([half] * 3, abs=3)


def test_a_film_has_its_rate_its_frames_and_its_mirror(vtk: Path, tmp_path: Path) -> None:
    scene = _square(_view(np.zeros((3, 3))), rate=ALL_RATES["29.97"])
    scene = replace(scene, camera=replace(scene.camera, mirrored=True))
    film(vtk, scene, tmp_path / "film.mp4", np.random.default_rng(1))
    with av.open(str(tmp_path / "film.mp4")) as container:
        shown = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert container.streams.video[0].average_rate == Fraction(30000, 1001)
    assert [round(_place(picture)[0]) for picture in shown] == [80, 55, 30]
