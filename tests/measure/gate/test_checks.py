"""The image statistics: each fault is detected by its own, on made clips whose fault has a known
size."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from flagdata.errors import InputError
from measure.gate import ClipStatistics
from measure.gate.clip_statistics import SIDE
from tests.measure.gate.made import FRAMES, SIZE, background, film, value


@pytest.mark.parametrize("pixels", [1.0, 2.0, 4.0])
def test_the_shift_of_a_panning_camera_is_measured(pixels: float) -> None:
    """All frames but the first are moved by so many pixels; the tiles' windows and the noise take
    at most 0.2 px."""
    still = background(3)
    frames = np.stack(
        [
            still,
            *(ndimage.shift(still, (0, pixels), order=3, mode="wrap") for _ in range(FRAMES - 1)),
        ]
    )
    assert 10 ** value("shift", np.clip(frames, 0, 255).astype(np.uint8)) == pytest.approx(
        pixels, abs=0.2
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_camera_that_stands_still_has_no_shift(seed: int) -> None:
    assert 10 ** value("shift", film(seed=seed)) < 0.2
    assert value("around", film(seed=seed)) < 0.01


def test_a_camera_that_shakes_moves_all_edges() -> None:
    rng = np.random.default_rng(1)
    moved = [
        ndimage.shift(frame, rng.normal(0, 1.5, 2), order=1, mode="nearest") for frame in film()
    ]
    shaken = np.array(moved, dtype=np.uint8)
    assert value("edges-moving", shaken) > 0.9
    assert 10 ** value("sway", shaken) > 10 * 10 ** value("sway", film())


def test_held_frames_are_detected() -> None:
    clip = film()
    held = clip[(np.floor(np.arange(FRAMES) / 2.5) * 2.5).astype(int)]
    assert value("held", clip) > -0.5
    assert value("held", held) < -2
    assert value("uneven", held) > 5 * value("uneven", clip)


def test_a_loop_is_detected_and_a_periodic_flutter_with_noise_is_none() -> None:
    clip = film(noise=1.5)
    assert value("loop", clip[np.arange(FRAMES) % 9]) < -2
    assert value("loop", clip) > -1


def test_a_film_that_stands_still_at_its_end_is_detected() -> None:
    clip = film()
    assert value("stopped", clip[np.minimum(np.arange(FRAMES), 9)]) < -1
    assert abs(value("stopped", clip)) < 0.3


def test_motion_at_the_edge_is_that_of_a_flag_that_is_cut() -> None:
    assert value("at-edge", film()) == 0
    assert value("at-edge", film()[:, :, SIZE // 2 :]) > 0.2


def test_two_patches_are_two_regions_of_equal_motion() -> None:
    one, two = film(at=(0.24, 0.5)), film(at=(0.76, 0.5))
    both = np.concatenate([one[:, :, : SIZE // 2], two[:, :, SIZE // 2 :]], axis=2)
    assert value("second-region", one) == 0
    assert value("second-region", both) > 0.8
    assert value("scatter", both) == pytest.approx(0.5, abs=0.1)


def test_the_size_and_place_of_what_moves_are_measured() -> None:
    """The patch is 43 px wide and 29 px high of 112, and half a side away from the other's
    place."""
    clip = film(at=(0.3, 0.5))
    assert 10 ** value("area", clip) == pytest.approx(43 * 29 / SIZE**2, rel=0.1)
    assert value("width", clip) == pytest.approx(0.9 * 43 / SIZE, abs=0.05)
    assert value("height", clip) == pytest.approx(0.9 * 29 / SIZE, abs=0.05)
    assert value("off-centre", clip) == pytest.approx(0.2, abs=0.02)


def test_a_still_picture_with_noise_has_no_motion() -> None:
    rng = np.random.default_rng(2)
    still = np.clip(background() + rng.normal(0, 3, (FRAMES, SIZE, SIZE)), 0, 255).astype(np.uint8)
    assert 10 ** value("area", still) < 1e-3
    assert value("energy", still) < value("energy", film()) - 2


def test_under_exposure_is_detected_by_level_contrast_and_noise() -> None:
    clip = film()
    rng = np.random.default_rng(3)
    dark = np.clip(clip * 0.1 + rng.normal(0, 3, clip.shape), 0, 255).astype(np.uint8)
    assert value("level", dark) < 0.2 * value("level", clip)
    assert value("contrast", dark) == pytest.approx(value("contrast", clip) - 1, abs=0.15)
    assert value("noise", dark) > value("noise", clip) + 1


def test_a_picture_of_another_size_has_the_same_statistics() -> None:
    """But for the noise, which averaging takes away, and a pixel around the patch: 45·31/(43·29) is
    0.05 in log10."""
    clip = film(noise=0)
    doubled = clip.repeat(2, axis=1).repeat(2, axis=2)
    for name in ("level", "contrast", "area", "energy", "width", "off-centre", "loop"):
        assert value(name, doubled) == pytest.approx(value(name, clip), abs=0.06), name


def test_the_square_about_the_middle_is_looked_at() -> None:
    wide = np.concatenate([film()] * 3, axis=2)
    np.testing.assert_array_equal(ClipStatistics.of(wide).gray, ClipStatistics.of(film()).gray)
    assert ClipStatistics.of(wide).gray.shape == (FRAMES, SIDE, SIDE)


@pytest.mark.parametrize("shape", [(2, 64, 64), (10, 8, 64), (64, 64)])
def test_unfit_frames_are_errors(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="give uint8"):
        ClipStatistics.of(np.zeros(shape, dtype=np.uint8))
