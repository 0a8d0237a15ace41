"""Optimisers on surfaces whose minimum is known."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import UnknownNameError
from tests.studies.validation.peers.registry import PEERS, minimise

PLACE = np.array([0.4, -0.3])


def _quadratic(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return 4 * np.square(points - PLACE).sum(axis=1), np.full(len(points), 0.25)


@pytest.mark.parametrize("method", list(PEERS))
def test_it_begins_at_the_centre_stays_in_the_box_and_depends_on_its_seed_alone(
    method: str,
) -> None:
    trace = minimise(method, _quadratic, dimension=2, budget=13, seed=1)
    assert len(trace) == 13
    np.testing.assert_array_equal(trace.points[0], [0.0, 0.0])
    assert np.abs(trace.points).max() <= 1
    again = minimise(method, _quadratic, dimension=2, budget=12, seed=1)
    np.testing.assert_array_equal(trace.points[:12], again.points)
    other = minimise(method, _quadratic, dimension=2, budget=4, seed=2)
    assert not np.array_equal(trace.points[:4], other.points)


def test_expected_improvement_finds_the_minimum_of_a_quadratic_within_sixteen_evaluations() -> None:
    trace = minimise("bayesian", _quadratic, dimension=2, budget=16, seed=3)
    # within 0.02 of it, where one of sixteen random points lies with a probability of 16 π 0.02²/4
    # = 0.5 %
    assert trace.distances[trace.best[-1]] < 4 * 0.02**2


def test_batched_expected_improvement_asks_for_several_different_points() -> None:
    trace = minimise("bayesian", _quadratic, dimension=2, budget=9, seed=3, batch=4)
    assert len(np.unique(trace.points[5:].round(6), axis=0)) == 4
    assert trace.distances.min() < 4 * 0.25**2


def test_a_trust_region_closes_in_on_the_minimum() -> None:
    trace = minimise("turbo", _quadratic, dimension=2, budget=22, seed=3)
    late = np.linalg.norm(trace.points[16:] - PLACE, axis=1)
    assert np.median(late) < 0.25
    assert trace.distances.min() < 4 * 0.1**2


@pytest.mark.parametrize("method", list(PEERS))
def test_failed_simulations_stop_no_optimiser(method: str) -> None:
    def failing(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, seconds = _quadratic(points)
        return np.where(points[:, 0] > 0.6, np.inf, values), seconds

    trace = minimise(method, failing, dimension=2, budget=14, seed=5)
    assert np.isfinite(trace.distances[trace.best[-1]])


def test_seconds_add_up_what_evaluations_took() -> None:
    trace = minimise("random", _quadratic, dimension=2, budget=8, seed=1)
    assert trace.seconds[-1] >= 8 * 0.25
    assert trace.incumbent(seconds=1.1) <= 3  # of the first four evaluations


def test_an_unknown_optimiser_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'turbo'"):
        minimise("turb", _quadratic, dimension=2, budget=2, seed=1)
