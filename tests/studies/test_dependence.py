"""How alike windows err: recovered from problems with a known correlation, and written into a
model's card."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.rng import stream
from measure.estimate import CARD_KEY, of_model
from models.trained import estimator
from tests.studies.dependence import Errors, card_entry, errors_of


def simulated(correlation: float, *, noise: float, films: int = 4000) -> Errors:
    """Two windows of each film that observe wind and density under a standard normal prior."""
    rng = stream(1, "films")
    truth = rng.normal(size=(films, 2))
    common = rng.normal(size=(films, 1, 2))
    own = rng.normal(size=(films, 2, 2))
    observed = truth[:, None] + np.sqrt(noise) * (
        np.sqrt(correlation) * common + np.sqrt(1 - correlation) * own
    )
    variance = 1 / (1 + 1 / noise)
    # Two draws with the mean and the variance of the posterior.
    draws = (observed / noise * variance)[:, :, None] + np.sqrt(variance) * np.array([-1.0, 1.0])[
        :, None
    ]
    names = ("wind_speed", "area_weight")
    found = errors_of(draws, truth, names)
    return Errors(names=names, values=found)


@pytest.mark.parametrize("noise", [0.1, 20.0])
@pytest.mark.parametrize("correlation", [0.0, 0.7])
def test_the_correlation_of_likelihoods_is_found_whether_they_are_narrow_or_wide(
    correlation: float, noise: float
) -> None:
    value, upper = simulated(correlation, noise=noise).correlation("area_weight")
    assert value == pytest.approx(correlation, abs=0.04)
    assert value <= upper <= value + 0.05


def test_the_winds_errors_count_with_what_the_prior_has_in_common() -> None:
    # With noise ≫ 1 both posteriors are the prior, whose error is the same in both.
    assert simulated(0.0, noise=50.0).correlation("wind_speed")[0] > 0.9
    assert simulated(0.0, noise=0.01).correlation("wind_speed")[0] < 0.1


def test_a_window_as_wide_as_the_prior_has_no_score() -> None:
    draws = np.array([-1.5, 1.5])[None, None, :, None]
    assert errors_of(draws, np.array([[0.4]]), ("area_weight",))[0, 0, 0] == 0


def test_the_cards_entry_is_what_was_measured() -> None:
    model, found = estimator.load_shipped(), simulated(0.5, noise=1.0)
    entry = card_entry(found)
    stored = of_model(replace(model, card={**model.card, CARD_KEY: entry}))
    assert stored == found.dependence()
    assert stored.cloth >= entry["targets"]["area_weight"]["correlation"]
