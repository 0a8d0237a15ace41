"""Scores against values worked by hand, and the interval's coverage against its promise."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.score import accuracy_within, rmse, score


def test_rmse_and_accuracy_by_hand() -> None:
    error = np.array([3.0, -4.0, 0.0, 0.5])
    assert rmse(error) == pytest.approx(np.sqrt(25.25 / 4))
    assert accuracy_within(0.5)(error) == 0.5


def test_the_interval_covers_the_true_value_as_often_as_it_says_when_clips_share_an_error() -> None:
    """Error = recording's share (σ 1) + clip's own (σ 0.5): true RMSE √1.25. 90 % intervals from 40 groups of 20.

    400 trials: ± 2.9 % at 2 σ; the percentile bootstrap undercovers by a few per cent at 40 groups (Davison and
    Hinkley 1997, section 5.3). Taking the 800 clips as independent would cover 33 %.
    """
    hits = 0
    group = [str(i) for i in np.repeat(np.arange(40), 20)]
    for trial in range(400):
        rng = stream(5, trial)
        error = np.repeat(rng.standard_normal(40), 20) + 0.5 * rng.standard_normal(800)
        result = score(error, np.zeros(800), group=group, rng=rng, resamples=200)
        hits += result.low <= np.sqrt(1.25) <= result.high
    assert 0.82 <= hits / 400 <= 0.95


def test_one_group_has_no_interval() -> None:
    with pytest.raises(InputError, match="two or more"):
        score([1.0, 2.0], [1.0, 1.0], group=["a", "a"], rng=stream(1))


def test_lengths_and_missing_values_are_checked() -> None:
    with pytest.raises(InputError):
        score([1.0], [1.0], group=["a", "b"], rng=stream(1))
    with pytest.raises(InputError):
        score([1.0, np.nan], [1.0, 1.0], group=["a", "b"], rng=stream(1))


def test_a_score_says_its_interval_and_what_it_rests_on() -> None:
    result = score([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], group=["a", "a", "b"], rng=stream(1))
    assert "90%" in str(result)
    assert "n = 3 in 2 groups" in str(result)
