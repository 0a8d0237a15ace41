"""The scale of the scores and the rate of false alarms."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.gate import level
from measure.gate.tail_probability import BODY, ExponentialTails
from models.trained.outliers import conformal_p


def test_one_more_surprise_is_e_times_rarer_in_an_exponential_tail() -> None:
    """Exponential scores of any scale: 20 % lie above 0, and 20 %/e above 1; 20,000 draws estimate
    it to 0.01."""
    rng = np.random.default_rng(1)
    scores = rng.exponential(1, (20_000, 2)) * np.array([0.3, 70]) + np.array([5, -2])
    surprise = ExponentialTails.of(scores, np.zeros(2)).surprise(scores)
    np.testing.assert_allclose((surprise > 0).mean(axis=0), 1 - BODY, atol=0.01)
    np.testing.assert_allclose((surprise > 1).mean(axis=0), (1 - BODY) / np.e, atol=0.01)


def test_a_score_that_is_always_the_same_is_measured_by_its_resolution() -> None:
    tails = ExponentialTails.of(np.zeros((50, 1)), np.array([0.25]))
    assert tails.surprise(np.array([0.5]))[0] == pytest.approx(2)


def test_p_counts_the_calibration_clips_with_at_least_as_much() -> None:
    """Of 1, 2, 3: at 2 two have at least as much, p = 3/4; beyond all 1/4; below all 1."""
    calibration = np.array([1.0, 2.0, 3.0])
    assert [conformal_p(calibration, score) for score in (2.0, 9.0, -1.0)] == [0.75, 0.25, 1.0]


@pytest.mark.parametrize("count", [99, 200])
def test_familiar_clips_are_refused_no_more_often_than_stated_with_the_stated_confidence(
    count: int,
) -> None:
    """Of 2,000 gates, calibrated on uniform scores, 10 % may refuse more; their number has a
    deviation of 13."""
    rng = np.random.default_rng(2)
    at = level(count, 0.05, 0.9)
    kept = np.sort(rng.random((2000, count)), axis=1)
    thresholds = kept[:, count - round(at * (count + 1))]
    rates = 1 - thresholds
    assert (rates > 0.05).mean() < 0.1 + 3 * 0.0067
    assert rates.mean() == pytest.approx(at, abs=0.002)


def test_more_calibration_clips_bring_the_level_nearer_to_the_rate() -> None:
    levels = [level(count, 0.05, 0.9) for count in (50, 200, 1000, 20_000)]
    assert levels == sorted(levels)
    assert levels[-1] == pytest.approx(0.05, abs=0.003)


def test_a_rate_too_low_for_the_calibration_clips_is_an_error() -> None:
    """No threshold above all of 44 clips keeps to 5 % with 90 %: 0.95⁴⁴ = 0.105; with 45 it does,
    0.95⁴⁵ = 0.099."""
    with pytest.raises(InputError, match="at least 45 clips"):
        level(44, 0.05, 0.9)
    assert level(45, 0.05, 0.9) == pytest.approx(1 / 46)
    with pytest.raises(InputError, match="between 0 and 1"):
        level(99, 1.0, 0.9)
    with pytest.raises(InputError, match="at least 20"):
        ExponentialTails.of(np.zeros((5, 1)), np.zeros(1))
