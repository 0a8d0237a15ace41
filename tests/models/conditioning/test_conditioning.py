"""Films that are drawn here, of which camera, flag and background are known: what the conditioning
makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.core.rng import stream
from flagdata.errors import InputError, UsageError
from models.conditioning import Conditioned, condition_film

HEIGHT, WIDTH, COUNT, RATE = 180, 240, 40, 25.0
TIMES = np.arange(COUNT) / RATE
FLAG = (70, 50, 80, 56)
"""x, y, width and height of the flag at rest [px]."""


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """What a film shows.

    Attributes:
        shift: (COUNT, 2) by which the camera's motion moves the picture [px].
        flags: boxes of cloth at rest.
        leaves: whether a fine texture trembles in the lower quarter.
        scenery: whether the background has features.
        noise: of the camera [gray levels].
    """

    shift: FloatArray | None = None
    flags: tuple[tuple[int, int, int, int], ...] = (FLAG,)
    leaves: bool = False
    scenery: bool = True
    noise: float = 1.0

    def frames(self) -> UInt8Array:
        """(COUNT, HEIGHT, WIDTH) gray."""
        rng = stream(5, "drawn")
        pad = 12
        high, wide = HEIGHT + 2 * pad, WIDTH + 2 * pad
        base = np.full((high, wide), 150.0)
        if self.scenery:
            rough = rng.uniform(40, 220, (high // 12 + 1, wide // 12 + 1))
            base = np.asarray(
                cv2.resize(rough, (wide, high), interpolation=cv2.INTER_CUBIC), np.float64
            )
        texture = rng.normal(0, 45, (high // 4, wide + 8))
        out = []
        for k, time in enumerate(TIMES):
            picture = base.copy()
            if self.leaves:
                sway = np.repeat(rng.integers(0, 3, wide // 6 + 1), 6)[:wide]  # each twig by itself
                picture[-(high // 4) :] = 110 + texture[:, np.arange(wide) + sway]
            for number, (x, y, width, height) in enumerate(self.flags):
                _cloth(picture, x + pad, y + pad, width, height, time, phase=0.7 * number)
            dx, dy = (0.0, 0.0) if self.shift is None else self.shift[k]
            seen = cv2.warpAffine(
                picture,
                np.array([[1.0, 0.0, pad - dx], [0.0, 1.0, pad - dy]]),
                (WIDTH, HEIGHT),
                flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
            )
            out.append(seen + rng.normal(0, self.noise, seen.shape))
        return np.clip(np.rint(out), 0, 255).astype(np.uint8)


def _cloth(
    picture: FloatArray, x: int, y: int, width: int, height: int, time: float, *, phase: float
) -> None:
    """A striped cloth at its pole, whose waves grow towards the free edge."""
    along = np.arange(width)
    lift = (
        0.14
        * height
        * (along / width)
        * np.sin(2 * np.pi * (along / (0.6 * width) - 2.3 * time) + phase)
    )
    for column, offset in zip(along, lift, strict=True):
        top = y + round(float(offset))
        shade = 25 * np.cos(2 * np.pi * (column / (0.6 * width) - 2.3 * time) + phase)
        stripes = np.where((np.arange(height) // (height // 4)) % 2, 200.0, 50.0) + shade
        rows = np.arange(top, top + height)
        inside = (rows >= 0) & (rows < picture.shape[0])
        if 0 <= x + column < picture.shape[1]:
            picture[rows[inside], x + column] = stripes[inside]


def made(drawn: Drawn, **options: int) -> Conditioned:
    return condition_film(drawn.frames(), TIMES, size=120, **options)


def outside(found: Conditioned) -> BoolArray:
    return found.found.weight == 0


def swaying(amplitude: float) -> FloatArray:
    """A slow drift of the camera with a shake on it."""
    rng = stream(2, "sway")
    drift = np.stack([3 * amplitude * np.sin(2.1 * TIMES), amplitude * np.cos(1.7 * TIMES)], axis=1)
    return drift + rng.normal(0, amplitude / 3, drift.shape)


def test_the_places_of_a_moving_camera_are_recovered() -> None:
    shift = swaying(2.0)
    found = made(Drawn(shift=shift))
    assert found.found.camera.moves
    assert found.lost == 0
    moved = found.path - found.path.mean(axis=0)
    np.testing.assert_allclose(moved, shift - shift.mean(axis=0), atol=0.25)


def test_what_a_moving_camera_leaves_beside_the_flag_is_no_more_than_noise() -> None:
    steady, shaken = made(Drawn()), made(Drawn(shift=swaying(2.0)))
    beside = shaken.frames[:, outside(shaken)].astype(float).std(axis=0)
    still = steady.frames[:, outside(steady)].astype(float).std(axis=0)
    assert np.median(beside) < np.median(still) + 0.5


def test_a_still_camera_leaves_the_largest_square_of_each_frame_as_it_was_filmed() -> None:
    frames = Drawn().frames()
    found = condition_film(frames, TIMES, size=HEIGHT)
    assert not found.found.camera.moves
    cloth = found.found.weight == 1
    assert cloth.mean() > 0.15
    middle = (WIDTH - HEIGHT) // 2
    square = frames[:, :, middle : middle + HEIGHT]
    np.testing.assert_array_equal(found.frames[:, cloth], square[:, cloth])


def test_the_flag_is_found_among_trembling_leaves_and_they_are_frozen() -> None:
    drawn = Drawn(leaves=True)
    found = made(drawn)
    left, top, right, bottom = (edge / found.found.scale for edge in found.found.regions[0].box)
    x, y, width, height = FLAG
    assert abs(left - x) < 0.2 * width
    assert abs(right - (x + width)) < 0.2 * width
    assert y - 0.4 * height < top < y + 5
    assert bottom < y + 1.4 * height
    leaves = found.frames[:, outside(found)].astype(float).std(axis=0)
    assert np.quantile(leaves, 0.95) <= 2 * found.found.noise


def test_a_flag_hangs_at_the_side_where_it_moves_least() -> None:
    assert made(Drawn()).found.regions[0].hoist == "left"
    mirrored = condition_film(np.ascontiguousarray(Drawn().frames()[..., ::-1]), TIMES, size=120)
    assert mirrored.found.regions[0].hoist == "right"


def test_two_flags_are_numbered_by_their_motion_and_one_can_be_chosen() -> None:
    drawn = Drawn(flags=((20, 40, 80, 60), (160, 60, 48, 36)))
    first, second = made(drawn), made(drawn, flag=2)
    assert len(first.found.regions) == 2
    assert first.found.regions[0].share > first.found.regions[1].share
    assert first.found.square.x < second.found.square.x
    assert second.found.square.side < first.found.square.side
    # The other flag is frozen in either.
    assert (
        np.quantile(second.frames[:, outside(second)].astype(float).std(axis=0), 0.99)
        <= 2 * second.found.noise
    )
    with pytest.raises(UsageError, match="no flag 3: 2 regions"):
        made(drawn, flag=3)


def test_a_square_that_reaches_beyond_the_picture_is_padded_by_its_border() -> None:
    # A banner of nearly the picture's height needs a larger square than there is.
    found = made(Drawn(flags=((60, 4, 150, 140),), scenery=False))
    square = found.found.square
    assert square.side > HEIGHT
    assert square.beyond(WIDTH, HEIGHT) > 0
    assert found.frames.shape == (COUNT, 120, 120)
    assert found.frames.min() > 20  # no black


def test_a_cloth_that_fills_the_picture_is_never_the_background_of_its_own_motion() -> None:
    found = made(Drawn(flags=((-30, -30, 320, 260),), scenery=False))
    assert not found.found.camera.moves
    assert len(found.found.camera.corners) == 0


def test_a_background_without_features_leaves_the_camera_unknown() -> None:
    found = made(Drawn(scenery=False))
    assert len(found.found.camera.corners) == 0
    assert not found.found.camera.moves


def test_a_pole_before_a_plain_sky_shows_how_the_camera_moves() -> None:
    rng = stream(7, "pole")
    shift = np.cumsum(rng.normal(0, 0.5, (COUNT, 2)), axis=0) * [1.0, 0.0]
    frames = []
    for (dx, _), picture in zip(shift, Drawn(scenery=False, noise=0.0).frames(), strict=True):
        picture[30:, 63:67] = 230
        moved = cv2.warpAffine(
            picture,
            np.array([[1.0, 0.0, dx], [0.0, 1.0, 0.0]]),
            (WIDTH, HEIGHT),
            borderMode=cv2.BORDER_REPLICATE,
        )
        frames.append(moved)
    found = condition_film(np.stack(frames).astype(np.uint8), TIMES, size=120)
    assert found.found.camera.moves
    np.testing.assert_allclose(
        found.path[:, 0] - found.path[0, 0], shift[:, 0] - shift[0, 0], atol=0.3
    )


def test_a_single_straight_edge_shows_no_shift_along_it() -> None:
    rng = stream(8, "noise")
    frames = []
    for picture in Drawn(scenery=False, noise=0.0).frames():
        picture[30:, 63:67] = np.linspace(200, 230, HEIGHT - 30)[:, None]
        frames.append(np.clip(picture + rng.normal(0, 3, picture.shape), 0, 255).astype(np.uint8))
    found = condition_film(np.stack(frames), TIMES, size=120)
    assert found.found.camera.known
    assert not found.found.camera.moves


def test_nothing_moves_in_a_still_picture() -> None:
    found = made(Drawn(flags=()))
    assert found.found.regions == ()
    assert found.found.region is None


def test_the_same_film_gives_the_same_pictures() -> None:
    drawn = Drawn(shift=swaying(2.0), leaves=True)
    np.testing.assert_array_equal(made(drawn).frames, made(drawn).frames)


def test_a_film_of_two_frames_is_too_short() -> None:
    with pytest.raises(InputError, match="2 frames"):
        condition_film(Drawn().frames()[:2], TIMES[:2])


@pytest.mark.parametrize("shape", [(3, 1, 1), (5, 1, 5), (3, 8, 8), (4, 16, 400), (40, 2, 2)])
def test_films_of_any_shape_become_square_pictures(shape: tuple[int, int, int]) -> None:
    frames = stream(1, "shapes").integers(0, 255, shape).astype(np.uint8)
    assert condition_film(frames, np.arange(len(frames)) / RATE, size=60).frames.shape == (
        len(frames),
        60,
        60,
    )
