"""Windows combined: against conjugate posteriors, and on problems whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import CorruptError, InputError
from measure.estimate import CARD_KEY, UNKNOWN, Dependence, combine_windows, of_model
from measure.estimate.combine import effective
from models.trained.estimator import Estimator

CLOTH = ("area_weight",)
BOTH = ("wind_speed", "area_weight")


def posterior(observed: float, noise: float, n: int, rng: np.random.Generator) -> FloatArray:
    """(n, 1) draws given one observation of variance `noise` under a standard normal prior."""
    variance = 1 / (1 + 1 / noise)
    return rng.normal(observed / noise * variance, np.sqrt(variance), size=(n, 1))


def cloth_of(logits: FloatArray, correlation: float, seed: int = 0) -> FloatArray:
    dependence = Dependence(wind=correlation, cloth=correlation, source="given")
    size = logits.shape[2]
    return combine_windows(
        logits,
        names=CLOTH[:size],
        centre=np.zeros(size),
        spread=np.ones(size),
        dependence=dependence,
        generator=stream(seed, "combine"),
    )[1]


def test_one_window_is_left_as_it_is() -> None:
    draws = stream(1, "one").normal(size=(1, 50, 2))
    wind, cloth = combine_windows(
        draws,
        names=BOTH,
        centre=np.zeros(2),
        spread=np.ones(2),
        dependence=Dependence(wind=0.3, cloth=0.3, source="given"),
        generator=stream(0, "combine"),
    )
    np.testing.assert_array_equal(wind[0, :, 0], draws[0, :, 0])
    np.testing.assert_array_equal(cloth[:, 0], draws[0, :, 1])


def test_independent_windows_give_the_conjugate_posterior() -> None:
    # Prior N(0, 1), four observations of variance 2: precision 1 + 4/2, mean Σ y/2 over that.
    rng = stream(2, "conjugate")
    observed = np.array([0.7, 1.1, -0.2, 0.9])
    draws = np.stack([posterior(y, 2.0, 40_000, rng) for y in observed])
    found = cloth_of(draws, 0.0)
    assert found.mean() == pytest.approx(observed.sum() / 2 / 3, abs=0.03)
    assert found.var() == pytest.approx(1 / 3, rel=0.05)


def test_windows_that_err_alike_are_worth_one() -> None:
    draws = posterior(0.8, 0.5, 40_000, stream(3, "alike"))
    found = cloth_of(np.stack([draws] * 6), 1.0)
    assert found.mean() == pytest.approx(draws.mean(), abs=0.01)
    assert found.var() == pytest.approx(draws.var(), rel=0.03)
    assert effective(6, 1.0) == 1
    assert effective(6, 0.0) == 6
    assert effective(1000, 0.25) == pytest.approx(4, rel=0.01)


def test_an_uninformative_window_changes_nothing() -> None:
    rng = stream(4, "nothing")
    narrow = posterior(1.0, 0.5, 40_000, rng)
    wide = rng.normal(0.0, 1.3, size=narrow.shape)  # wider than the prior
    alone, both = (
        cloth_of(np.stack([narrow, narrow]), 0.0),
        cloth_of(np.stack([narrow, narrow, wide]), 0.0),
    )
    assert both.mean() == pytest.approx(alone.mean(), abs=0.02)
    assert both.var() == pytest.approx(alone.var(), rel=0.05)


def test_windows_of_the_priors_width_keep_their_shape() -> None:
    # Half of the mass at either end, as the logits of a quantity whose range is too narrow have it.
    draws = np.where(stream(8, "shape").uniform(size=(4, 5000, 1)) < 0.5, -1.0, 1.0)
    found = cloth_of(draws, 0.5)
    assert np.abs(np.abs(found) - 1).max() < 0.1


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_intervals_cover_as_stated_when_errors_correlate_as_given(correlation: float) -> None:
    # 800 flags, five windows each, observed with noise of variance 1 that correlates between
    # windows.
    rng = stream(5, "coverage")
    problems, covered = 800, 0
    draws = np.empty((5, 300, 1))
    for number in range(problems):
        truth = rng.normal()
        noise = np.sqrt(correlation) * rng.normal() + np.sqrt(1 - correlation) * rng.normal(size=5)
        draws = np.stack([posterior(truth + e, 1.0, 300, rng) for e in noise])
        low, high = np.quantile(cloth_of(draws, correlation, seed=number), [0.05, 0.95])
        covered += bool(low <= truth <= high)
    # The binomial standard error is 0.011, and 300 draws place the ends to a hundredth.
    assert covered / problems == pytest.approx(0.9, abs=0.035)
    if correlation:
        ignored = cloth_of(draws, 0.0)
        assert ignored.var() < 0.7 * cloth_of(draws, correlation).var()


@pytest.mark.parametrize("correlation", [0.0, 0.6, 1.0])
def test_the_mean_of_winds_has_the_variance_of_correlated_estimates(correlation: float) -> None:
    rng = stream(6, "winds")
    draws = rng.normal(3.0, 1.0, size=(8, 20_000, 1))
    wind, cloth = combine_windows(
        draws,
        names=("wind_speed",),
        centre=np.zeros(1),
        spread=np.ones(1),
        dependence=Dependence(wind=correlation, cloth=0.0, source="given"),
        generator=stream(0, "combine"),
    )
    assert cloth.shape == (20_000, 0)
    mean = wind[..., 0].mean(axis=0)
    assert mean.mean() == pytest.approx(3.0, abs=0.02)
    assert mean.var() == pytest.approx(correlation + (1 - correlation) / 8, rel=0.05)


def test_a_wind_that_trades_with_the_cloth_follows_what_all_windows_say_of_the_cloth() -> None:
    # In each window wind = 2 + cloth + a little: once the cloth is known from all of them, so is
    # the wind.
    rng = stream(7, "trade")
    cloth = np.stack([posterior(1.0, 0.2, 20_000, rng) for _ in range(10)])
    wind = 2 + cloth + rng.normal(0, 0.05, size=cloth.shape)
    winds, shared = combine_windows(
        np.concatenate([wind, cloth], axis=2),
        names=BOTH,
        centre=np.zeros(2),
        spread=np.ones(2),
        dependence=Dependence(wind=0.0, cloth=0.0, source="given"),
        generator=stream(0, "combine"),
    )
    assert winds[0, :, 0].std() < 0.5 * wind[0].std()
    assert np.corrcoef(winds[0, :, 0], shared[:, 0])[0, 1] > 0.9
    assert winds.mean() == pytest.approx(2 + shared.mean(), abs=0.02)


def test_a_correlation_beyond_one_is_refused() -> None:
    with pytest.raises(InputError, match="0 to 1"):
        Dependence(wind=1.2, cloth=0.0, source="given")


def test_a_model_without_an_entry_has_windows_that_count_as_one(model: Estimator) -> None:
    assert of_model(model) is UNKNOWN
    assert UNKNOWN.cloth == UNKNOWN.wind == 1


def test_a_models_card_states_how_alike_its_windows_err(model: Estimator) -> None:
    entry = {"wind": 0.5, "cloth": 0.25, "source": "made"}
    stored = of_model(replace(model, card={**model.card, CARD_KEY: entry}))
    assert stored == Dependence(wind=0.5, cloth=0.25, source="made")
    for damaged in ({"wind": 3}, {**entry, "wind": 3}, [0.5]):
        with pytest.raises(CorruptError, match=f"the card's {CARD_KEY} cannot be used"):
            of_model(replace(model, card={**model.card, CARD_KEY: damaged}))
