"""Silhouettes of triangles are what clipping says, with a kernel and without one, and nearly what
OpenCV draws."""

from __future__ import annotations

from fractions import Fraction

import cv2
import numpy as np
import pytest

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.rng import stream
from measure.observables import drawing
from measure.observables.drawing import STEPS, drawn

Point = tuple[Fraction, Fraction]
WIDTH, HEIGHT = 9, 7


def clipped(triangle: list[Point], middle: Point) -> list[Point]:
    """The part of a triangle in the middle third of a pixel, by Sutherland and Hodgman (1974)."""
    polygon = triangle
    for axis in (0, 1):
        for side in (1, -1):
            end = side * middle[axis] + Fraction(1, 6)
            inside = [side * point[axis] <= end for point in polygon]
            kept: list[Point] = []
            for k, point in enumerate(polygon):
                before = polygon[k - 1]
                if inside[k] != inside[k - 1]:
                    share = (end * side - before[axis]) / (point[axis] - before[axis])
                    kept.append(
                        (
                            before[0] + share * (point[0] - before[0]),
                            before[1] + share * (point[1] - before[1]),
                        )
                    )
                if inside[k]:
                    kept.append(point)
            polygon = kept
    return polygon


def by_clipping(places: FloatArray) -> BoolArray:
    points = [
        (Fraction(int(x), STEPS), Fraction(int(y), STEPS)) for x, y in np.rint(places * STEPS)
    ]
    half = Fraction(1, 2)
    return np.array(
        [[bool(clipped(points, (x + half, y + half))) for x in range(WIDTH)] for y in range(HEIGHT)]
    )


def triangles(count: int) -> FloatArray:
    """(triangle, 3, 2) of all sizes, some beyond the picture, some on the pixels' own lines, some
    flat."""
    rng = stream(5, "triangles")
    drawn_at_random = rng.uniform(-4, 13, (count, 3, 2))
    drawn_at_random[::3] = np.rint(drawn_at_random[::3] * 6) / 6
    drawn_at_random[1::9, 2] = drawn_at_random[1::9, :2].mean(axis=1)
    drawn_at_random[4::9, 2] = drawn_at_random[4::9, 1]
    return drawn_at_random


@pytest.fixture(params=["kernel", "numpy"])
def with_or_without_a_kernel(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    if request.param == "numpy":
        monkeypatch.setattr(drawing, "library", lambda: None)
    elif drawing.library() is None:
        pytest.skip("no C++ compiler")


@pytest.mark.usefixtures("with_or_without_a_kernel")
def test_a_pixel_counts_where_the_triangle_clipped_to_its_middle_third_is_not_empty() -> None:
    for places in triangles(60):
        (mask,) = drawn(places[None], np.array([[0, 1, 2]]), width=WIDTH, height=HEIGHT)
        np.testing.assert_array_equal(mask, by_clipping(places), err_msg=str(places))


@pytest.mark.usefixtures("with_or_without_a_kernel")
def test_the_order_of_corners_does_not_matter_and_triangles_unite() -> None:
    places = triangles(8).reshape(1, -1, 2)
    faces: IntArray = np.arange(24).reshape(8, 3)
    together = drawn(places, faces, width=WIDTH, height=HEIGHT)
    turned = drawn(places, faces[::-1, ::-1], width=WIDTH, height=HEIGHT)
    single = [drawn(places, face[None], width=WIDTH, height=HEIGHT) for face in faces]
    np.testing.assert_array_equal(turned, together)
    np.testing.assert_array_equal(np.logical_or.reduce(single), together)


def test_opencv_draws_the_same_but_for_pixels_whose_middle_third_an_edge_just_touches() -> None:
    """Drawn three times as fine, of which each third pixel is taken.

    OpenCV leaves out what an edge crosses at a corner only: of dx + dy fine pixels it draws max(dx,
    dy), so up to a half is missing, and a third of an outline's pixels has an edge in its middle
    third.
    """
    rng = stream(6, "cloth")
    places = 20 + rng.uniform(0, 60, (4, 40, 2))
    faces = np.array([rng.choice(40, 3, replace=False) for _ in range(12)])
    masks = drawn(places, faces, width=100, height=100)
    for mask, points in zip(masks, np.rint((places * 3 - 0.5) * 64).astype(np.int32), strict=True):
        fine = np.zeros((300, 300), np.uint8)
        for triangle in points[faces]:
            cv2.fillConvexPoly(fine, triangle, 1, shift=6)
        by_opencv = fine[1::3, 1::3].astype(bool)
        outline = mask & ~cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        assert not (by_opencv & ~mask).any()
        assert (mask & ~by_opencv).sum() <= outline.sum() / 6


def test_the_area_is_that_of_the_polygon_and_a_sixth_of_a_pixel_about_it() -> None:
    """A disc of radius 40: pi (40 + 1/6)², as long as its sides hide no step."""
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    rim = 50 + 40 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    places = np.concatenate([[[50.0, 50.0]], rim])[None]
    faces = np.array([[0, 1 + k, 1 + (k + 1) % 400] for k in range(400)])
    mask = drawn(places, faces, width=100, height=100)
    # The square reaches a sixth along an axis and sqrt(2) times as far along a diagonal: 4/pi of it
    # in the mean.
    assert mask.sum() == pytest.approx(np.pi * (40 + 4 / np.pi / 6) ** 2, rel=2e-3)
