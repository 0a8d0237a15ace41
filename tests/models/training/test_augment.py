"""What happens to films before they are learned from: how much, where, and from streams of its
own."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from flagdata.core.arrays import Float32Array
from flagdata.errors import InputError, UnknownNameError
from models.training import Augment
from models.training.augment import DISTURBANCES, Strength
from models.training.augment.augment import AFTER, Film

SIDE, FRAMES = 96, 24
TIMES = np.arange(FRAMES) / 25
EVERYWHERE = np.ones((SIDE, SIDE), np.float32)
TRIED = {
    "tree": 2.0,
    "second-flag": 0.3,
    "shake": 1.5,
    "blur": 1.0,
    "gamma": 0.7,
    "dusk": 0.5,
    "noise": 3.0,
    "coding": 34.0,
    "left-over-shake": 1.0,
    "pole-sway": 2.0,
}
"""A strength of each."""


def still(seed: int = 0) -> Film:
    """A picture of blobs, always the same."""
    noise = np.random.default_rng(seed).standard_normal((SIDE, SIDE)).astype(np.float32)
    picture = cv2.GaussianBlur(noise, (0, 0), 3.0)
    picture = np.rint(128 + 40 * picture / picture.std()).clip(0, 255).astype(np.uint8)
    return np.repeat(picture[None], FRAMES, axis=0)


def disturbed(
    name: str, strength: float, *, source: str = "film", weight: Float32Array = EVERYWHERE
) -> Film:
    augment = Augment(strengths={name: Strength(share=1.0, low=strength, high=strength)})
    if name in AFTER:
        return augment.after(still(), TIMES, source=source, variant=0, weight=weight)
    return augment.before(still(), TIMES, source=source, other_film=lambda: 255 - still(1))


def test_every_disturbance_is_tried_here() -> None:
    assert set(TRIED) == set(DISTURBANCES)


@pytest.mark.parametrize("name", DISTURBANCES)
def test_a_film_is_disturbed_the_same_way_again_and_another_film_otherwise(name: str) -> None:
    once, again, other = (
        disturbed(name, TRIED[name], source=source) for source in ("film", "film", "another")
    )
    assert once.shape == (FRAMES, SIDE, SIDE)
    assert once.dtype == np.uint8
    assert (once == again).all()
    assert (once != still()).any()
    if name not in (
        "blur",
        "gamma",
        "dusk",
        "coding",
        "second-flag",
    ):  # these draw their strength alone, or a corner
        assert (once != other).any()


def test_a_share_of_the_films_is_disturbed() -> None:
    augment = Augment(strengths={"dusk": Strength(share=0.3, low=0.5, high=0.5)})
    changed = [
        (
            augment.before(still()[:1], TIMES[:1], source=str(k), other_film=still) != still()[:1]
        ).any()
        for k in range(200)
    ]
    assert np.mean(changed) == pytest.approx(
        0.3, abs=0.1
    )  # three standard deviations of a binomial share


def test_strengths_are_even_over_their_range() -> None:
    """Half of the light on average: gray levels of 0.2 to 0.8 of those before."""
    augment = Augment(strengths={"dusk": Strength(share=1.0, low=0.2, high=0.8)})
    film = np.full((1, 8, 8), 200, np.uint8)
    left = [
        float(augment.before(film, TIMES[:1], source=str(k), other_film=still).mean()) / 200
        for k in range(200)
    ]
    assert np.mean(left) == pytest.approx(0.5, abs=0.04)
    assert min(left) >= 0.19
    assert max(left) <= 0.81


@pytest.mark.parametrize("name", ["shake", "left-over-shake"])
def test_a_shake_moves_the_picture_by_its_root_mean_square(name: str) -> None:
    film = disturbed(name, 1.5).astype(np.float64)
    window = cv2.createHanningWindow((SIDE, SIDE), cv2.CV_64F)
    first = still()[0].astype(np.float64)
    path = np.array([cv2.phaseCorrelate(first, frame, window)[0] for frame in film])
    assert np.sqrt(np.square(path).mean(axis=0)) == pytest.approx(
        [1.5, 1.5], rel=0.15
    )  # a hand turns the camera too


def test_a_pole_sways_to_the_sides_and_what_is_frozen_stays() -> None:
    weight = EVERYWHERE.copy()
    weight[:, SIDE // 2 :] = 0.0
    film = disturbed("pole-sway", 3.0, weight=weight)
    assert (film[:, :, SIDE // 2 + 1 :] == still()[:, :, SIDE // 2 + 1 :]).all()
    top, bottom = (
        float(np.abs(film[:, rows].astype(int) - still()[:, rows]).mean())
        for rows in (slice(0, 20), slice(76, 96))
    )
    assert top > bottom > 0


def test_a_tone_curve_raises_gray_levels_to_a_power() -> None:
    assert (disturbed("gamma", 0.5) == np.rint(255 * (still() / 255) ** 0.5)).all()


def test_noise_has_its_standard_deviation() -> None:
    difference = disturbed("noise", 4.0).astype(int) - still()
    inside = (still() > 20) & (still() < 235)
    assert difference[inside].std() == pytest.approx(
        np.sqrt(16 + 1 / 12), rel=0.02
    )  # rounded to whole levels


def test_stronger_compression_loses_more() -> None:
    errors = [
        np.abs(disturbed("coding", crf).astype(int) - still()).mean() for crf in (20.0, 30.0, 40.0)
    ]
    assert errors == sorted(errors)
    assert errors[2] > 2 * errors[0]


def test_a_tree_and_a_second_flag_stay_at_the_rim() -> None:
    middle = slice(round(0.2 * SIDE), round(0.8 * SIDE))
    for source in map(str, range(8)):
        tree = disturbed("tree", 2.0, source=source)
        assert (tree[:, middle, middle] == still()[:, middle, middle]).all()
        assert (tree[1:] != tree[:-1]).any()
        flag = (disturbed("second-flag", 0.2, source=source) != still()).any(axis=0)
        corners = [
            flag[rows, columns]
            for rows in (slice(0, 19), slice(-19, None))
            for columns in (slice(0, 19), slice(-19, None))
        ]
        assert sum(corner.any() for corner in corners) == 1
        assert flag.sum() == max(corner.sum() for corner in corners)


def test_what_makes_no_disturbance_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'shake'"):
        Augment(strengths={"shaek": Strength(share=0.5, low=0.0, high=1.0)})
    for strength in (
        Strength(share=1.5, low=0.0, high=1.0),
        Strength(share=0.5, low=2.0, high=1.0),
        Strength(share=0.5, low=0.0, high=60.0),
    ):
        with pytest.raises(InputError, match="coding of a share"):
            Augment(strengths={"coding": strength})
