"""Scores, joint calibration and reasons, on drawn feature vectors whose law is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.gate import REASONS, Gate, level
from measure.gate.gate import SCORES, squash_tails
from tests.measure.gate.made import KINDS, distorted, learned, plain


@pytest.fixture(scope="module")
def gate() -> Gate:
    return learned(1)


def test_exchangeable_clips_are_refused_at_the_level(gate: Gate) -> None:
    """Given one calibration of 199, the rate at k/200 is Beta(k, 200 − k): three of its deviations
    are allowed."""
    largest = gate.surprises(plain(7, 4000)).max(axis=1)
    p = np.array([gate.p_value(one) for one in largest])
    for k in (10, 20, 100):
        deviation = np.sqrt(k * (200 - k) / 200**2 / 201)
        assert (p <= k / 200).mean() == pytest.approx(k / 200, abs=3 * deviation)


def test_the_stated_rate_of_all_checks_together_is_kept() -> None:
    """Over 40 gates of their own calibrations, each keeps to 5 % with 90 %: 4 may not, 9 or more
    have p = 0.02."""
    base = learned(2)
    fresh = base.surprises(plain(8, 4000)).max(axis=1)
    at, broken = level(199, 0.05, 0.9), 0
    for draw in range(40):
        own = replace(
            base, calibration=np.sort(base.surprises(plain(9000 + draw, 199)).max(axis=1))
        )
        broken += np.mean([own.p_value(one) <= at for one in fresh]) > 0.05
    assert broken <= 8


@pytest.mark.parametrize("kind", KINDS)
def test_a_known_distortion_is_refused_for_its_own_reason(gate: Gate, kind: str) -> None:
    surprises = gate.surprises(distorted(77, 60, kind))
    ratios = surprises[:, -len(KINDS) :]
    assert (surprises.max(axis=1) > gate.calibration[-6]).mean() > 0.8
    assert np.mean([KINDS[place] == kind for place in ratios.argmax(axis=1)]) > 0.8


def test_the_log_likelihood_ratio_is_that_of_linear_discriminant_analysis() -> None:
    """Against scikit-learn's, with as much shrinkage: of classes of one size the pooled covariances
    are the same."""
    from sklearn.covariance import ledoit_wolf
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

    clips, other = plain(3, 500), distorted(4, 300, "camera", strength=2.0)
    gate = Gate.of(clips, dict.fromkeys(KINDS, other), clips[:100])
    first, second, fresh = (
        squash_tails(x, gate.centre, gate.scale) for x in (clips[:300], other, plain(5, 200))
    )
    _, shrinkage = ledoit_wolf(
        np.concatenate([first - first.mean(axis=0), second - second.mean(axis=0)])
    )
    theirs = LinearDiscriminantAnalysis(solver="lsqr", shrinkage=shrinkage, priors=[0.5, 0.5])
    theirs.fit(np.concatenate([first, second]), np.repeat([0, 1], 300))
    np.testing.assert_allclose(
        gate.scores(plain(5, 200))[:, -1], theirs.decision_function(fresh), rtol=1e-6, atol=1e-6
    )


def test_every_score_has_a_reason_with_words() -> None:
    assert {score.reason for score in SCORES} <= REASONS.keys()
    assert len({(score.name, score.sign) for score in SCORES}) == len(SCORES)


def test_a_distortion_without_clips_is_an_error() -> None:
    made = {kind: distorted(1, 30, kind) for kind in KINDS if kind != "camera"}
    with pytest.raises(InputError, match="no clips of camera"):
        Gate.of(plain(1, 100), made, plain(2, 50))
