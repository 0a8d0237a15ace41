"""Crops: what is cut is where the crop states, mirrored where it states so."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from models.maps.crops import Crop, Cropping
from tests.refusals import unrefused

FILM = np.arange(20 * 30 * 40, dtype=np.uint32).reshape(20, 30, 40).astype(np.uint8)


def test_a_crop_of_the_networks_size_is_the_pixels_themselves() -> None:
    cropping = Cropping(frames=10, size=16)
    clip = cropping.cut(FILM, Crop(first=3, top=5, left=7, side=16, mirrored=False))
    assert clip.dtype == torch.uint8
    assert np.array_equal(clip[0].numpy(), FILM[3:13, 5:21, 7:23])


def test_a_mirrored_crop_has_left_and_right_exchanged() -> None:
    cropping = Cropping(frames=10, size=16)
    plain, mirrored = (
        cropping.cut(FILM, Crop(first=0, top=0, left=0, side=16, mirrored=mirrored))
        for mirrored in (False, True)
    )
    assert torch.equal(mirrored, plain.flip(3))


def test_resizing_keeps_the_mean_of_what_it_shrinks() -> None:
    film = np.random.default_rng(0).integers(0, 255, (10, 32, 32), dtype=np.uint8)
    clip = Cropping(frames=10, size=16).cut(
        film, Crop(first=0, top=0, left=0, side=32, mirrored=False)
    )
    assert clip.shape == (1, 10, 16, 16)
    assert clip.mean().item() == pytest.approx(film.mean(), rel=0.01)


def test_draws_stay_within_the_film_and_use_all_of_their_ranges() -> None:
    cropping = Cropping(frames=10, size=16, scales=(1.0, 0.6))
    rng = np.random.default_rng(1)
    crops = [cropping.draw(rng, (20, 30, 40)) for _ in range(400)]
    assert all(c.first + 10 <= 20 and c.top + c.side <= 30 and c.left + c.side <= 40 for c in crops)
    assert {c.first for c in crops} == set(range(11))
    assert {c.side for c in crops} == {30, 18}
    assert {c.mirrored for c in crops} == {False, True}


def test_the_plain_view_is_the_largest_square_about_the_middle() -> None:
    crop = Cropping(frames=10, size=16).whole((20, 30, 40), first=4)
    assert crop == Crop(first=4, top=0, left=5, side=30, mirrored=False)


def test_scales_that_cannot_be_are_refused() -> None:
    cases = [(), (0.0,), (1.2,)]
    assert not unrefused(lambda scales: Cropping(scales=scales), zip(cases), InputError)


def test_a_film_that_is_too_short_is_refused() -> None:
    with pytest.raises(InputError, match="at least 10"):
        Cropping(frames=10, size=16).draw(np.random.default_rng(0), (9, 30, 40))
    with pytest.raises(InputError, match="begin earlier"):
        Cropping(frames=10, size=16).whole((20, 30, 40), first=11)
