"""p-values of statistics among null experiments that are alike within a kind of numerics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom, binomtest

from measure.nulls import GroupedConformal, kinds_needed

KINDS = 39


def world(
    rng: np.random.Generator, *, each: tuple[int, ...], within: float
) -> tuple[GroupedConformal, float]:
    """Nulls of `KINDS` kinds whose groups scatter by `within` about their kind's own level, of
    heavy tails; and the statistic of a group of one kind more."""
    level = rng.standard_cauchy(KINDS + 1)
    counts = rng.choice(each, KINDS)
    kinds = np.repeat(np.arange(KINDS), counts)
    null = level[kinds] + within * rng.normal(size=len(kinds))
    return GroupedConformal(null=null, kinds=kinds), float(level[-1] + within * rng.normal())


@pytest.mark.parametrize(
    ("each", "within"), [((1,), 1.0), ((10,), 0.0), ((1, 3, 20), 0.3), ((8,), 10.0)]
)
def test_kinds_that_are_exchangeable_are_rejected_at_most_as_often_as_the_level_says(
    each: tuple[int, ...], within: float
) -> None:
    """Whatever the shape of the tail, the number of groups of a kind and how alike they are; 2,000
    worlds."""
    rng, worlds = np.random.default_rng(4), 2000
    found = np.array(
        [
            nulls.p(value)
            for nulls, value in (world(rng, each=each, within=within) for _ in range(worlds))
        ]
    )
    for level in (0.025, 0.05, 0.1, 0.3, 0.5, 0.9):
        rejected = int((found <= level).sum())
        assert binomtest(rejected, worlds, level, alternative="greater").pvalue > 1e-4, level


@pytest.mark.parametrize("each", [1, 10])
def test_p_is_uniform_where_groups_of_a_kind_are_alike(each: int) -> None:
    """On its grid of multiples of 1/(K + 1): the data are any of K + 1 kinds with the same
    chance."""
    rng, worlds = np.random.default_rng(9), 2000
    found = np.array(
        [
            nulls.p(value)
            for nulls, value in (world(rng, each=(each,), within=0.0) for _ in range(worlds))
        ]
    )
    places = np.rint(found * (KINDS + 1)).astype(int)
    np.testing.assert_allclose(places / (KINDS + 1), found)
    for step in (1, 4, 20, 36):
        share = binomtest(int((places <= step).sum()), worlds, step / (KINDS + 1))
        assert share.pvalue > 1e-4, step


def test_groups_counted_as_independent_would_reject_too_often() -> None:
    """Ten groups of 39 kinds are no 390 nulls: beyond all of them is an event of one in 40."""
    rng, worlds = np.random.default_rng(3), 2000
    beyond = sum(
        value > nulls.null.max()
        for nulls, value in (world(rng, each=(10,), within=0.0) for _ in range(worlds))
    )
    assert binomtest(beyond, worlds, 1 / 391, alternative="greater").pvalue < 1e-6
    assert binomtest(beyond, worlds, 1 / 40).pvalue > 1e-4


def test_a_kind_counts_by_the_share_of_its_groups() -> None:
    nulls = GroupedConformal(
        null=np.array([1.0, 3.0, 1.0, 3.0, 3.0, 3.0, 0.0]), kinds=np.array([0, 0, 1, 1, 1, 1, 2])
    )
    assert nulls.p(2.0) == (1 + 0.5 + 0.75 + 0) / 4
    assert nulls.p(3.5) == nulls.least == 1 / 4


@pytest.mark.parametrize(
    ("level", "kinds"), [(0.03, 33), (0.05, 19), (0.1, 9), (0.5, 1), (1 / 113, 112)]
)
def test_a_level_wants_as_many_kinds_as_its_inverse_less_one(level: float, kinds: int) -> None:
    assert kinds_needed(level) == kinds
    enough = GroupedConformal(null=np.arange(float(kinds)), kinds=np.arange(kinds))
    assert enough.tests(level)
    assert enough.p(math.inf) <= level
    fewer = GroupedConformal(null=np.arange(float(kinds - 1)), kinds=np.arange(kinds - 1))
    assert not fewer.tests(level)
    assert fewer.p(math.inf) > level
    assert fewer.critical(level) is None


@pytest.mark.parametrize("level", [0.03, 0.1, 0.3])
def test_beyond_the_critical_value_p_is_at_most_the_level(level: float) -> None:
    rng = np.random.default_rng(1)
    nulls = GroupedConformal(null=rng.exponential(size=300), kinds=np.repeat(np.arange(60), 5))
    critical = nulls.critical(level)
    assert critical is not None
    assert nulls.p(np.nextafter(critical, math.inf)) <= level < nulls.p(critical)


@pytest.mark.parametrize("reached", [0, 3, 20, 39])
def test_the_interval_is_that_of_a_binomial_of_the_kinds(reached: int) -> None:
    """However many groups they make: at its ends, so many kinds or more, and so many or fewer, have
    a chance of 5 %."""
    nulls = GroupedConformal(
        null=np.repeat(np.arange(39) < reached, 7).astype(float), kinds=np.repeat(np.arange(39), 7)
    )
    low, high = nulls.interval(1.0, level=0.9)
    assert low == 0 if reached == 0 else binom.sf(reached - 1, 39, low) == pytest.approx(0.05)
    assert high == 1 if reached == 39 else binom.cdf(reached, 39, high) == pytest.approx(0.05)


def test_one_more_kind_is_within_the_quantile_as_often_as_it_says() -> None:
    rng, worlds = np.random.default_rng(8), 2000
    inside = sum(
        value <= nulls.quantile(0.9)
        for nulls, value in (world(rng, each=(4,), within=0.0) for _ in range(worlds))
    )
    # 36 of 40 places.
    assert binomtest(inside, worlds, 0.9).pvalue > 1e-4
    assert GroupedConformal(null=np.arange(8.0), kinds=np.arange(8)).quantile(0.9) == math.inf


@pytest.mark.parametrize(("reached", "expected"), [(0, 59), (20, 40), (40, 40)])
def test_kinds_settle_a_level_once_their_interval_does_not_hold_it(
    reached: int, expected: int
) -> None:
    """With none as far, 0.95^n is below 5 % from 59 kinds on; half of 40 are far from a level of 5
    % already."""
    nulls = GroupedConformal(null=(np.arange(40) < reached).astype(float), kinds=np.arange(40))
    assert nulls.settling(0.5, at=0.05, level=0.9) == expected


def test_one_of_ten_kinds_as_far_needs_as_many_as_a_binomial_says() -> None:
    nulls = GroupedConformal(null=(np.arange(40) < 4).astype(float), kinds=np.arange(40))
    needed = nulls.settling(0.5, at=0.05, level=0.9)
    assert needed is not None
    # The chance of a tenth or more where 5 % are as far falls below 5 % there, and not ten kinds
    # before.
    tens = 10 * math.ceil(needed / 10)
    assert binom.sf(tens // 10 - 1, tens, 0.05) < 0.05 < binom.sf(tens // 10 - 3, tens - 20, 0.05)


def test_a_share_at_the_level_itself_is_settled_by_no_number_of_kinds() -> None:
    nulls = GroupedConformal(null=(np.arange(40) < 2).astype(float), kinds=np.arange(40))
    assert nulls.settling(0.5, at=0.05, level=0.9) is None
