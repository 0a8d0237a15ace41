"""The score test on summaries whose law is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binomtest, kstest, norm

from flagdata.rng import stream
from measure.calibrate.prior import Floats
from measure.films.evidence import Experiments
from measure.films.score_test import ALIKE, Directions, Scored, score

SIZE, BASE, KINDS, EACH = 5, 400, 20, 8
MIXED = np.linalg.cholesky(0.6 * np.eye(SIZE) + 0.4)
"""Of summaries that are correlated, and of unlike size."""
UNITS = np.array([0.01, 1.0, 30.0, 0.2, 5.0])
ALONG = Directions(changes=np.array([[0.03, 0, 0, 0, 0], [0, 0, 60.0, 0, 0]]), signs=np.array([1, 0]))
MIDDLE, SIGMA = 0.2, 0.03


def law(weights: Floats) -> Floats:
    """Means of the summaries by the area weight."""
    away = np.log(weights / MIDDLE)[:, None]
    return UNITS * (np.arange(SIZE) + away * np.arange(1, SIZE + 1) - 0.5 * away**2)


def flags(rng: np.random.Generator, count: int, *, weight: float | None = None, sigma: float = SIGMA) -> Experiments:
    """Of the base model."""
    weights = np.exp(rng.uniform(np.log(0.05), np.log(0.45), count)) if weight is None else np.full(count, weight)
    noise = rng.standard_normal((count, SIZE)) @ MIXED.T * UNITS
    stated = weights * np.exp(sigma * rng.standard_normal(count))
    return Experiments(summaries=(law(weights) + noise,), stated=stated, sigma=sigma)


def moved(one: Experiments, by: Floats) -> Experiments:
    return replace(one, summaries=tuple(own + by for own in one.summaries))


def kinds() -> NDArray[np.int64]:
    return np.repeat(np.arange(KINDS), EACH)


def judged(own: Experiments, *, seed: int = 1, along: Directions = ALONG, shift: Floats | None = None) -> Scored:
    """By the same base flags and null flags.

    Args:
        shift: (null, k) of the null flags.
    """
    rng = stream(seed, "score test")
    base, null = flags(rng, BASE), flags(rng, KINDS * EACH)
    null = null if shift is None else moved(null, shift)
    return score(own, base, null, kinds(), along, level=0.05)


def row(several: Experiments, place: int) -> Experiments:
    assert several.stated is not None
    return replace(
        several, summaries=tuple(own[place : place + 1] for own in several.summaries),
        stated=several.stated[place : place + 1],
    )  # fmt: skip


def test_z_is_standard_normal_where_the_base_model_holds() -> None:
    many = flags(stream(7, "own"), 300, weight=MIDDLE)
    found = np.array([judged(row(many, place)).z for place in range(300)])
    for place in range(2):
        # 160 null flags and 560 flags of V: the deviations are known to some 6 %, and the middle to a twelfth.
        assert kstest(found[:, place], norm(0, 1).cdf).pvalue > 1e-3
        assert found[:, place].std() == pytest.approx(1.0, abs=0.15)
