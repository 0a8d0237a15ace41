"""Powers of the damping by which sizes grow."""

from __future__ import annotations

import numpy as np
import pytest

from measure.inference import power


@pytest.mark.parametrize("true", [-0.5, 0.1, 0.8])
def test_a_power_is_found_within_its_error(true: float) -> None:
    rng, worlds = np.random.default_rng(1), 200
    damping = rng.uniform(-2.0, 3.0, 40)
    about = damping - damping.mean()
    error = 0.2 / np.sqrt(about @ about)
    found = [
        power(np.exp(true * damping + 0.2 * rng.standard_normal(40)), damping)
        for _ in range(worlds)
    ]
    # Taken back toward 0 by the share that two errors have in it, (2 error/true)²: 0.2 for the
    # smallest.
    assert np.mean(found) == pytest.approx(
        true, abs=(2 * error / abs(true)) ** 2 * abs(true) + 4 * error / worlds**0.5
    )
    assert np.std(found) < 1.3 * error


def test_chance_is_taken_for_none() -> None:
    """Of sizes that do not grow, the power is 0 in nine draws of ten: beyond two errors of ten free
    ones, Student's t has 7 %."""
    rng = np.random.default_rng(2)
    damping = rng.uniform(-2.0, 3.0, 12)
    found = np.array([power(np.exp(rng.standard_normal(12)), damping) for _ in range(300)])
    assert (found == 0).mean() > 0.88


def test_one_damping_or_two_experiments_give_a_power_of_zero() -> None:
    rng = np.random.default_rng(3)
    assert power(np.exp(rng.standard_normal(20)), np.zeros(20)) == 0.0
    assert power(np.array([1.0, 9.0]), np.array([0.0, 1.0])) == 0.0
