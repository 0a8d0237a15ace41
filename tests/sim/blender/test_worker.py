"""Blender's light and camera against theory: radiances of planes, silhouettes by geometry, bytes
that repeat."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sim.blender import Environment, Message, RenderError, WorkerProcess

pytestmark = pytest.mark.usefixtures("blender")
SIZE = 32
TIMEOUT = 120.0
FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
WALL = np.array([[-9, 0, -9], [9, 0, -9], [9, 0, 9], [-9, 0, 9]], dtype=np.float32)
"""A plane that faces −y."""


@pytest.fixture(scope="module")
def worker(blender: Environment) -> Iterator[WorkerProcess]:
    assert blender.blender.startswith("4.5.")
    with WorkerProcess() as process:
        yield process


def scene(
    *, toward=(0.0, -1.0, 0.0), irradiance=math.pi, angle=0.005, sky=0.0, translucency=0.0, **other
) -> Message:
    """Seen from 5 m in front of the origin, along +y; a pixel is 1/10 m there."""
    matrix = [[1, 0, 0, 0], [0, 0, -1, -5], [0, 1, 0, 0], [0, 0, 0, 1]]
    fields = {
        "engine": "CYCLES",
        "width": SIZE,
        "height": SIZE,
        "samples": 64,
        "bounces": 0,
        "threads": 1,
        "camera": {"matrix": matrix, "focal": 50.0, "centre": [SIZE / 2, SIZE / 2]},
        "sun": {"toward": list(toward), "irradiance": irradiance, "angle": angle},
        "sky": sky,
        "objects": [{"name": "cloth", "albedo": [0.8, 0.5, 0.2], "translucency": translucency}],
    }
    texture = other.pop("texture", None)
    return Message(
        kind="scene",
        fields=fields | other,
        arrays={} if texture is None else {"texture/cloth": texture},
    )


def frame(
    positions: np.ndarray = WALL, faces: np.ndarray = FACES, uv: np.ndarray = UV, seed: int = 0
) -> Message:
    arrays = {"positions/cloth": positions.astype(np.float32), "faces/cloth": faces, "uv/cloth": uv}
    return Message(kind="frame", fields={"seed": seed}, arrays=arrays)


def picture(worker: WorkerProcess, setup: Message, *frames: Message) -> np.ndarray:
    worker.request([setup], timeout=TIMEOUT)
    answers = worker.request(frames or [frame()], timeout=TIMEOUT, setup=setup)
    return np.stack([answer.arrays["rgba"] for answer in answers])


@pytest.mark.parametrize("tilt", [0.0, 30.0, 60.0])
def test_a_plane_in_the_sun_has_the_radiance_of_lambert(worker: WorkerProcess, tilt: float) -> None:
    toward = (0.0, -math.cos(math.radians(tilt)), math.sin(math.radians(tilt)))
    seen = picture(worker, scene(toward=toward))[0].reshape(-1, 4).mean(0)
    # E cos θ albedo / π, with E = π; the sun's disc of 0.3° moves the cosine by less than 1 %.
    np.testing.assert_allclose(
        seen[:3], np.array([0.8, 0.5, 0.2]) * math.cos(math.radians(tilt)), rtol=0.01
    )
    assert seen[3] == 1.0


@pytest.mark.parametrize("softness", [0.5, 2.0, 10.0])
def test_a_soft_sun_gives_a_surface_that_faces_it_the_same_irradiance(
    worker: WorkerProcess, softness: float
) -> None:
    seen = picture(worker, scene(angle=math.atan(softness)))[0].reshape(-1, 4).mean(0)
    np.testing.assert_allclose(seen[:3], [0.8, 0.5, 0.2], rtol=0.01)


def test_a_plane_under_a_uniform_sky_has_the_skys_radiance_times_its_albedo(
    worker: WorkerProcess,
) -> None:
    seen = picture(worker, scene(irradiance=0.0, sky=0.7))[0].reshape(-1, 4).mean(0)
    np.testing.assert_allclose(seen[:3], 0.7 * np.array([0.8, 0.5, 0.2]), rtol=0.02)


def test_a_sheet_lit_from_behind_shows_the_share_it_transmits(worker: WorkerProcess) -> None:
    for translucency in (0.0, 0.3):
        seen = (
            picture(worker, scene(toward=(0.0, 1.0, 0.0), translucency=translucency))[0]
            .reshape(-1, 4)
            .mean(0)
        )
        np.testing.assert_allclose(
            seen[:3], translucency * np.array([0.8, 0.5, 0.2]), rtol=0.01, atol=1e-6
        )


def test_a_rectangle_covers_the_pixels_that_geometry_says(worker: WorkerProcess) -> None:
    # 50 px focal length at 5 m: 10 px a metre. x from −1.2 to 0.4 m, z from −0.5 to 0.75 m, image y
    # down.
    corners = np.array([[-1.2, 0, -0.5], [0.4, 0, -0.5], [0.4, 0, 0.75], [-1.2, 0, 0.75]])
    coverage = picture(worker, scene(), frame(corners))[0][..., 3]
    rows, columns = coverage.sum(1), coverage.sum(0)
    assert coverage.sum() == pytest.approx(16.0 * 12.5, rel=0.01)
    assert np.flatnonzero(columns > 0.1).tolist() == list(range(4, 20))
    assert np.flatnonzero(rows > 0.1).tolist() == list(range(8, 21))  # from 8.5 to 21


def test_the_optical_axis_meets_the_image_where_the_camera_says(worker: WorkerProcess) -> None:
    corners = np.array([[-0.3, 0, -0.3], [0.3, 0, -0.3], [0.3, 0, 0.3], [-0.3, 0, 0.3]])
    moved = scene(camera={**scene().fields["camera"], "centre": [20.0, 10.0]})
    coverage = picture(worker, moved, frame(corners))[0][..., 3]
    y, x = (np.average(np.arange(SIZE) + 0.5, weights=coverage.sum(axis)) for axis in (1, 0))
    assert (x, y) == (pytest.approx(20.0, abs=0.05), pytest.approx(10.0, abs=0.05))


def test_texture_row_0_is_on_top_and_its_bytes_are_srgb(worker: WorkerProcess) -> None:
    texture = np.zeros((8, 8, 3), dtype=np.uint8)
    texture[:4, :4], texture[4:, 4:] = (255, 0, 0), (0, 0, 188)
    corners = np.array([[-1.6, 0, -1.6], [1.6, 0, -1.6], [1.6, 0, 1.6], [-1.6, 0, 1.6]])
    seen = picture(worker, scene(texture=texture), frame(corners))[0]
    np.testing.assert_allclose(seen[4, 4, :3], [1.0, 0.0, 0.0], atol=0.01)
    np.testing.assert_allclose(
        seen[27, 27, :3], [0.0, 0.0, 0.5029], atol=0.01
    )  # (188/255 + 0.055)/1.055, ^2.4
    np.testing.assert_allclose(seen[4, 27, :3], 0.0, atol=0.01)


def test_a_new_topology_takes_the_place_of_the_last(worker: WorkerProcess) -> None:
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], dtype=float)
    half = frame(square[:3], FACES[:1], UV[:3])
    areas = picture(worker, scene(), frame(square), half, frame(square))[..., 3].sum((1, 2))
    np.testing.assert_allclose(areas, [400.0, 200.0, 400.0], rtol=0.02)  # 10 px a metre, 2 m × 2 m


def test_a_killed_worker_is_replaced_and_gives_the_same_bytes(worker: WorkerProcess) -> None:
    setup, frames = scene(sky=0.3, angle=0.5, bounces=2), [frame(seed=seed) for seed in range(2)]
    before = picture(worker, setup, *frames)
    assert not np.array_equal(before[0], before[1])  # the noise differs from frame to frame
    restarts, pid = worker.restarts, worker.pid
    assert pid is not None
    os.kill(pid, 9)
    answers = worker.request(frames, timeout=TIMEOUT, setup=setup)
    assert worker.restarts == restarts + 1
    np.testing.assert_array_equal(np.stack([answer.arrays["rgba"] for answer in answers]), before)


def test_what_blender_refuses_is_reported_and_the_worker_lives_on(worker: WorkerProcess) -> None:
    pid = worker.pid
    with pytest.raises(RenderError, match="NO_SUCH_ENGINE"):
        worker.request([scene(engine="NO_SUCH_ENGINE")], timeout=TIMEOUT)
    assert worker.pid == pid
    assert picture(worker, scene())[0][..., 3].all()


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs /proc")
def test_nothing_of_this_pythons_environment_is_in_blenders_process(worker: WorkerProcess) -> None:
    picture(worker, scene())
    libraries = {
        line.split()[-1] for line in Path(f"/proc/{worker.pid}/maps").read_text().splitlines()
    }
    assert any("bpy" in path for path in libraries)
    assert any("numpy" in path for path in libraries)
    assert not [path for path in libraries if path.startswith(f"{sys.prefix}{os.sep}")]
