"""Powers of the damping by which sizes grow."""

from __future__ import annotations

import numpy as np
import pytest

from measure.loop.growth import power


@pytest.mark.parametrize("true", [-0.5, 0.1, 0.8])
def test_a_power_is_found_within_its_error(true: float) -> None:
    rng, worlds = np.random.default_rng(1), 200
    damping = rng.uniform(-2.0, 3.0, 40)
    about = damping - damping.mean()
    error = 0.2 / np.sqrt(about @ about)
    found = [power(np.exp(true * damping + 0.2 * rng.standard_normal(40)), damping) for _ in range(worlds)]
    # Taken back toward 0 by the share of the error in it: (error/true)², a tenth for the smallest.
    assert np.mean(found) == pytest.approx(true, abs=(error / abs(true)) ** 2 * abs(true) + 4 * error / worlds**0.5)
    assert np.std(found) < 1.3 * error


def test_chance_is_taken_for_none() -> None:
    """Of sizes that do not grow, the power is smaller than least squares' in the mean, and 0 in most of the draws."""
    rng = np.random.default_rng(2)
    damping = rng.uniform(-2.0, 3.0, 12)
    found = np.array([power(np.exp(rng.standard_normal(12)), damping) for _ in range(300)])
    assert (found == 0).mean() > 0.5
    plain = np.exp(0.0) / np.sqrt(((damping - damping.mean()) ** 2).sum())
    assert found.std() < 0.8 * plain


def test_no_power_is_told_of_one_damping_or_of_two_experiments() -> None:
    rng = np.random.default_rng(3)
    assert power(np.exp(rng.standard_normal(20)), np.zeros(20)) == 0.0
    assert power(np.array([1.0, 9.0]), np.array([0.0, 1.0])) == 0.0
