"""Scores of point estimates by hand and by scipy, and their intervals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from flagdata.core.json_values import json_values
from flagdata.errors import InputError
from models.evaluation import SCORES, Resamples, estimate
from models.evaluation.bootstrap import LEVEL
from models.evaluation.scores import error_against, rmse_bound
from tests.models.evaluation.made import generator, of_wind
from tests.refusals import unrefused

TRUTH = np.array([1.0, 2.0, 3.0, 6.0])
MEAN = np.array([1.5, 2.0, 2.0, 6.6])  # errors 0.5, 0, -1, 0.6


def test_scores_are_what_hand_calculation_gives() -> None:
    assert SCORES["rmse"](TRUTH, MEAN) == pytest.approx(math.sqrt((0.25 + 0 + 1 + 0.36) / 4))
    assert SCORES["accuracy"](TRUTH, MEAN) == 0.5  # an error of exactly 0.5 m/s is within
    assert SCORES["bias"](TRUTH, MEAN) == pytest.approx(0.1 / 4)
    assert SCORES["r_squared"](TRUTH, MEAN) == pytest.approx(
        1 - 1.61 / 14
    )  # Σ(y - 3)² = 4 + 1 + 0 + 9
    assert SCORES["relative_error"](TRUTH, MEAN) == pytest.approx(math.sqrt(1.61 / 14))


def test_pearson_agrees_with_scipy_far_from_zero_too() -> None:
    truth, mean = 1e4 + TRUTH, MEAN - 1e4
    assert SCORES["pearson"](truth, mean) == pytest.approx(
        stats.pearsonr(TRUTH, MEAN).statistic, rel=1e-9
    )


def test_a_correlation_with_a_constant_is_undefined() -> None:
    assert math.isnan(SCORES["pearson"](TRUTH, np.full(4, 0.1)))
    assert math.isnan(SCORES["r_squared"](np.full(4, 0.1), MEAN))


def test_no_errors_break_the_bound_and_errors_just_beyond_half_a_metre_per_second_reach_it() -> (
    None
):
    for seed, scale in enumerate((0.1, 0.5, 2.0)):
        errors = generator(seed).standard_t(2, size=400) * scale
        assert SCORES["rmse"](np.zeros(400), errors) >= rmse_bound(
            SCORES["accuracy"](np.zeros(400), errors)
        )
    extreme = np.array([0.0, 0.0, 0.0, 0.5 + 1e-9])
    assert SCORES["rmse"](np.zeros(4), extreme) == pytest.approx(rmse_bound(0.75), rel=1e-8)


def test_an_accuracy_that_is_no_share_is_refused() -> None:
    cases = [-0.1, 1.1, 83.8, math.nan]
    assert not unrefused(lambda accuracy: rmse_bound(accuracy), zip(cases), InputError)


def test_the_interval_of_a_mean_over_independent_clips_is_the_gaussian_one() -> None:
    """With 400 clips of deviation s the bias has σ = s/20; 20,000 draws leave its 5 % quantile a
    noise of 0.015 σ."""
    errors = stats.norm.ppf((np.arange(400) + 0.5) / 400)
    resamples = Resamples.of(np.arange(400), generator=generator(1), draws=20_000)
    found = estimate(
        SCORES["bias"].values(of_wind(np.zeros(400), errors), "wind_speed", resamples),
        name="bias",
        unit="m/s",
        clips=400,
        groups=400,
    )
    half = stats.norm.ppf((1 + LEVEL) / 2) * errors.std() / 20
    assert found.value == pytest.approx(0, abs=1e-12)
    assert found.interval == pytest.approx((-half, half), rel=0.04)  # 4 deviations of 0.015/1.645


def test_clips_that_are_copies_within_their_sequence_do_not_narrow_the_interval() -> None:
    errors = generator(2).normal(size=60)
    once = Resamples.of(np.arange(60), generator=generator(3))
    twelve = Resamples.of(np.repeat(np.arange(60), 12), generator=generator(3))
    single = SCORES["rmse"].values(of_wind(np.zeros(60), errors), "wind_speed", once)
    copies = of_wind(np.zeros(720), np.repeat(errors, 12), group=np.repeat(np.arange(60), 12))
    np.testing.assert_allclose(
        SCORES["rmse"].values(copies, "wind_speed", twelve), single, rtol=1e-12
    )


def test_a_draw_scores_as_the_clips_of_the_groups_it_holds_do() -> None:
    group = np.array([5, 5, 9, 9, 9, 7])
    truth, mean = generator(4).normal(size=(2, 6))
    resamples = Resamples.of(group, generator=generator(5), draws=30)
    place = [np.flatnonzero(group == label) for label in (5, 7, 9)]
    for name, score in SCORES.items():
        values = score.values(of_wind(truth, mean, group=group), "wind_speed", resamples)
        for count, value in zip(resamples.counts, values, strict=True):
            clips = np.concatenate([np.tile(place[g], int(count[g])) for g in range(3)])
            assert value == pytest.approx(
                score(truth[clips], mean[clips]), rel=1e-7, nan_ok=True
            ), name


def test_one_sequence_has_no_interval() -> None:
    resamples = Resamples.of(np.zeros(4, dtype=np.int64), generator=generator(1))
    found = estimate(
        SCORES["rmse"].values(of_wind(TRUTH, MEAN), "wind_speed", resamples),
        name="rmse",
        unit="m/s",
        clips=4,
        groups=1,
    )
    assert found.interval is None
    assert json_values(found)["interval"] is None
    assert found.quantity.text == "0.634 m/s, no interval"
    assert found.value == pytest.approx(math.sqrt(1.61 / 4))


def test_errors_against_wind_are_those_of_each_bin_and_its_upper_end_belongs_to_the_next() -> None:
    truth = np.array([0.0, 0.5, 1.0, 3.2, 4.0])
    predictions = of_wind(truth, truth + np.array([0.3, 0.4, -1.0, 0.2, 0.4]))
    bins = error_against(
        (predictions,), "wind_speed", Resamples.of(np.arange(5), generator=generator(1))
    )
    assert [(b.low, b.high, b.rmse.clips) for b in bins] == [
        (0, 1, 2),
        (1, 2, 1),
        (3, 4, 2),
    ]  # 4.0 ends the last bin
    assert [b.rmse.value for b in bins] == pytest.approx([math.sqrt(0.125), 1.0, math.sqrt(0.1)])
    assert [b.bias.value for b in bins] == pytest.approx([0.35, -1.0, 0.3])
    assert [b.rmse.interval is not None for b in bins] == [True, False, True]
