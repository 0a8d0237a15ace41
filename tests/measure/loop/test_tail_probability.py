"""Chances of statistics among groups of nulls that are alike within a kind of numerics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from measure.loop.tail_probability import TailProbability

LEVELS = (0.005, 0.02, 0.05, 0.5)


def drawn(rng: np.random.Generator, *, kinds: int, each: int) -> TailProbability:
    return TailProbability(null=np.repeat(rng.exponential(size=kinds), each), kinds=np.repeat(np.arange(kinds), each))


def test_few_kinds_of_numerics_make_no_null_rare() -> None:
    """400 groups of 40 kinds that are alike within a kind: a new draw beyond all is no event of 1 in 400, but in 41."""
    rng, worlds = np.random.default_rng(4), 4000
    found = np.array([drawn(rng, kinds=40, each=10).p(rng.exponential()) for _ in range(worlds)])
    for level in LEVELS:
        share = float(np.mean(found <= level))
        # Three standard errors; the threshold is a quantile of 40 draws, which is 0.1 but for a quarter.
        assert 0.6 * level < share + 3 * (level / worlds) ** 0.5
        assert share < 1.3 * level + 3 * (level / worlds) ** 0.5, level


@pytest.mark.parametrize("level", [0.01, 0.02, 0.05, 0.1, 0.3])
def test_beyond_the_critical_value_the_chance_is_at_most_the_level(level: float) -> None:
    tail = drawn(np.random.default_rng(1), kinds=60, each=5)
    critical = tail.critical(level)
    assert critical is not None
    assert tail.p(critical * 1.001) <= level < tail.p(critical * 0.98) + 1e-12


def test_of_nulls_1_to_99_those_beyond_70_are_the_highest_tenths_three() -> None:
    """p ≤ 0.3 allows 29 of 99 nulls at least as large, (1 + 29)/(1 + 99): the statistic has to exceed 70."""
    tail = TailProbability(null=np.arange(1.0, 100.0), kinds=np.arange(99))
    assert tail.critical(0.3) == 70.0
    assert tail.p(70.0) > 0.3 >= tail.p(70.5)


def test_too_few_groups_reject_nothing() -> None:
    tail = TailProbability(null=np.arange(1.0, 20.0), kinds=np.arange(19))
    assert tail.critical(0.04) is None
    assert tail.p(1e9) == 1 / 20
    critical = tail.critical(0.06)
    assert critical is not None
    assert math.isfinite(critical)


def test_the_interval_is_that_of_the_kinds_not_of_the_groups() -> None:
    """Of 40 kinds some number k reach the median: their share ± a binomial's spread, however many groups they make."""
    rng = np.random.default_rng(7)
    value = math.log(2)
    widths = []
    for each in (1, 10):
        tail = drawn(rng, kinds=40, each=each)
        share = float(np.mean(tail.null >= value))
        low, high = tail.interval(value, level=0.9)
        assert low < share + 1 / 40
        assert high > share
        widths.append(high - low)
        exact = np.ptp(binom.ppf([0.05, 0.95], 40, share)) / 40
        assert exact - 0.06 < high - low < exact + 0.06


def test_intervals_hold_the_chance_they_are_of() -> None:
    """Nine times of ten or so, at a value that one exponential draw in fifty exceeds."""
    rng, value, worlds = np.random.default_rng(5), math.log(50), 60
    held = 0
    for _ in range(worlds):
        low, high = drawn(rng, kinds=60, each=3).interval(value, level=0.9)
        held += low <= 0.02 <= high
    assert held / worlds > 0.75
