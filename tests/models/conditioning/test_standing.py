"""Edges that stand still: their length is that of what was drawn, and neither what moves nor
foliage has any."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from flagdata.core.arrays import BoolArray, UInt8Array
from flagdata.core.rng import stream
from models.conditioning.standing import Box, Standing

SIDE, COUNT = 200, 24
BOX: Box = (80.0, 60.0, 160.0, 120.0)


def films(noise: float = 2.0) -> UInt8Array:
    """(COUNT, SIDE, SIDE) an even sky."""
    return np.clip(150 + stream(1, "sky").normal(0, noise, (COUNT, SIDE, SIDE)), 0, 255).astype(
        np.uint8
    )


def standing(pictures: UInt8Array, *, enlarged: float = 1.0) -> Standing:
    return Standing.of(pictures, np.ones((SIDE, SIDE), bool), enlarged=enlarged)


@pytest.mark.parametrize(("left", "upper", "lower"), [(74, 60, 120), (70, 40, 180), (156, 75, 130)])
def test_a_pole_at_a_side_has_its_height(left: int, upper: int, lower: int) -> None:
    pictures = films()
    pictures[:, upper:lower, left : left + 6] = 60
    assert standing(pictures).beside(BOX).length == pytest.approx(
        (lower - upper) / 60, abs=0.12
    )  # ends are rounded off


def test_a_slanting_pole_has_its_height_and_one_far_away_or_inside_has_none() -> None:
    pictures = films()
    for row in range(40, 180):
        pictures[:, row, 70 + row // 8 : 76 + row // 8] = 60
    assert standing(pictures).beside(BOX).length == pytest.approx(140 / 60, abs=0.15)
    assert standing(pictures).beside((20.0, 60.0, 44.0, 120.0)).length < 0.1
    assert standing(pictures).beside((40.0, 60.0, 130.0, 120.0)).length < 0.1


def test_a_bar_at_the_top_has_its_width() -> None:
    pictures = films()
    pictures[:, 52:57, 60:190] = 60
    found = standing(pictures)
    assert found.above(BOX).length == pytest.approx(130 / 80, abs=0.1)
    assert found.beside(BOX).length < 0.15


def test_what_moves_and_what_is_padded_stands_not_still() -> None:
    moving, padded = films(), films()
    for k, picture in enumerate(moving):
        picture[30:180, 60 + 3 * (k % 8) : 66 + 3 * (k % 8)] = 60
    assert standing(moving).beside(BOX).length < 0.2
    padded[:, 30:180, 70:76] = 60
    inside = np.ones((SIDE, SIDE), bool)
    inside[:, :90] = False
    assert Standing.of(padded, inside).beside(BOX).length == 0.0


def test_a_pole_that_cloth_hides_for_less_than_half_of_the_time_is_found() -> None:
    pictures = films()
    pictures[:, 40:180, 74:80] = 60
    pictures[: COUNT // 2 - 1, 60:100, 70:90] = 220
    assert standing(pictures).beside(BOX).length > 1.5


def test_foliage_that_stands_still_is_no_pole() -> None:
    leaves = 110 + 250 * cv2.GaussianBlur(
        stream(2, "leaves").normal(0, 1, (SIDE, SIDE)), (0, 0), 2.0
    )
    pictures = leaves + stream(3, "noise").normal(0, 2, (COUNT, SIDE, SIDE))
    assert standing(np.clip(pictures, 0, 255).astype(np.uint8)).beside(BOX).length < 0.5


def test_a_faint_pole_of_a_small_film_is_found_in_its_enlarged_picture() -> None:
    pictures = films(noise=0.5)
    for offset, depth in enumerate((1, 3, 5, 6, 6, 6, 5, 3, 1)):  # an edge as enlarging makes it
        pictures[:, 40:180, 70 + offset] -= np.uint8(depth)
    assert standing(pictures, enlarged=3.0).beside(BOX).length > 2.0
    assert standing(pictures).beside(BOX).length == 0.0


def cloth_and(pictures: UInt8Array) -> UInt8Array:
    """With cloth in the box, whose slanting stripes run."""
    rows, columns = np.mgrid[60:120, 80:160]
    for k, picture in enumerate(pictures):
        picture[60:120, 80:160] = np.where((columns + rows // 2 + 7 * k) // 9 % 2, 220, 90)
    return pictures


def places() -> BoolArray:
    """(SIDE, SIDE) the box."""
    found = np.zeros((SIDE, SIDE), bool)
    found[60:120, 80:160] = True
    return found


def test_a_line_has_its_reach_beyond_the_box_in_heights_of_it() -> None:
    pictures = films()
    pictures[:, 48:180, 74:80] = 60
    found = standing(pictures).beside(BOX, ("left",))
    assert found.above == pytest.approx(12 / 60, abs=0.07)
    assert found.below == pytest.approx(60 / 60, abs=0.07)
    assert standing(pictures).beside(BOX, ("right",)).length < 0.1


def test_a_bar_at_the_bottom_is_not_at_the_top() -> None:
    pictures = films()
    pictures[:, 122:127, 60:190] = 60
    found = standing(pictures)
    assert found.below(BOX).length == pytest.approx(130 / 80, abs=0.1)
    assert found.above(BOX).length < 0.1


def test_a_pole_inside_what_moves_goes_on_below_it_and_a_stripe_of_cloth_does_not() -> None:
    pole, stripe = cloth_and(films()), cloth_and(films())
    pole[:, 55:190, 118:124] = 20
    stripe[:, 60:120, 118:124] = 20
    both = standing(pole).inside(BOX, places())
    assert both.going_on == both.height == pytest.approx(1.0, abs=0.12)
    only = standing(stripe).inside(BOX, places())
    assert only.height == pytest.approx(1.0, abs=0.12)
    assert only.going_on == 0.0


def test_a_pole_at_the_side_of_what_moves_is_not_inside_it() -> None:
    pictures = cloth_and(films())
    pictures[:, 40:190, 76:88] = 20
    found = standing(pictures).inside(BOX, places())
    assert found.height < 0.1
    assert found.going_on == 0.0
