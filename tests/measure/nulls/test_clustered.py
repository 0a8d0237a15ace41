"""p-values of statistics among null flags that are alike within a kind of numerics to some
degree."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom, binomtest, kstest, t

from measure.nulls import ClusteredNulls

KINDS, EACH = 20, 8
WORLDS = 2000


def world(
    rng: np.random.Generator, *, correlation: float, heavy: bool = False
) -> tuple[ClusteredNulls, float]:
    """Nulls of an intraclass correlation; and the statistic of a flag of one kind more.

    Args:
        heavy: whether the statistic has heavy tails.
    """
    kinds = np.repeat(np.arange(KINDS), EACH)
    level = math.sqrt(correlation) * rng.standard_normal(KINDS + 1)
    own = math.sqrt(1 - correlation) * rng.standard_normal(KINDS * EACH + 1)
    values = np.append(level[kinds], level[-1]) + own
    values = np.sinh(1.5 * values) if heavy else values
    return ClusteredNulls(null=values[:-1], kinds=kinds), float(values[-1])


@pytest.mark.parametrize("heavy", [False, True])
@pytest.mark.parametrize("correlation", [0.0, 0.2, 0.5, 1.0])
def test_flags_of_the_base_model_are_rejected_at_the_level_however_alike_kinds_are(
    correlation: float, heavy: bool
) -> None:
    """In 2,000 worlds; p is uniform but for the steps of one flag, or of one kind, and 0.01 of what
    ρ errs."""
    rng = np.random.default_rng(4)
    both = [world(rng, correlation=correlation, heavy=heavy) for _ in range(WORLDS)]
    found = np.array([nulls.p(value) for nulls, value in both])
    step = 1 / (1 + np.mean([nulls.effective for nulls, _ in both]))
    for level in (0.05, 0.1, 0.3, 0.5, 0.9):
        share = float((found <= level).mean())
        error = 3 * math.sqrt(level * (1 - level) / WORLDS)
        assert share <= level + error + 0.01, level
        assert share >= level - step - error - 0.01, level


def test_the_correlation_is_that_of_the_world_and_not_below_none() -> None:
    rng = np.random.default_rng(5)
    for correlation in (0.0, 0.3, 0.8):
        found = [
            world(rng, correlation=correlation, heavy=heavy)[0]
            for heavy in (False, True)
            for _ in range(200)
        ]
        assert np.mean([one.correlation for one in found]) == pytest.approx(correlation, abs=0.05)
        assert min(one.correlation for one in found) >= 0
        assert all(KINDS <= one.effective <= KINDS * EACH for one in found)


def test_flags_that_are_unlike_count_one_by_one_and_those_that_are_alike_as_their_kind() -> None:
    kinds = np.repeat(np.arange(KINDS), EACH)
    same = ClusteredNulls(null=np.arange(float(KINDS))[kinds], kinds=kinds)
    assert same.correlation == 1.0
    assert same.effective == pytest.approx(KINDS)
    assert same.p(18.5) == pytest.approx((1 + 1) / (1 + KINDS))
    # Each kind has one flag of each size, so that kinds differ less than by chance.
    spread = ClusteredNulls(
        null=np.arange(float(KINDS * EACH)), kinds=np.tile(np.arange(KINDS), EACH)
    )
    assert spread.correlation == 0.0
    assert spread.p(KINDS * EACH - 3.0) == pytest.approx((1 + 3) / (1 + KINDS * EACH))
    single = ClusteredNulls(null=np.arange(float(KINDS)), kinds=np.arange(KINDS))
    assert single.effective == KINDS


def test_one_kind_shows_nothing() -> None:
    one = ClusteredNulls(null=np.arange(8.0), kinds=np.zeros(8, dtype=np.int64))
    assert one.effective == 1.0
    assert not one.tests(0.3)
    assert one.critical(0.3) is None


@pytest.mark.parametrize("level", [0.05, 0.1, 0.3])
def test_beyond_the_critical_value_p_is_at_most_the_level(level: float) -> None:
    nulls, _ = world(np.random.default_rng(1), correlation=0.2)
    critical = nulls.critical(level)
    assert critical is not None
    assert nulls.p(np.nextafter(critical, math.inf)) <= level < nulls.p(critical)


def test_a_level_wants_so_many_kinds_as_alike_as_these() -> None:
    kinds = np.repeat(np.arange(4), 2)
    few = ClusteredNulls(null=np.arange(8.0), kinds=kinds)
    assert not few.tests(0.05)
    assert few.p(math.inf) == few.least > 0.05
    needed = few.kinds_needed(0.05)
    each = few.effective / few.count
    assert 1 / (1 + needed * each) <= 0.05 < 1 / (1 + (needed - 1) * each)


def test_the_tail_is_uniform_where_the_statistic_is_normal() -> None:
    rng = np.random.default_rng(3)
    found = [
        nulls.tail(value) for nulls, value in (world(rng, correlation=0.0) for _ in range(WORLDS))
    ]
    assert kstest(found, "uniform").pvalue > 1e-3
    assert binomtest(sum(p <= 0.01 for p in found), WORLDS, 0.01).pvalue > 1e-3
    nulls = ClusteredNulls(null=np.array([-1.0, 0.0, 1.0]), kinds=np.arange(3))
    assert nulls.tail(2.0) == pytest.approx(t.sf(2.0 / math.sqrt(4 / 3), 2))


@pytest.mark.parametrize("reached", [0, 8, 80, 160])
def test_the_interval_is_that_of_a_binomial_of_so_many_flags(reached: int) -> None:
    values = np.concatenate([np.linspace(2, 3, reached), np.linspace(0, 1, 160 - reached)])
    place = np.argsort(np.argsort(values)) % KINDS  # each kind has flags of all sizes
    nulls = ClusteredNulls(null=values, kinds=place)
    assert nulls.effective == 160
    low, high = nulls.interval(1.5, level=0.9)
    assert low == 0 if reached == 0 else binom.sf(reached - 1, 160, low) == pytest.approx(0.05)
    assert high == 1 if reached == 160 else binom.cdf(reached, 160, high) == pytest.approx(0.05)


def test_kinds_settle_a_level_once_their_interval_does_not_hold_it() -> None:
    """With none as far, 0.95^n is below 5 % from 59 flags on, whichever kinds they are of."""
    values = np.arange(40.0)
    nulls = ClusteredNulls(null=values, kinds=np.tile(np.arange(5), 8))
    assert nulls.effective == 40
    assert nulls.settling(99.0, at=0.05, level=0.9) == math.ceil(59 / 8)
    assert nulls.settling(37.5, at=0.05, level=0.9) is None  # a share that is the level itself
