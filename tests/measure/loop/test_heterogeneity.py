"""Cochran's Q against cases with known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import kstest, uniform

from flagdata.core.rng import stream
from measure.loop import estimate
from measure.loop.strength_estimates import heterogeneity


def test_of_two_it_is_the_test_of_their_difference() -> None:
    """(a - b)²/(σ² + τ²) is χ² of one: P(χ² > z²) = erfc(z/√2)."""
    z = (0.5 - 0.1) / math.hypot(0.1, 0.15)
    found = heterogeneity([estimate(0.5, 0.1, "rad"), estimate(0.1, 0.15, "rad")])
    assert found == pytest.approx(math.erfc(z / math.sqrt(2)))


def test_of_one_strength_it_is_uniform() -> None:
    rng = stream(1, "steady")
    errors = np.array([0.1, 0.3, 0.2])
    found = [
        heterogeneity([estimate(0.7 + e * rng.normal(), e, "1") for e in errors])
        for _ in range(500)
    ]
    assert kstest(found, uniform.cdf).pvalue > 0.01


def test_one_recording_gives_no_heterogeneity() -> None:
    assert heterogeneity([estimate(0.5, 0.1, "rad")]) is None
