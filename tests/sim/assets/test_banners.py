"""Prints as on national flags: their layouts, and how far their parts differ in gray."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from flagdata.core.rng import stream
from sim.assets import Assets
from sim.assets.banners import LAYOUTS, drawn, paint_layout

GRAY = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601
COLOURS = np.array([[0.9, 0.1, 0.1], [1.0, 1.0, 1.0], [0.1, 0.2, 0.6], [0.1, 0.1, 0.1]])


def grays(seed: int) -> np.ndarray:
    """(384, 576) of a banner, of 1."""
    return Assets().texture(f"banner/{seed}") @ GRAY / 255


def test_layouts_differ_and_show_all_their_colours() -> None:
    pictures = {name: paint_layout(name, COLOURS, stream(3, "layouts")) for name in LAYOUTS}
    for (one, first), (other, second) in combinations(pictures.items(), 2):
        assert (np.abs(first - second).max(axis=2) > 0.2).mean() > 0.02, (one, other)
    for name, picture in pictures.items():
        shown = [(np.abs(picture - colour).max(axis=2) < 0.01).mean() for colour in COLOURS]
        assert shown[0] > 0.1, name
        assert (sum(shown[1:]) > 0.02) == (name != "plain"), name
        assert sum(shown) > 0.9, name  # the rest are smooth edges


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_layout_draws_its_proportions_anew(name: str) -> None:
    one, other = (paint_layout(name, COLOURS, stream(seed, "proportions")) for seed in (1, 2))
    assert np.array_equal(one, paint_layout(name, COLOURS, stream(1, "proportions")))
    assert np.array_equal(one, other) == (name == "plain")


def test_all_layouts_are_drawn_and_the_contrast_reaches_none_and_full() -> None:
    found = [drawn(stream(seed, "banners")) for seed in range(1000)]
    layouts = [banner.layout for banner in found]
    assert layouts.count("plain") == pytest.approx(
        150, abs=57
    )  # five standard deviations of a binomial
    for name in LAYOUTS.keys() - {"plain"}:
        assert layouts.count(name) == pytest.approx(850 / 11, abs=43)
    contrasts = np.array([banner.contrast for banner in found])
    for end in (0.0, 1.0):
        assert (contrasts == end).sum() == pytest.approx(1000 * 0.15 / 1.3, abs=51)
    between = contrasts[(contrasts > 0) & (contrasts < 1)]
    assert np.histogram(between, bins=4, range=(0, 1))[0] == pytest.approx(
        np.full(4, between.size / 4), abs=60
    )


def test_parts_of_a_full_contrast_differ_from_their_field_in_gray_and_those_of_none_are_the_field() -> (
    None
):
    found = [drawn(stream(seed, "banners")) for seed in range(300)]
    apart = {
        end: np.array(
            [
                np.abs((one.colours[1:] - one.colours[0]) @ GRAY)
                for one in found
                if one.contrast == end
            ]
        )
        for end in (0.0, 1.0)
    }
    assert apart[0.0].max() == 0
    assert apart[1.0].min() >= 0.3
    assert apart[1.0].max() > 0.85  # black on white


def test_pictures_reach_from_one_colour_white_among_them_to_black_on_white() -> None:
    found = {seed: drawn(stream(seed, "assets", "banner")) for seed in range(300)}
    field = {seed: float(one.colours[0] @ GRAY) for seed, one in found.items()}
    one_colour = [seed for seed, one in found.items() if one.contrast == 0]
    white, dark = (
        grays(max(one_colour, key=field.__getitem__)),
        grays(min(one_colour, key=field.__getitem__)),
    )
    assert np.ptp(white) == np.ptp(dark) == 0
    assert white.min() > 0.95
    assert dark.max() < 0.1
    parted = [seed for seed, one in found.items() if one.layout == "quarters"]
    widest = max(parted, key=lambda seed: abs(float(found[seed].colours[1] @ GRAY) - field[seed]))
    assert np.ptp(grays(widest)) > 0.85
