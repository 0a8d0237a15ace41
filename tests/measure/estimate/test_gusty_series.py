"""A film's windows as one gusty series: its limits, against dense formulas, and on series drawn
from the model."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.stats import multivariate_normal

from flagdata.core.arrays import FloatArray
from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from flagdata.errors import CorruptError, InputError
from measure.estimate import SERIES_KEY, Gusts, Pair, SeriesErrors, errors_of_model
from measure.estimate.gusty_series import (
    Course,
    GustPrior,
    error_correlation,
    gust_covariance,
    log_moments,
)
from measure.measuring_model import network
from models.trained.estimator import Estimator
from models.trained.model_folder import CARD, card_bytes, read_card, renew

WINDOW = 1.2
ERRORS = SeriesErrors(
    opened=Pair(shared=0.8, own=0.5),
    stated=Pair(shared=0.6, own=0.55),
    halves=0.35,
    neighbours=0.1,
    source="made up for a test",
)


def course(
    logs: FloatArray,
    sigmas: FloatArray,
    *,
    pair: Pair = ERRORS.opened,
    prior: GustPrior | None = None,
    halves: float = 0.5,
    neighbours: float = 0.0,
    step: float = WINDOW,
) -> Course:
    starts = step * np.arange(len(logs))
    apart = range(0, len(logs), round(WINDOW / step))
    return Course(
        logs=logs,
        sigmas=sigmas,
        starts=starts,
        window=WINDOW,
        apart=apart,
        pair=pair,
        halves=halves,
        neighbours=neighbours,
        prior=GustPrior.standard() if prior is None else prior,
    )


def only(intensity: float, length: float) -> GustPrior:
    return GustPrior(intensity=np.array([intensity]), length=np.array([length]))


def test_with_gusts_of_any_strength_and_no_memory_each_window_stands_alone() -> None:
    logs, sigmas = np.log([4.0, 5.0, 3.0, 6.0]), np.array([0.2, 0.1, 0.3, 0.2])
    mean, covariance = course(logs, sigmas, prior=only(1e4, 1e-3)).given(1e4, 1e-3)
    shared = 0.8**2 * np.mean(sigmas**2)
    np.testing.assert_allclose(mean, logs, atol=1e-5)
    np.testing.assert_allclose(
        covariance, np.diag(0.5**2 * sigmas**2) + shared, rtol=1e-4, atol=1e-6
    )


def test_without_gusts_all_windows_have_one_wind_and_many_leave_the_shared_error_alone() -> None:
    rng = stream(1, "calm")
    logs, sigmas = np.log(5.0) + rng.normal(0, 0.05, 400), np.full(400, 0.1)
    mean, covariance = course(logs, sigmas, prior=only(0.0, 100.0)).given(0.0, 100.0)
    np.testing.assert_allclose(mean, logs.mean(), rtol=1e-9)
    np.testing.assert_allclose(covariance, (0.8 * 0.1) ** 2 + (0.5 * 0.1) ** 2 / 400, rtol=1e-6)


def test_the_posterior_is_that_of_a_dense_gaussian_with_a_wide_prior_of_the_mean() -> None:
    # All of it written out: (u, m) are jointly normal, μ of a standard deviation of 1,000 in place
    # of a flat prior.
    rng = stream(2, "dense")
    k, intensity, length = 7, 0.2, 90.0
    sigmas, logs = rng.uniform(0.1, 0.3, k), np.log(6.0) + rng.normal(0, 0.2, k)
    found = course(
        logs, sigmas, prior=only(intensity, length), halves=0.35, neighbours=0.1, step=0.6
    )
    mean, covariance = found.given(intensity, length)
    time = length / np.exp(logs.mean())
    gusts = np.empty((k, k))
    own = np.empty((k, k))
    grid = (np.arange(400) + 0.5) / 400 * WINDOW
    for i in range(k):
        for j in range(k):
            apart = 0.6 * abs(i - j)
            between = np.abs(grid[:, None] - grid[None, :] + apart)
            gusts[i, j] = intensity**2 * np.exp(-between / time).mean()
            correlation = {0: 1.0, 1: 0.35, 2: 0.1, 3: 0.05}.get(abs(i - j), 0.0)
            own[i, j] = 0.5**2 * sigmas[i] * sigmas[j] * correlation
    wind = gusts + 1000.0**2
    seen = wind + own + 0.8**2 * np.mean(sigmas**2)
    gain = np.linalg.solve(seen, wind).T
    np.testing.assert_allclose(mean, gain @ logs, atol=2e-4)
    np.testing.assert_allclose(covariance, wind - gain @ wind, atol=2e-4)


def test_points_of_the_grid_are_as_probable_as_contrasts_of_the_windows_make_them() -> None:
    # A flat mean leaves the differences of neighbours, whose density is a multivariate normal's.
    rng = stream(3, "grid")
    logs, sigmas = np.log(5.0) + rng.normal(0, 0.15, 6), rng.uniform(0.1, 0.2, 6)
    prior = GustPrior(intensity=np.array([0.02, 0.1, 0.3]), length=np.array([60.0, 200.0]))
    found = course(logs, sigmas, prior=prior)
    contrast = np.diff(np.eye(6), axis=0)
    own = np.diag(0.5**2 * sigmas**2)
    densities = []
    for intensity, length in found.points:
        time = length / np.exp(logs.mean())
        gusts = gust_covariance(found.starts, window=WINDOW, intensity=intensity, time=time)
        covariance = contrast @ (gusts + own) @ contrast.T
        densities.append(multivariate_normal(np.zeros(5), covariance).pdf(contrast @ logs))
    np.testing.assert_allclose(found.weights, np.array(densities) / np.sum(densities), rtol=1e-6)


@pytest.mark.parametrize("apart", [0.0, 0.5, 1.2, 7.0])
def test_gusts_are_averaged_over_windows(apart: float) -> None:
    found = gust_covariance(np.array([0.0, apart]), window=WINDOW, intensity=0.2, time=2.5)[0, 1]
    total, _ = dblquad(
        lambda s, t: np.exp(-abs(apart + s - t) / 2.5), 0, WINDOW, 0, WINDOW, epsabs=1e-7
    )
    assert found == pytest.approx(0.04 * total / WINDOW**2, rel=1e-5)


def test_own_errors_of_windows_that_overlap_are_alike_and_a_correlation() -> None:
    starts = np.arange(40) * 0.2
    correlation = error_correlation(starts, window=WINDOW, halves=0.35, neighbours=0.1)
    assert correlation[0, [0, 3, 6, 12]] == pytest.approx([1.0, 0.35, 0.1, 0.0])
    assert np.linalg.eigvalsh(correlation).min() > 0


def test_series_drawn_from_the_model_lie_in_their_intervals_as_often_as_these_say() -> None:
    rng = stream(4, "drawn")
    films, k = 120, 10
    prior = GustPrior.standard()
    in_windows, in_means, in_intensity = [], [], []
    for _ in range(films):
        intensity, length, centre = (
            rng.uniform(0, 0.5),
            rng.choice(prior.length),
            np.log(rng.uniform(4, 8)),
        )
        sigmas = np.full(k, 0.2)
        starts = WINDOW * np.arange(k)
        gusts = gust_covariance(
            starts, window=WINDOW, intensity=intensity, time=length / np.exp(centre)
        )
        true = centre + rng.multivariate_normal(np.zeros(k), gusts)
        logs = true + rng.normal(0, 0.8 * 0.2) + rng.normal(0, 0.5 * sigmas)
        winds, strengths = course(logs, sigmas).draws(400, rng)
        low, high = np.quantile(winds, [0.05, 0.95], axis=1)
        in_windows.append(np.mean((low <= np.exp(true)) & (np.exp(true) <= high)))
        ends = np.quantile(winds.mean(axis=0), [0.05, 0.95])
        in_means.append(ends[0] <= np.exp(true).mean() <= ends[1])
        ends = np.quantile(strengths, [0.05, 0.95])
        in_intensity.append(ends[0] <= intensity <= ends[1])
    slack = 3 * np.sqrt(
        0.9 * 0.1 / films
    )  # three binomial standard errors; windows of a film are not independent
    for share in (in_windows, in_means, in_intensity):
        assert np.mean(share) == pytest.approx(0.9, abs=slack)


def test_draws_have_the_moments_of_the_exact_posterior() -> None:
    logs, sigmas = np.log([4.0, 5.0, 4.5]), np.full(3, 0.2)
    found = course(logs, sigmas, prior=only(0.15, 80.0))
    mean, covariance = found.given(0.15, 80.0)
    winds, intensity = found.draws(40_000, stream(5, "moments"))
    np.testing.assert_allclose(
        np.log(winds).mean(axis=1), mean, atol=4 * np.sqrt(covariance.max() / 40_000)
    )
    np.testing.assert_allclose(np.cov(np.log(winds)), covariance, rtol=0.03)
    assert (intensity == 0.15).all()


def test_stronger_scatter_is_read_as_stronger_gusts() -> None:
    rng = stream(6, "scatter")
    normal = rng.normal(size=40)
    values = []
    for scatter in (0.02, 0.1, 0.3):
        strengths = course(np.log(6.0) + scatter * normal, np.full(40, 0.1)).draws(2000, rng)[1]
        values.append(Gusts.of(strengths, level=0.9, windows=40))
    assert values[0].intensity.value < values[1].intensity.value < values[2].intensity.value
    assert values[0].intensity.span.high < values[2].intensity.span.low
    assert values[0].sentence.startswith("gusts of ")


def test_an_intensity_as_wide_as_its_prior_has_no_value_in_words() -> None:
    even = Gusts.of(np.linspace(0, 0.5, 1001), level=0.9, windows=2)
    assert even.sentence == "gusts: 2 windows do not constrain how strong they are"
    assert not json_values(even)["constrained"]
    assert json_values(even)["interval"] == pytest.approx([0.025, 0.475])


def test_moments_are_those_of_a_log_normal_wind_and_draws_below_calm_air_are_borne() -> None:
    winds = stream(7, "log-normal").lognormal(1.5, 0.3, 400_000)
    assert log_moments(winds) == pytest.approx((1.5, 0.3), abs=3e-3)
    mean, sigma = log_moments(np.array([-0.01, 3.0, 5.0, 4.0]))
    assert np.exp(mean + sigma**2 / 2) == pytest.approx(11.99 / 4)
    with pytest.raises(InputError, match="above calm air"):
        log_moments(np.array([-1.0, 0.5]))


def test_a_larger_flag_counts_lengths_in_its_own() -> None:
    np.testing.assert_allclose(GustPrior.standard(size=2.0).length * 2, GustPrior.standard().length)


def test_a_card_states_the_errors_and_an_old_one_none(model: Estimator) -> None:
    assert errors_of_model(model) is None
    card = {**model.card, SERIES_KEY: ERRORS.entry()}
    assert errors_of_model(replace(model, card=card)) == ERRORS


@pytest.mark.parametrize(
    "change",
    [
        {"format": 2},
        {"open": {"shared": -1.0, "own": 0.5}},
        {"stated": None},
        {"halves": 0.9},
        {"neighbours": "much"},
    ],
)
def test_a_damaged_entry_is_refused_with_what_makes_it_anew(
    model: Estimator, change: dict[str, object]
) -> None:
    card = {**model.card, SERIES_KEY: {**ERRORS.entry(), **change}}
    with pytest.raises(CorruptError, match="series-errors"):
        errors_of_model(replace(model, card=card))


def test_a_card_that_states_the_errors_since_is_one_of_the_same_network(
    model_folder: Path, tmp_path: Path
) -> None:
    folder = tmp_path / model_folder.name
    shutil.copytree(model_folder, folder)
    before = network(str(folder), lake=None, at=None)
    card = {key: value for key, value in read_card(folder).items() if key != "format"}
    renew(folder, CARD, card_bytes({**card, SERIES_KEY: ERRORS.entry()}))
    after = network(str(folder), lake=None, at=None)
    assert after.identity == before.identity
    assert errors_of_model(after.estimator) == ERRORS
    renew(folder, CARD, card_bytes({**card, "seed": 2, SERIES_KEY: ERRORS.entry()}))
    assert network(str(folder), lake=None, at=None).identity != before.identity


def test_constants_that_no_errors_have_are_refused() -> None:
    with pytest.raises(InputError, match="above 0"):
        Pair(shared=0.5, own=0.0)
    with pytest.raises(InputError, match=r"from 0\.3 to 0\.6"):
        replace(ERRORS, halves=0.2, neighbours=0.2)
    with pytest.raises(InputError, match="two windows or more"):
        course(np.log([4.0]), np.array([0.1]))
