"""Gradient boosting on laws whose conditional mean and quantiles are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from flagdata.errors import InputError
from tests.studies.yardsticks.boosting import Boosting, fit_boosting

LEVELS = (0.1, 0.5, 0.9)


def table(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A step and a deviation that depend on x: y = sign(x₀) + (0.2 + 0.3 [x₁ > 0]) ε, and its
    negative."""
    g = np.random.Generator(np.random.PCG64(seed))
    x = g.uniform(-1, 1, (n, 3))
    y = np.sign(x[:, 0]) + np.where(x[:, 1] > 0, 0.5, 0.2) * g.standard_normal(n)
    return x, np.stack([y, -y], axis=1)


@pytest.fixture(scope="module")
def boosting() -> Boosting:
    x, y = table(1, 6000)
    return fit_boosting(x, y, seed=3, rounds=40, rate=0.2, leaves=4, levels=LEVELS)


def test_the_mean_is_that_of_the_law(boosting: Boosting) -> None:
    """Away from the step; 0.1 is about a quarter of the noise's deviation."""
    x, _ = table(2, 400)
    x = x[np.abs(x[:, 0]) > 0.1]
    found = boosting.predict(x)
    assert found.shape == (len(x), 2)
    assert np.sqrt(np.square(found[:, 0] - np.sign(x[:, 0])).mean()) < 0.1
    assert np.sqrt(np.square(found[:, 1] + np.sign(x[:, 0])).mean()) < 0.1


def test_quantiles_widen_where_the_noise_does_and_cover(boosting: Boosting) -> None:
    """Of 4,000 clips 80 % lie between 10 and 90 %, within 0.05: the trees' own error beside
    chance's 0.006."""
    x, y = table(4, 4000)
    quantiles = boosting.predict_quantiles(x)
    assert quantiles.shape == (4000, 3, 2)
    assert (np.diff(quantiles, axis=1) >= 0).all()
    inside = (y > quantiles[:, 0]) & (y < quantiles[:, 2])
    assert inside.mean(axis=0) == pytest.approx([0.8, 0.8], abs=0.05)
    width = quantiles[:, 2, 0] - quantiles[:, 0, 0]
    noisy = x[:, 1] > 0
    expected = 2 * norm.ppf(0.9)
    assert np.median(width[noisy]) == pytest.approx(0.5 * expected, rel=0.2)
    assert np.median(width[~noisy]) == pytest.approx(0.2 * expected, rel=0.2)


def test_samples_have_the_fitted_quantiles(boosting: Boosting) -> None:
    x, _ = table(5, 20)
    samples, quantiles = boosting.samples(x, count=1001), boosting.predict_quantiles(x)
    assert samples.shape == (20, 1001, 2)
    assert samples.dtype == np.float32
    for level, row in zip(LEVELS, range(3), strict=True):
        np.testing.assert_allclose(
            np.quantile(samples, level, axis=1), quantiles[:, row], atol=0.01
        )


def test_equal_seeds_give_equal_trees() -> None:
    x, y = table(6, 100)
    first, second = (
        fit_boosting(x, y, seed=1, rounds=3, levels=LEVELS).predict(x) for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)


def test_unfit_arguments_are_errors(boosting: Boosting) -> None:
    x, y = table(7, 50)
    with pytest.raises(InputError, match="of the same clips"):
        fit_boosting(x, y[:-1], seed=0)
    with pytest.raises(InputError, match="ascending"):
        fit_boosting(x, y, seed=0, levels=(0.9, 0.1))
    with pytest.raises(InputError, match="at least 1 round"):
        fit_boosting(x, y, seed=0, rounds=0)
    with pytest.raises(InputError, match=r"give \(n, 3\)"):
        boosting.predict(x[:, :2])
    with pytest.raises(InputError, match="at least 1"):
        boosting.samples(x, count=0)
