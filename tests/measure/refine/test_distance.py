"""Distances in the replicates' covariance, and the floor that replicates set."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from flagdata.errors import InputError
from measure.refine import squared_embedding_distance
from measure.refine.procedure import ReplicateMetric


def _groups(covariance: np.ndarray, count: int, replicates: int) -> list[np.ndarray]:
    rng = np.random.default_rng(4)
    factor = np.linalg.cholesky(covariance)
    middle = rng.normal(0, 10, (count, 1, len(covariance)))
    return list(middle + rng.normal(size=(count, replicates, len(covariance))) @ factor.T)


def test_the_floor_of_gaussian_replicates_is_twice_the_median_of_chi_squared() -> None:
    covariance = np.array([[4.0, 1.5, 0.0], [1.5, 1.0, 0.0], [0.0, 0.0, 0.01]])
    metric = ReplicateMetric.of(_groups(covariance, 3000, 2))
    # the difference of two draws has twice their covariance; 3,000 pairs know the median to 2 %,
    # and shrinkage is small
    assert metric.floor == pytest.approx(2 * chi2(3).median(), rel=0.06)


def test_the_metric_does_not_depend_on_where_the_points_are_but_on_their_replicates() -> None:
    groups = _groups(np.eye(2), 50, 3)
    moved = [group + 7.0 * place for place, group in enumerate(groups)]
    a, b = ReplicateMetric.of(groups), ReplicateMetric.of(moved)
    np.testing.assert_allclose(a.floor, b.floor, rtol=1e-6)


def test_directions_in_which_replicates_scatter_count_less() -> None:
    metric = ReplicateMetric.of(_groups(np.diag([100.0, 1.0]), 400, 2))
    along, across = metric.squared(np.array([[3.0, 0.0], [0.0, 3.0]]), np.zeros(2))
    assert across > 20 * along


def test_a_failed_simulation_is_infinitely_far() -> None:
    found = squared_embedding_distance(np.array([[1.0, 2.0], [np.nan, np.nan]]), np.zeros(2))
    assert found.tolist() == [5.0, np.inf]


def test_single_replicates_make_no_metric() -> None:
    with pytest.raises(InputError, match="two replicates"):
        ReplicateMetric.of([np.zeros((1, 2)), np.ones((1, 2))])
