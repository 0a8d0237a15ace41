"""Calibration on Gaussian posteriors in closed form: exact, overconfident and biased."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats

from flagdata.errors import InputError
from models.evaluation import LEVELS, Predictions, Resamples, coverage, rank_histogram, tarp
from models.evaluation.predictive_calibration import Cells, cells
from tests.models.evaluation.made import generator, of_wind, posterior

CLIPS = 4000
NOISE = 4 * 0.5 / np.sqrt(CLIPS)
"""Four standard deviations of a share of independent clips at most."""


def resamples_of(predictions: Predictions) -> Resamples:
    return Resamples.of(predictions.group, generator=generator(9), draws=100)


@pytest.mark.parametrize(
    ("wide", "shift"),
    [(1.0, 0.0), (0.5, 0.0), (1.0, 0.8)],
    ids=["calibrated", "overconfident", "biased"],
)
def test_central_intervals_cover_as_the_gaussian_says(wide: float, shift: float) -> None:
    """(θ - x/2)/σ is N(0, 1), the draws N(shift, wide²): a quantile z covers Φ(shift + wide z) -
    Φ(shift - wide z).

    With 400 draws their own quantiles are known to less than the noise of the clips."""
    made = posterior(clips=CLIPS, draws=400, wide=wide, shift=shift, targets=1, seed=1)
    for found in coverage((made,), "wind_speed", resamples_of(made)):
        z = stats.norm.ppf((1 + found.level) / 2)
        expected = stats.norm.cdf(shift + wide * z) - stats.norm.cdf(shift - wide * z)
        assert found.share.value == pytest.approx(expected, abs=NOISE)
        assert found.share.interval is not None
        assert found.share.interval[0] < found.share.value < found.share.interval[1]


def test_few_draws_do_not_bias_the_coverage_of_a_calibrated_model() -> None:
    """Between the least and the greatest of 4 draws lie only 3/5 of the truths, whatever the
    nominal level."""
    made = posterior(clips=CLIPS, draws=4, wide=1, shift=0, targets=1, seed=2)
    for found in coverage((made,), "wind_speed", resamples_of(made), levels=(0.1, *LEVELS)):
        assert found.share.value == pytest.approx(found.level, abs=NOISE)


def test_cells_by_hand() -> None:
    """Of three draws one is below 2 and one equal: the cell is [1/4, 3/4], which the central half
    holds whole."""
    found = Cells.of(np.array([2.0, 0.0]), np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]))
    np.testing.assert_allclose([found.low, found.high], [[0.25, 0.0], [0.75, 0.25]])
    np.testing.assert_allclose(found.central(0.5), [1.0, 0.0])
    np.testing.assert_allclose(found.central(0.8), [1.0, 0.6])  # [0.1, 0.9] holds 0.15 of the 0.25


def pit(predictions: Predictions, target: str) -> np.ndarray:
    """Probability integral transform (n,): the share of draws below the truth, at the middle of its
    cell."""
    found = cells(predictions, target)
    return (found.low + found.high) / 2


def test_pit_is_the_truths_quantile() -> None:
    draws = np.tile(stats.norm.ppf((np.arange(999) + 0.5) / 999), (3, 1))
    made = of_wind([-1.0, 0.0, 2.0], [0.0, 0.0, 0.0], samples=draws)
    np.testing.assert_allclose(pit(made, "wind_speed"), stats.norm.cdf([-1.0, 0.0, 2.0]), atol=1e-3)


def test_pit_of_a_calibrated_model_is_uniform_and_of_others_is_not() -> None:
    def p_value(wide: float, shift: float) -> float:
        made = posterior(clips=CLIPS, draws=400, wide=wide, shift=shift, targets=1, seed=3)
        return float(stats.kstest(pit(made, "wind_speed"), "uniform").pvalue)

    assert p_value(1, 0) > 0.01
    assert p_value(0.5, 0) < 1e-6
    assert p_value(1, 0.8) < 1e-6


def test_rank_histograms_are_flat_troughs_or_slopes() -> None:
    """Shares of ten bins: differences of Φ(shift + wide Φ⁻¹(edge)); the noise is four binomial
    deviations."""
    inner = stats.norm.ppf(np.linspace(0, 1, 11))
    for wide, shift, outside in ((1.0, 0.0, False), (0.5, 0.0, True), (1.0, 0.8, True)):
        made = posterior(clips=CLIPS, draws=199, wide=wide, shift=shift, targets=1, seed=4)
        found = rank_histogram((made,), "wind_speed")
        expected = np.diff(stats.norm.cdf(shift + wide * inner))
        np.testing.assert_allclose(found.share, expected, atol=4 * np.sqrt(expected.max() / CLIPS))
        assert sum(found.share) == pytest.approx(1)
        assert (found.outside > 1) == outside


def test_the_band_of_ranks_is_that_of_the_sequences_and_not_of_the_clips() -> None:
    made = posterior(clips=400, draws=9, wide=1, shift=0, targets=1, seed=5, group=4)
    found = rank_histogram((made,), "wind_speed", bins=5)
    low, high = stats.binom.interval(0.99, 100, 0.2)
    assert (found.groups, found.low, found.high) == (100, low / 100, high / 100)


def test_every_sequence_weighs_the_same_in_the_ranks() -> None:
    made = of_wind(
        [0.0, 0.0, 0.0, 9.0],
        np.zeros(4),
        group=[1, 1, 1, 2],
        samples=np.tile([1.0, 2.0, 3.0], (4, 1)),
    )
    assert rank_histogram((made,), "wind_speed", bins=2).share == (0.5, 0.5)


def test_tarp_is_the_nominal_level_for_the_exact_posterior_in_three_dimensions() -> None:
    made = posterior(clips=CLIPS, draws=100, wide=1, shift=0, targets=3, seed=6)
    for found in tarp((made,), resamples_of(made), generator=generator(7)):
        assert found.share.value == pytest.approx(found.level, abs=NOISE)


@pytest.mark.parametrize(
    ("wide", "shift"), [(0.4, 0.0), (1.0, 1.5)], ids=["overconfident", "biased"]
)
def test_tarp_agrees_with_quadrature_where_it_is_off(wide: float, shift: float) -> None:
    """Of a Gaussian the share nearer to the reference r than θ is known: the mass between r - d and
    r + d."""
    made = posterior(clips=CLIPS, draws=400, wide=wide, shift=shift, targets=1, seed=8)
    low, high = made.truth.min(), made.truth.max()
    sigma = np.sqrt(0.5)
    x, z, r = np.meshgrid(
        np.sqrt(2) * stats.norm.ppf((np.arange(60) + 0.5) / 60),  # what is seen, of variance 2
        stats.norm.ppf((np.arange(60) + 0.5) / 60),  # θ = x/2 + σ z
        low + (high - low) * (np.arange(60) + 0.5) / 60,
    )
    draws = stats.norm(x / 2 + shift * sigma, wide * sigma)
    distance = np.abs(x / 2 + sigma * z - r)
    nearer = draws.cdf(r + distance) - draws.cdf(r - distance)
    found = tarp(
        (made,), resamples_of(made), generator=generator(10), levels=(0.1, 0.3, 0.5, 0.7, 0.9)
    )
    expected = [float((nearer < point.level).mean()) for point in found]
    quadrature = 0.01  # of 60³ points
    assert [point.share.value for point in found] == pytest.approx(expected, abs=NOISE + quadrature)
    assert max(abs(value - point.level) for value, point in zip(expected, found, strict=True)) > 0.1


def test_a_model_without_samples_and_a_target_that_never_changes_are_refused() -> None:
    without = of_wind([1.0, 2.0], [1.0, 2.0])
    with pytest.raises(InputError, match="gives no samples"):
        coverage((without,), "wind_speed", resamples_of(without))
    constant = dataclasses.replace(
        posterior(clips=5, draws=3, wide=1, shift=0, targets=1, seed=1), truth=np.ones((5, 1))
    )
    with pytest.raises(InputError, match="wind_speed is the same in all clips"):
        tarp((constant,), resamples_of(constant), generator=generator(1))
