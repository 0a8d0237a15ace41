"""Bytes, backgrounds and texture levels against numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sim.render import plate, to_bytes, to_linear
from sim.render.develop import develop
from sim.render.texture import Pyramid
from tests.sim.render.conftest import look


def test_the_published_points_of_srgb() -> None:
    # IEC 61966-2-1: the linear part ends at code 0.04045; code 188 is half of white's light to a
    # byte's width.
    assert to_linear(np.array([0, 10, 188, 255], dtype=np.uint8)) == pytest.approx(
        [0.0, 10 / 255 / 12.92, ((188 / 255 + 0.055) / 1.055) ** 2.4, 1.0]
    )
    assert to_bytes(torch.tensor([-1.0, 0.0, 0.5, 1.0, 7.0])).tolist() == [0, 0, 188, 255, 255]


def test_every_byte_comes_back() -> None:
    codes = np.arange(256, dtype=np.uint8)
    assert to_bytes(torch.from_numpy(to_linear(codes))).tolist() == codes.tolist()


def test_half_covered_pixels_mix_light_not_bytes() -> None:
    scene = torch.tensor([[[[0.5, 0.5, 0.5, 0.5]]]])  # white of radiance 1 over half of a pixel
    assert develop(scene, torch.zeros((1, 1, 3)), gain=1.0)[0, 0, 0].tolist() == [188] * 3
    assert develop(scene, torch.ones((1, 1, 3)), gain=0.0)[0, 0, 0].tolist() == [188] * 3


def grid_picture() -> np.ndarray:
    """500 × 700 with the column in red and the row in green, in steps of 50 px from 0."""
    picture = np.zeros((500, 700, 3), dtype=np.uint8)
    picture[..., 0] = (np.arange(700) // 50 * 10)[None, :]
    picture[..., 1] = (np.arange(500) // 50 * 10)[:, None]
    return picture


def cell(shown: np.ndarray, row: int, column: int) -> tuple[int, int]:
    """(column, row) of the 50 px square that a pixel of the frame shows."""
    code = to_bytes(torch.from_numpy(shown[row, column])).numpy() / 10
    return round(float(code[0])), round(float(code[1]))


def test_at_scale_0_6_the_shorter_side_fills_the_frame() -> None:
    shown = plate(grid_picture(), look(background_scale=0.6))
    assert shown.shape == (300, 300, 3)
    # 300 px show 500 of them, the middle ones across: columns 100 to 600, rows 0 to 500.
    assert cell(shown, 10, 10) == (2, 0)
    assert cell(shown, 290, 290) == (11, 9)


def test_at_scale_1_pixels_are_its_own_and_offsets_move_it() -> None:
    shown = plate(grid_picture(), look(background_scale=1.0))
    assert cell(shown, 125, 125) == (
        6,
        4,
    )  # px (325, 225) of 700 × 500: the frame begins at (200, 100)
    moved = plate(
        grid_picture(),
        look(background_scale=1.0, background_offset_x=50.0, background_offset_y=-50.0),
    )
    assert cell(moved, 125, 125) == (5, 5)


def test_beyond_its_edges_a_background_is_its_reflection() -> None:
    shown = plate(
        grid_picture(), look(background_scale=0.6, background_offset_y=60.0)
    )  # 100 px of the picture
    assert cell(shown, 45, 150) == cell(shown, 75, 150) == (7, 0)
    assert cell(shown, 15, 150) == cell(shown, 105, 150) == (7, 1)


def test_larger_frames_show_the_same_of_a_background() -> None:
    small = plate(grid_picture(), look(background_offset_x=15.0))
    large = plate(grid_picture(), look(background_offset_x=15.0, width=600, height=600))
    for row, column in ((20, 30), (150, 222), (280, 75)):
        assert cell(small, row, column) == cell(large, 2 * row, 2 * column)


def test_a_texture_is_halved_in_linear_light() -> None:
    checks = np.array([[0, 255], [255, 0]], dtype=np.uint8)[:, :, None].repeat(3, axis=2)
    pyramid = Pyramid.of(np.tile(checks, (4, 4, 1)), device=torch.device("cpu"))
    assert len(pyramid) == 4
    uv = torch.tensor([[0.3, 0.3], [0.9, 0.2]])
    assert pyramid.at(uv, torch.tensor([1, 3])) == pytest.approx(0.5 * np.ones((2, 3)))


def test_a_texture_is_bilinear_between_the_middles_of_its_texels() -> None:
    picture = np.array([[0, 255], [0, 255]], dtype=np.uint8)[:, :, None].repeat(3, axis=2)
    pyramid = Pyramid.of(picture, device=torch.device("cpu"))
    uv = torch.tensor([[0.0, 0.5], [0.25, 0.5], [0.5, 0.5], [0.625, 0.1], [1.0, 1.0]])
    found = pyramid.at(uv, torch.zeros(5, dtype=torch.int64))[:, 0]
    assert found.tolist() == pytest.approx([0.0, 0.0, 0.5, 0.75, 1.0])
