"""Ridge regression against the normal equations and laws it must find."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from tests.studies.yardsticks.ridge import PENALTIES, Ridge, fit_ridge


def table(seed: int, n: int, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    g = np.random.Generator(np.random.PCG64(seed))
    x = g.standard_normal((n, 6)) * [1, 10, 0.1, 1, 5, 1] + [0, 100, 0, -3, 0, 0]
    y = np.stack([3 + 2 * x[:, 0] - 0.1 * x[:, 1], 7 * x[:, 2]], axis=1)
    return x, y + noise * g.standard_normal(y.shape), np.arange(n) // 2


def test_a_linear_law_is_found() -> None:
    x, y, group = table(1, 200, 0.0)
    fresh, truth, _ = table(2, 50, 0.0)
    np.testing.assert_allclose(fit_ridge(x, y, group=group).predict(fresh), truth, atol=0.01)


def test_weights_solve_the_normal_equations_of_the_chosen_penalty() -> None:
    """(ZᵀZ + λn 1) w = Zᵀ(y − ȳ), of standardised features Z."""
    x, y, group = table(3, 60, 2.0)
    ridge = fit_ridge(x, y, group=group)
    z = (x - x.mean(axis=0)) / x.std(axis=0)
    for target in range(2):
        assert ridge.penalty[target] in PENALTIES
        system = z.T @ z + ridge.penalty[target] * len(x) * np.eye(6)
        expected = np.linalg.solve(system, z.T @ (y[:, target] - y[:, target].mean()))
        np.testing.assert_allclose(ridge.weights[:, target], expected, rtol=1e-8, atol=1e-12)


def test_targets_that_are_noise_are_shrunk_to_their_mean() -> None:
    """A weight of noise costs on sequences left out: the largest penalty wins, and little of the
    spread is left."""
    x, _, group = table(4, 80, 0.0)
    y = np.random.Generator(np.random.PCG64(5)).standard_normal((80, 1))
    ridge = fit_ridge(x, y, group=group)
    assert ridge.predict(x).std() < 0.2 * y.std()


def test_the_penalty_is_judged_on_sequences_not_on_clips() -> None:
    """Features by which a sequence is recognised predict its other clips, and nothing of sequences
    never seen.

    15 random numbers identify 20 sequences. By clips left out they are taken at full weight; by
    sequences, shrunk.
    """
    g = np.random.Generator(np.random.PCG64(6))
    sequence = np.repeat(np.arange(20), 10)
    x = g.standard_normal((20, 15))[sequence] + 0.01 * g.standard_normal((200, 15))
    y = g.standard_normal(20)[sequence][:, None]
    by_sequence = fit_ridge(x, y, group=sequence)
    by_clip = fit_ridge(x, y, group=np.arange(200))
    assert by_clip.penalty[0] < 0.1 < 1 <= by_sequence.penalty[0]


def test_a_constant_feature_has_no_weight() -> None:
    x, y, group = table(7, 60, 0.1)
    ridge = fit_ridge(np.concatenate([x, np.full((60, 1), 0.3)], axis=1), y, group=group)
    assert np.abs(ridge.weights[6]).max() == 0
    assert np.isfinite(ridge.predict(np.full((1, 7), 1.0))).all()


def test_it_is_the_same_after_storing() -> None:
    x, y, group = table(8, 40, 0.1)
    ridge = fit_ridge(x, y, group=group)
    np.testing.assert_array_equal(Ridge.of_arrays(ridge.arrays()).predict(x), ridge.predict(x))


def test_unfit_tables_are_errors() -> None:
    x, y, group = table(9, 20, 0.1)
    with pytest.raises(InputError, match="of the same clips"):
        fit_ridge(x, y[:-1], group=group)
    with pytest.raises(InputError, match="more sequences"):
        fit_ridge(x, y, group=np.zeros(20, dtype=np.int64))
    with pytest.raises(InputError, match=r"give \(n, 6\)"):
        fit_ridge(x, y, group=group).predict(x[:, :5])
    x[3, 2] = np.nan
    with pytest.raises(InputError, match="clip 3"):
        fit_ridge(x, y, group=group)
