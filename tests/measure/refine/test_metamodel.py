"""The regression's predictive density, against theory."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import kstest, multivariate_t, norm

from flagdata.errors import InputError
from measure.refine import Metamodel


def test_the_density_integrates_to_one() -> None:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(12, 2))
    y = x @ np.array([[1.0], [-0.5]]) + rng.normal(size=(12, 1))
    model = Metamodel.fit(x, y, np.arange(12))
    grid = np.linspace(-60, 60, 24_001)
    density = np.exp(model.log_density(np.tile([[0.3, 1.0]], (len(grid), 1)), grid[:, None]))
    assert trapezoid(density, grid) == pytest.approx(1.0, abs=2e-4)


def test_the_density_of_a_mean_alone_is_students() -> None:
    """Without slopes, n normal draws give a new one t_{n−1} about their mean, of scale s √(1 +
    1/n)."""
    rng = np.random.default_rng(1)
    y = rng.normal(2.0, 3.0, (9, 1))
    model = Metamodel.fit(np.zeros((9, 0)), y, np.arange(9))
    expected = multivariate_t([y.mean()], [[y.var(ddof=1) * (1 + 1 / 9)]], df=8).logpdf([4.0])
    assert model.log_density(np.zeros((1, 0)), np.array([4.0]))[0] == pytest.approx(float(expected))


def test_new_rows_fall_into_the_predictive_distribution_as_often_as_it_says() -> None:
    """The probability integral transform of a new row is uniform, however few rows the model is
    from."""
    rng = np.random.default_rng(2)
    levels = []
    for _ in range(300):
        x, new = rng.normal(size=(11, 2)), rng.normal(size=(1, 2))
        slope = rng.normal(size=(2, 1))
        y, value = x @ slope + rng.normal(size=(11, 1)), new @ slope + rng.normal(size=(1, 1))
        model = Metamodel.fit(x, y, np.arange(11))
        grid = value[0, 0] + np.linspace(-40, 40, 2001)
        density = np.exp(model.log_density(np.repeat(new, len(grid), axis=0), grid[:, None]))
        levels.append(density[grid <= value[0, 0]].sum() / density.sum())
    assert kstest(levels, "uniform").pvalue > 0.01


def test_replicates_that_share_their_deviation_count_as_one() -> None:
    rng = np.random.default_rng(3)
    x = np.repeat(rng.normal(size=(200, 1)), 2, axis=0)
    shared = np.repeat(rng.normal(size=(200, 2)), 2, axis=0)
    model = Metamodel.fit(
        x,
        x @ np.ones((1, 2)) + shared + 1e-3 * rng.normal(size=(400, 2)),
        np.repeat(np.arange(200), 2),
    )
    assert model.correlation == pytest.approx(1.0, abs=0.02)
    assert model.rows == pytest.approx(200, rel=0.02)


def test_replicates_that_share_nothing_count_each() -> None:
    rng = np.random.default_rng(3)
    x = np.repeat(rng.normal(size=(300, 1)), 2, axis=0)
    model = Metamodel.fit(x, rng.normal(size=(600, 2)), np.repeat(np.arange(300), 2))
    # the correlation of 300 pairs in 2 directions is known to 1/√600; 4 of them
    assert model.correlation < 4 / np.sqrt(600)


def test_too_few_rows_are_refused() -> None:
    with pytest.raises(InputError, match="evaluations"):
        Metamodel.fit(np.zeros((4, 2)), norm.rvs(size=(4, 2), random_state=0), np.arange(4))
