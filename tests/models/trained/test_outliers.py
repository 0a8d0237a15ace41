"""Outliers: the covariance against scikit-learn's, the false-alarm rate against chance."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from models.trained.outliers import Familiarity, conformal_p, shrunk_covariance, whitening


def draws(seed: int, n: int, d: int = 5) -> np.ndarray:
    g = np.random.Generator(np.random.PCG64(seed))
    return g.standard_normal((n, d)) * np.arange(1, d + 1) + 3


@pytest.mark.parametrize(("n", "d"), [(8, 5), (40, 5), (6, 12)])
def test_the_covariance_is_that_of_ledoit_and_wolf(n: int, d: int) -> None:
    from sklearn.covariance import ledoit_wolf

    covariance, shrinkage = shrunk_covariance(draws(1, n, d))
    expected, amount = ledoit_wolf(draws(1, n, d))
    np.testing.assert_allclose(covariance, expected, rtol=1e-10)
    assert shrinkage == pytest.approx(amount)


def test_many_points_need_no_shrinkage_and_few_much() -> None:
    assert shrunk_covariance(draws(2, 20_000))[1] < 0.01
    assert shrunk_covariance(draws(2, 4))[1] > 0.1


def test_the_distance_is_mahalanobiss() -> None:
    """√((x − μ)ᵀ Σ*⁻¹ (x − μ)), by solving instead of whitening."""
    training, x = draws(3, 30), draws(4, 6)
    covariance, _ = shrunk_covariance(training)
    offset = x - training.mean(axis=0)
    expected = np.sqrt(np.einsum("nd,nd->n", offset, np.linalg.solve(covariance, offset.T).T))
    np.testing.assert_allclose(Familiarity.of(training, draws(5, 10)).distance(x), expected)


def test_whitened_points_have_no_covariance_but_unity_and_narrow_directions_are_widened_no_further() -> (
    None
):
    covariance, _ = shrunk_covariance(draws(15, 60))
    white = whitening(covariance, least=1e-9)
    np.testing.assert_allclose(white @ covariance @ white.T, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(whitening(np.diag([4.0, 0.0]), least=0.25) @ [2.0, 1.0], [2.0, 1.0])


def test_a_conformal_p_of_exchangeable_scores_is_uniform_on_its_steps() -> None:
    """Of 19 reference scores and one more, each rank is as likely: p = k/20 for each k once."""
    scores = draws(16, 20, 1)[:, 0]
    left_out = [float(conformal_p(np.sort(np.delete(scores, k)), scores[k])) for k in range(20)]
    np.testing.assert_allclose(sorted(left_out), np.arange(1, 21) / 20)


def test_false_alarms_are_as_rare_as_stated() -> None:
    """Familiar clips: of 20,000, the share beyond the threshold is Beta(e, n + 1 − e), e = ⌊α(n +
    1)⌋.

    With 999 validation clips and α = 0.05 its deviation is 0.0069; four of these are allowed.
    """
    familiarity = Familiarity.of(draws(6, 500), draws(7, 999))
    assert familiarity.unfamiliar(draws(8, 20_000), false_alarm=0.05).mean() == pytest.approx(
        0.05, abs=4 * 0.0069
    )


def test_unfamiliar_clips_are_detected() -> None:
    familiarity = Familiarity.of(draws(9, 500), draws(10, 999))
    away = draws(11, 200) + np.array([8.0, 0, 0, 0, 0])
    assert familiarity.unfamiliar(away, false_alarm=0.01).mean() > 0.95


def test_p_values_and_threshold_agree_also_at_ties() -> None:
    familiarity = Familiarity.of(draws(12, 50), draws(13, 99))
    for x in (draws(14, 300), draws(13, 99)):
        p = familiarity.p_value(x)
        assert (p >= 1 / 100).all()
        assert (p <= 1).all()
        for rate in (0.01, 0.05, 0.125, 0.5):
            np.testing.assert_array_equal(
                familiarity.unfamiliar(x, false_alarm=rate), p <= rate + 1e-12
            )


def test_p_counts_the_clips_at_least_as_far() -> None:
    """With reference distances 1, 2, 3: at 2 two are at least as far, p = 3/4; beyond all, 1/4; at
    the centre, 1."""
    familiarity = Familiarity(
        centre=np.zeros(1), whitening=np.eye(1), reference=np.array([1.0, 2.0, 3.0])
    )
    np.testing.assert_allclose(
        familiarity.p_value(np.array([[2.0], [-4.0], [0.0]])), [0.75, 0.25, 1.0]
    )
    assert familiarity.threshold(0.25) == 3.0
    assert familiarity.threshold(0.5) == 2.0


def test_a_summary_that_is_not_finite_is_unfamiliar() -> None:
    familiarity = Familiarity.of(draws(15, 50), draws(16, 99))
    broken = draws(17, 1)
    broken[0, 2] = np.nan
    assert familiarity.unfamiliar(broken, false_alarm=0.05).all()
    assert familiarity.p_value(broken)[0] == pytest.approx(1 / 100)


def test_it_is_the_same_after_storing() -> None:
    familiarity = Familiarity.of(draws(18, 50), draws(19, 20))
    again = Familiarity.of_arrays(familiarity.arrays())
    np.testing.assert_array_equal(again.p_value(draws(20, 10)), familiarity.p_value(draws(20, 10)))


def test_a_rate_too_low_for_the_validation_clips_is_an_error() -> None:
    familiarity = Familiarity.of(draws(21, 50), draws(22, 50))
    with pytest.raises(InputError, match="at least 99 clips"):
        familiarity.threshold(0.01)
    with pytest.raises(InputError, match="between 0 and 1"):
        familiarity.threshold(0.0)


def test_unfit_summaries_are_errors() -> None:
    with pytest.raises(InputError, match="all training summaries are equal"):
        Familiarity.of(np.ones((5, 3)), draws(1, 5, 3))
    with pytest.raises(InputError, match="at least 2 clips"):
        shrunk_covariance(np.ones((1, 3)))
    with pytest.raises(InputError, match=r"give \(n, 5\)"):
        Familiarity.of(draws(1, 9), draws(2, 9, 4))
    with pytest.raises(InputError, match="no validation summaries"):
        Familiarity.of(draws(1, 9), draws(2, 0))
