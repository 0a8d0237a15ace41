"""Motion: blur as long as speed times exposure, and instants between frames."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from sim.render import Meshes
from sim.render.shutter import move_frames
from tests.sim.render.conftest import camera_of, look
from tests.sim.render.pieces import linear, meshes, sheet

RATE = 25.0
STEADY = np.array([[0.1 * i, 0.0, 0.0] for i in range(-2, 3)])  # 0.1 m a frame: 2.5 m/s


def test_the_blur_of_an_edge_is_speed_times_exposure_about_mid_exposure() -> None:
    scene = meshes(sheet(side=1.0), moves=STEADY, rate=RATE)
    exposure = 0.032  # s; 2.5 m/s · 0.032 s · 60 px/m = 4.8 px
    image = camera_of().render(scene, look(exposure_time=exposure, raster_samples=100))
    for frame, shift in enumerate(STEADY[:, 0]):
        start = round(
            150 + 60 * shift
        )  # the middle of the square: from there 1 on the cloth, 0 beyond its right edge
        edge = linear(image[frame])[150, start : start + 45, 0]
        mean = start + edge.sum()
        spread = np.sum(-np.diff(edge) * (np.arange(1, 45) + start - mean) ** 2)
        assert mean == pytest.approx(150 + (0.5 + shift) * 60, abs=0.1)
        # A box of length L has variance L²/12; a pixel and the difference of two, boxes too, add
        # 1/12 each.
        assert np.sqrt(12 * spread - 2) == pytest.approx(4.8, abs=0.1)


def test_without_exposure_an_edge_is_sharp() -> None:
    scene = meshes(sheet(side=1.0), moves=STEADY, rate=RATE)
    profile = linear(camera_of().render(scene, look(raster_samples=16))[2])[150, :, 0]
    assert ((profile > 0.01) & (profile < 0.99)).sum() <= 2


@pytest.mark.parametrize("offset", [0.01, -0.015])
def test_steady_motion_goes_on_between_before_and_after_frames(offset) -> None:
    scene = meshes(sheet(), moves=STEADY, rate=RATE)
    assert torch.allclose(
        move_frames(scene, offset).positions,
        scene.positions + torch.tensor([2.5 * offset, 0.0, 0.0]),
        atol=1e-6,
    )


def test_positions_between_frames_are_their_weighted_mean() -> None:
    moves = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.4, 0.0]])
    scene = meshes(sheet(), moves=moves, rate=RATE)
    later = move_frames(scene, 0.01).positions.unflatten(0, (3, -1))  # a quarter of a frame's time
    start = scene.positions.unflatten(0, (3, -1))
    assert torch.allclose(later[1], 0.75 * start[1] + 0.25 * start[2], atol=1e-6)
    earlier = move_frames(scene, -0.01).positions.unflatten(0, (3, -1))
    assert torch.allclose(earlier[1], 0.75 * start[1] + 0.25 * start[0], atol=1e-6)


def ragged(*, cells: list[int], moves: np.ndarray) -> Meshes:
    """A sheet that is cut anew in each frame, and moved."""
    parts = [sheet(cells=count) for count in cells]
    return Meshes(
        positions=torch.cat(
            [torch.from_numpy(p[0] + m).float() for p, m in zip(parts, moves, strict=True)]
        ),
        faces=torch.cat([torch.from_numpy(p[1]) for p in parts]),
        uv=torch.cat([torch.from_numpy(p[2]).float() for p in parts]),
        vertex_offset=tuple(np.cumsum([0, *(len(p[0]) for p in parts)]).tolist()),
        face_offset=tuple(np.cumsum([0, *(len(p[1]) for p in parts)]).tolist()),
        anchor=(0.0, 0.0, 0.0),
        rate=RATE,
    )


@pytest.mark.parametrize("offset", [0.01, -0.015])
def test_cloth_that_is_cut_anew_moves_as_its_material_does(offset) -> None:
    scene = ragged(cells=[3, 5, 4, 1, 2], moves=STEADY)
    assert not scene.one_topology
    expected = scene.positions + torch.tensor([2.5 * offset, 0.0, 0.0])
    assert torch.allclose(move_frames(scene, offset).positions, expected, atol=2e-6)


def test_frames_of_any_topology_look_as_they_do_alone() -> None:
    moves = np.array([[-0.2, 0.0, 0.1], [0.2, 0.0, -0.1], [0.0, 0.3, 0.0]])
    both = camera_of().render(ragged(cells=[3, 6, 4], moves=moves), look())
    assert both.shape == (3, 300, 300, 3)
    alike = camera_of().render(meshes(sheet(cells=5), moves=moves), look())
    # The same flat squares, cut otherwise: only rounding of corners to 1/256 px moves a sample over
    # an edge.
    assert float((both.int() - alike.int()).abs().gt(1).float().mean()) < 1e-3


def test_cloth_that_the_next_frame_does_not_have_is_an_error_not_a_guess() -> None:
    scene = ragged(cells=[3, 5], moves=STEADY[:2])
    uv = scene.uv.clone()
    uv[16:] *= 0.5  # the second frame has a quarter of the cloth
    torn = Meshes(
        positions=scene.positions,
        faces=scene.faces,
        uv=uv,
        vertex_offset=scene.vertex_offset,
        face_offset=scene.face_offset,
        anchor=scene.anchor,
        rate=RATE,
    )
    with pytest.raises(InputError, match="in no face of the other"):
        move_frames(torn, 0.01)


def test_frames_are_the_same_however_many_are_worked_on_together(monkeypatch) -> None:
    scene, zeta = (
        meshes(sheet(side=1.0), moves=STEADY, rate=RATE),
        look(exposure_time=0.02, raster_samples=2),
    )
    together = camera_of().render(scene, zeta)
    monkeypatch.setattr("sim.render.raster._TOGETHER", 2)
    assert torch.equal(camera_of().render(scene, zeta), together)


def test_a_part_of_a_sequence_is_rendered_as_in_the_whole() -> None:
    """The camera aims at the cloth of all frames, not of the part's."""
    scene, zeta = (
        meshes(sheet(side=1.0), moves=STEADY, rate=RATE),
        look(exposure_time=0.02, raster_samples=4),
    )
    renderer = camera_of()
    whole = renderer.render(scene, zeta)
    assert torch.equal(renderer.part(scene, zeta, 1, 4), whole[1:4])
    assert torch.equal(renderer.part(scene, zeta, 0, 2), whole[:2])
    assert not torch.equal(renderer.render(scene.part(0, 2), zeta), whole[:2])
