"""A wind from elsewhere: the difference's interval against its closed form, and the logarithmic law
against tables."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.answer.wind_elsewhere import OPEN_LAND, SUBURB, compare_winds, share_of_station
from flagdata.core.stated import Stated

DRAWS = 4.0 + 0.6 * np.random.default_rng(5).standard_normal(200_000)


@pytest.mark.parametrize(
    ("text", "agrees", "words"),
    [
        ("3±1", True, "agrees with 3±1 m/s"),
        ("2±0.1", False, "is above 2±0.1 m/s"),
        ("7", False, "is below 7 m/s"),
        ("3:5", True, "agrees with 3:5 m/s"),
    ],
)
def test_a_statement_is_compared_with_the_posterior(text: str, agrees: bool, words: str) -> None:
    comparison = compare_winds(DRAWS, Stated.of(text), is_bound=False, level=0.9, seed=1)
    assert comparison.agrees is agrees
    assert words in comparison.sentence


def test_the_interval_is_that_of_the_difference_of_two_normals() -> None:
    """N(4, 0.6²) − N(3, 1²) = N(1, 1.36); 90 % lie within 1.6449 of its deviations."""
    comparison = compare_winds(DRAWS, Stated.of("3±1"), is_bound=False, level=0.9, seed=1)
    half = 1.6449 * math.hypot(0.6, 1.0)
    assert comparison.difference == pytest.approx((1 - half, 1 + half), abs=0.02)


def test_a_film_that_only_bounds_the_wind_is_not_compared() -> None:
    comparison = compare_winds(DRAWS, Stated.of("3"), is_bound=True, level=0.9, seed=1)
    assert (comparison.agrees, comparison.difference) == (None, None)
    assert "only bounds the wind" in comparison.sentence


def test_the_share_of_a_stations_wind_follows_the_logarithmic_law() -> None:
    """ln(z / z₀) / ln(10 / z₀) in open land, whatever the blending height; 1 at the station
    itself."""
    assert share_of_station(10.0, OPEN_LAND) == pytest.approx(1.0)
    assert share_of_station(3.0, OPEN_LAND) == pytest.approx(math.log(100) / math.log(1000 / 3))
    assert share_of_station(3.0, SUBURB) == pytest.approx(
        math.log(3) / math.log(60) * math.log(2000) / math.log(1000 / 3)
    )
