"""Orientation, crop and scale."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from flagdata.errors import UsageError
from flagdata.ingest import CameraOptions, CropBox, parse_crop
from flagdata.ingest.camera.camera_options import exact
from flagdata.ingest.camera.picture_geometry import Geometry, Orientation, settle_crop, upright_size
from tests.refusals import unrefused

# A stored picture whose corners differ: 1 2 on top, 3 4 below.
CORNERS = np.array([[1, 2], [3, 4]], dtype=np.uint8)
ONE = 1 << 16


@pytest.mark.parametrize(
    ("value", "upright", "clockwise", "mirrored"),
    [
        # CIPA DC-008: which stored row and column is the visual top and left.
        (1, [[1, 2], [3, 4]], 0, False),
        (2, [[2, 1], [4, 3]], 0, True),
        (3, [[4, 3], [2, 1]], 180, False),
        (4, [[3, 4], [1, 2]], 180, True),
        (5, [[1, 3], [2, 4]], 270, True),
        (6, [[3, 1], [4, 2]], 90, False),
        (7, [[4, 2], [3, 1]], 90, True),
        (8, [[2, 4], [1, 3]], 270, False),
    ],
)
def test_the_eight_exif_orientations(
    value: int, upright: list[list[int]], clockwise: int, mirrored: bool
) -> None:
    orientation = Orientation.of_exif(value)
    assert orientation.apply(CORNERS).tolist() == upright
    assert orientation.mirrored is mirrored
    # Mirroring left-right first, then turning clockwise, is the same.
    stored = CORNERS[:, ::-1] if mirrored else CORNERS
    assert np.rot90(stored, -clockwise // 90).tolist() == upright
    assert orientation.clockwise == clockwise


@pytest.mark.parametrize(
    ("matrix", "upright"),
    [
        ([ONE, 0, 0, 0, ONE, 0, 0, 0, 1 << 30], [[1, 2], [3, 4]]),
        # A phone held upright: QuickTime's 90° clockwise, (p, q) → (-q, p).
        ([0, ONE, 0, -ONE, 0, 0, 0, 0, 1 << 30], [[3, 1], [4, 2]]),
        ([-ONE, 0, 0, 0, -ONE, 0, 0, 0, 1 << 30], [[4, 3], [2, 1]]),
        ([0, -ONE, 0, ONE, 0, 0, 0, 0, 1 << 30], [[2, 4], [1, 3]]),
        ([-ONE, 0, 0, 0, ONE, 0, 0, 0, 1 << 30], [[2, 1], [4, 3]]),
    ],
)
def test_display_matrices(matrix: list[int], upright: list[list[int]]) -> None:
    orientation = Orientation.of_display_matrix(matrix)
    assert orientation.exact
    assert orientation.apply(CORNERS).tolist() == upright


def test_a_matrix_of_an_odd_angle_is_taken_to_the_nearest_and_says_so() -> None:
    cos, sin = round(ONE * 0.9848), round(ONE * 0.1736)  # 10°
    orientation = Orientation.of_display_matrix([cos, sin, 0, -sin, cos, 0, 0, 0, 1 << 30])
    assert not orientation.exact
    assert orientation.apply(CORNERS).tolist() == CORNERS.tolist()


@given(st.integers(1, 8), st.integers(0, 40), st.integers(0, 20), st.integers(8, 40))
def test_cropping_then_turning_equals_turning_then_cropping(
    value: int, x: int, y: int, side: int
) -> None:
    stored = np.random.default_rng(5).integers(0, 256, (64, 96), dtype=np.uint8)
    orientation = Orientation.of_exif(value)
    upright = orientation.apply(stored)
    x, y = min(x, upright.shape[1] - side), min(y, upright.shape[0] - side)
    geometry = Geometry(
        width=96,
        height=64,
        aspect=Fraction(1),
        orientation=orientation,
        crop=CropBox(x=x, y=y, width=side, height=side),
        size=side,
    )
    out = geometry.render(Image.fromarray(stored), black=0, white=255)
    assert np.array_equal(out, upright[y : y + side, x : x + side])


def test_an_oblong_crop_is_padded_and_never_stretched() -> None:
    # A disk stays a disk: its extent is the same both ways.
    rows, columns = np.mgrid[:200, :400]
    disk = np.where((rows - 100) ** 2 + (columns - 200) ** 2 <= 80**2, 255, 60).astype(np.uint8)
    geometry = Geometry(
        width=400,
        height=200,
        aspect=Fraction(1),
        orientation=Orientation(),
        crop=CropBox(x=0, y=0, width=400, height=200),
        size=300,
    )
    assert geometry.padded
    out = geometry.render(Image.fromarray(disk), black=0, white=255)
    assert out.shape == (300, 300)
    # 300 × 150 in the middle; black above and below, and nowhere else.
    assert (out[:75] == 0).all()
    assert (out[225:] == 0).all()
    assert (out[75:225] > 0).all()
    bright = out > 157
    assert bright.any(axis=1).sum() == bright.any(axis=0).sum() == pytest.approx(120, abs=1)
    np.testing.assert_array_equal(
        geometry.content(Image.fromarray(disk), black=0, white=255), out[75:225]
    )


def test_shrinking_averages_over_area_and_does_not_alias() -> None:
    # One-pixel stripes at 1200 px are far beyond what 300 px can show: what is left is their mean,
    # 127.5.
    stripes = np.tile(np.array([0, 255], dtype=np.uint8), (1200, 600))
    geometry = Geometry(
        width=1200,
        height=1200,
        aspect=Fraction(1),
        orientation=Orientation(),
        crop=CropBox(x=0, y=0, width=1200, height=1200),
        size=300,
    )
    out = geometry.render(Image.fromarray(stripes), black=0, white=255).astype(float)
    # The kernel's response to the alternating pattern is below 1 %; the outermost pixel sees half a
    # kernel.
    assert np.abs(out[:, 2:-2] - 127.5).max() <= 3


def test_scaling_does_not_ring_at_an_edge() -> None:
    edge = np.full((900, 900), 50, dtype=np.uint8)
    edge[:, 450:] = 200
    for crop in (900, 200):
        geometry = Geometry(
            width=900,
            height=900,
            aspect=Fraction(1),
            orientation=Orientation(),
            crop=CropBox(x=450 - crop // 2, y=0, width=crop, height=crop),
            size=300,
        )
        out = geometry.render(Image.fromarray(edge), black=0, white=255)
        assert (out.min(), out.max()) == (50, 200)


def test_a_moving_picture_moves_by_the_same_share() -> None:
    # A step edge at column c of 600 px is at c/2 of 300 px: its mid-gray crossing is exact to a
    # small part of a pixel.
    for column in (200, 251, 333):
        edge = np.zeros((600, 600), dtype=np.uint8)
        edge[:, column:] = 200
        geometry = Geometry(
            width=600,
            height=600,
            aspect=Fraction(1),
            orientation=Orientation(),
            crop=CropBox(x=0, y=0, width=600, height=600),
            size=300,
        )
        out = geometry.render(Image.fromarray(edge), black=0, white=255)[150].astype(float)
        assert 300 - out.sum() / 200 == pytest.approx(column / 2, abs=0.02)


def test_limited_range_is_stretched_and_clipped_only_outside_it() -> None:
    levels = np.tile(np.array([16, 235, 126, 0, 255, 17], dtype=np.uint8), (6, 1))
    geometry = Geometry(
        width=6,
        height=6,
        aspect=Fraction(1),
        orientation=Orientation(),
        crop=CropBox(x=0, y=0, width=6, height=6),
        size=6,
    )
    # (126 - 16) · 255 / 219 = 128.08; (17 - 16) · 255 / 219 = 1.16.
    assert geometry.render(Image.fromarray(levels), black=16, white=235)[0].tolist() == [
        0,
        255,
        128,
        0,
        255,
        1,
    ]


def test_pixel_shape_widens_before_turning() -> None:
    # PAL at 4:3: 720 × 576 with pixels of 16:15 is 768 × 576.
    assert upright_size(720, 576, Fraction(16, 15), Orientation()) == (768, 576)
    assert upright_size(720, 576, Fraction(16, 15), Orientation(transpose=True)) == (576, 768)


def test_crops_by_name() -> None:
    assert settle_crop("whole", width=1920, height=1080).as_tuple() == (0, 0, 1920, 1080)
    assert settle_crop("square", width=1920, height=1080).as_tuple() == (420, 0, 1080, 1080)
    assert parse_crop(" 10,20 , 300,400") == CropBox(x=10, y=20, width=300, height=400)
    assert parse_crop("AUTO") == "auto"


def test_what_is_not_a_crop_is_refused() -> None:
    cases = ["", "1,2,3", "a,b,c,d", "-1,0,5,5", "0,0,0,5", "centre", "1,2,3,4,5", "0.5,0,10,10"]
    assert not unrefused(lambda text: parse_crop(text), zip(cases), UsageError)


def test_options_without_meaning_are_refused() -> None:
    cases = [
        {"rate": 0.0},
        {"rate": float("nan")},
        {"true_fps": -1.0},
        {"true_fps": float("inf")},
        {"sequence_fps": 0.0},
        {"exposure": -1e-3},
        {"tolerance": float("nan")},
        {"size": 0},
        {"threads": 0},
        {"crop": "centre"},
        {"rate": "native", "tolerance": 0.1},
    ]
    assert not unrefused(lambda options: CameraOptions(**options), zip(cases), UsageError)


def test_decimal_names_of_television_rates_mean_the_exact_ones() -> None:
    assert exact(29.97) == Fraction(30000, 1001)
    assert exact(23.976) == exact(23.98) == Fraction(24000, 1001)
    assert exact(59.94) == Fraction(60000, 1001)
    assert exact(25.0) == 25
    assert exact(30.0) == 30
    assert exact(12.5) == Fraction(25, 2)
