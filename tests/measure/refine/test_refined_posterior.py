"""The posterior against cases whose posterior is known."""

from __future__ import annotations

import numpy as np
from scipy.stats import binom, norm

from measure.refine import Metamodel, Space
from measure.refine.refined_posterior import CLOTHS, posterior, regressors
from sim.run import Recipe

SLOPES = np.array([[1.0, 0.0, 0.3], [2.0, 0.2, 0.0], [0.5, 4.0, 0.5], [0.0, 0.5, 2.0]])
NOISE = 0.2


def _rows(space: Space, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the prior and summaries of one clip of each."""
    points = space.prior(rng, count)
    return points, regressors(space.reported_quantities(points), space) @ SLOPES + rng.normal(
        0, NOISE, (count, 3)
    )


def test_with_many_evaluations_it_is_the_exact_posterior(recipe: Recipe) -> None:
    """Exact by brute force: 50,000 prior draws weighted by the true Gaussian likelihood."""
    space, rng = Space.of(recipe), np.random.default_rng(0)
    points, summaries = _rows(space, rng, 4000)
    _, observed = _rows(space, rng, 1)
    model = Metamodel.fit(
        regressors(space.reported_quantities(points), space), summaries, np.arange(4000)
    )
    found = posterior(space, [model], [observed[0]], seed=1, cloths=8000)
    drawn = space.reported_quantities(space.prior(rng, 50_000))
    weight = norm.logpdf(observed[0], regressors(drawn, space) @ SLOPES, NOISE).sum(axis=1)
    weight = np.exp(weight - weight.max())
    middle = weight @ drawn / weight.sum()
    spread = np.sqrt(weight @ np.square(drawn - middle) / weight.sum())
    reported = space.reported_quantities(found.points)
    # 4,000 draws know a mean to 0.016 standard deviations, and the model's slopes are known to a
    # few percent
    assert (np.abs(reported.mean(axis=0) - middle) < 0.12 * spread).all()
    np.testing.assert_allclose(reported.std(axis=0), spread, rtol=0.08)


def test_intervals_cover_as_often_as_they_say_after_few_evaluations(recipe: Recipe) -> None:
    """90 % intervals from 14 points with two replicates each, over 200 truths drawn from the
    prior."""
    space, rng = Space.of(recipe), np.random.default_rng(5)
    trials, inside = 200, np.zeros(5)
    for trial in range(trials):
        truth, observed = _rows(space, rng, 1)
        points = np.repeat(space.prior(rng, 14), 2, axis=0)
        known = regressors(space.reported_quantities(points), space)
        summaries = known @ SLOPES + rng.normal(0, NOISE, (28, 3))
        model = Metamodel.fit(known, summaries, np.repeat(np.arange(14), 2))
        found = posterior(
            space, [model], [observed[0]], seed=trial, cloths=300, winds=41, draws=1000
        )
        low, high = np.quantile(space.reported_quantities(found.points), [0.05, 0.95], axis=0)
        inside += (low <= space.reported_quantities(truth)[0]) & (
            space.reported_quantities(truth)[0] <= high
        )
    least, most = binom(trials, 0.9).ppf([0.0005, 0.9995])
    assert (inside >= least).all()
    assert (inside <= most).all()


def test_two_clips_of_one_cloth_constrain_it_more_than_one(recipe: Recipe) -> None:
    space, rng = Space.of(recipe), np.random.default_rng(6)
    points, summaries = _rows(space, rng, 2000)
    model = Metamodel.fit(
        regressors(space.reported_quantities(points), space), summaries, np.arange(2000)
    )
    truth = space.prior(rng, 1)
    several = np.repeat(truth, 8, axis=0)
    several[:, 16] = np.linspace(-0.7, 0.7, 8)
    observed = regressors(space.reported_quantities(several), space) @ SLOPES + rng.normal(
        0, NOISE, (8, 3)
    )
    one = posterior(space, [model], [observed[0]], seed=2, cloths=1000, winds=61)
    all_ = posterior(space, [model] * 8, list(observed), seed=2, cloths=1000, winds=61)
    spread = [space.reported_quantities(found.points)[:, 1].std() for found in (one, all_)]
    assert spread[1] < 0.8 * spread[0]
    # each wind is its own: the medians rise with the true winds
    assert (np.diff(np.median(all_.winds, axis=0)) > 0).mean() > 0.8


def test_uninformative_data_leave_the_prior(recipe: Recipe) -> None:
    space, rng = Space.of(recipe), np.random.default_rng(7)
    points, _ = _rows(space, rng, 2000)
    model = Metamodel.fit(
        regressors(space.reported_quantities(points), space),
        rng.normal(size=(2000, 2)),
        np.arange(2000),
    )
    found = posterior(space, [model], [np.zeros(2)], seed=3)
    reported = space.reported_quantities(found.points)
    prior = space.reported_quantities(space.prior(rng, 4000))
    np.testing.assert_allclose(reported.std(axis=0), prior.std(axis=0), rtol=0.1)
    assert found.effective > 0.75 * CLOTHS


def test_a_wind_that_the_network_gives_along_a_curve_is_found_from_few_evaluations(
    recipe: Recipe,
) -> None:
    """A response that no regressor has, flat in faint wind and at the range's end, as networks'
    are. Evaluations lie where refinements have them, about the wind that is asked for. Compared
    with an estimate that knows the curve: the noise over its slope, by the delta method."""
    space, rng = Space.of(recipe), np.random.default_rng(11)

    def response(points: np.ndarray) -> np.ndarray:
        share = (points[:, 16] + 1) / 2
        return (1 / (1 + np.exp(-6 * (share - 0.45))))[:, None] + rng.normal(
            0, 0.04, (len(points), 1)
        )

    errors, inside = [], 0
    for trial, share in enumerate(rng.uniform(0.15, 0.85, 60)):
        truth = space.prior(rng, 1)
        truth[:, 16] = 2 * share - 1
        points = np.repeat(space.prior(rng, 24), 2, axis=0)
        points[:, 16] = 2 * np.clip(share + np.repeat(rng.normal(0, 0.12, 24), 2), 0, 1) - 1
        known = regressors(space.reported_quantities(points), space)
        model = Metamodel.fit(known, response(points), np.repeat(np.arange(24), 2))
        found = posterior(
            space, [model], [response(truth)[0]], seed=trial, cloths=300, winds=61, draws=1000
        )
        slope = 6 * np.exp(-6 * (share - 0.45)) / (1 + np.exp(-6 * (share - 0.45))) ** 2
        low, middle, high = np.quantile(found.winds[:, 0], [0.05, 0.5, 0.95])
        span = space.wind.high - space.wind.low
        errors.append((middle - space.wind.low - span * share) / (span * 0.04 / slope))
        inside += low <= space.wind.low + span * share <= high
    assert np.sqrt(np.mean(np.square(errors))) < 1.4
    assert inside >= binom(60, 0.9).ppf(0.0005)


def test_no_regressor_runs_off_at_the_ends_of_the_wind(recipe: Recipe) -> None:
    """Evaluations at 0.001 of the range's ends lie among the others: with logits their leverage was
    0.8."""
    space = Space.of(recipe)
    points = space.prior(np.random.default_rng(12), 24)
    points[:2, 16] = -0.999, 0.999
    x = regressors(space.reported_quantities(points), space)
    x = np.concatenate([np.ones((24, 1)), x], axis=1)
    leverage = np.diag(x @ np.linalg.inv(x.T @ x) @ x.T)
    assert leverage.max() < 0.6


def test_the_same_seed_gives_the_same_draws(recipe: Recipe) -> None:
    space, rng = Space.of(recipe), np.random.default_rng(8)
    points, summaries = _rows(space, rng, 100)
    model = Metamodel.fit(
        regressors(space.reported_quantities(points), space), summaries, np.arange(100)
    )
    a, b, c = (
        posterior(space, [model], [summaries[0]], seed=seed, cloths=200, winds=21)
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(a.points, b.points)
    assert not np.array_equal(a.points, c.points)
