"""Each statistic by its own tail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, t

from measure.forecasting import names
from measure.nulls.tails import as_normal, freedom
from tests.measure.loop.drawn_statistics import blown, made, seen


@pytest.mark.parametrize("degrees", [4.5, 6.0, 12.0, 40.0])
def test_a_deviation_is_brought_to_the_normal_one_that_is_as_rare(degrees: float) -> None:
    values = np.array([0.3, 1.0, 2.0, 4.0, 9.0, 16.0])
    found = as_normal(values, np.full(6, degrees))
    exact = norm.isf(t.sf(values * np.sqrt(degrees / (degrees - 2)), degrees))
    np.testing.assert_allclose(found, exact, rtol=0.025)
    np.testing.assert_array_equal(as_normal(-values, np.full(6, degrees)), -found)
    assert (np.diff(as_normal(np.geomspace(1, 1e6, 50), np.full(50, degrees))) > 0).all()


def test_normal_ones_stay_as_they_are_however_far() -> None:
    values = np.array([0.0, 0.5, 3.0, 30.0])
    np.testing.assert_allclose(as_normal(values, np.full(4, 1e6)), values, rtol=1e-3)


def test_degrees_of_freedom_are_those_of_the_kurtosis() -> None:
    rng = np.random.default_rng(1)
    drawn = np.stack(
        [rng.standard_t(10, 200_000), rng.uniform(size=200_000), np.zeros(200_000)], axis=1
    )
    heavy, light, nothing = freedom(drawn)
    assert heavy == pytest.approx(10, rel=0.1)
    assert light == nothing == 1e6


def test_one_odd_kind_no_longer_sets_the_critical_value_for_all() -> None:
    """Of 50 kinds the wind's course of one swings by 300 times as much as those of the others."""
    bank = made(seed=1, courses=True)
    course, rng = bank.nulls.statistics.course, np.random.default_rng(3)
    assert course is not None
    odd = bank.nulls.numerics == 7
    wild = blown(rng, int(odd.sum()), 0.5 * rng.normal(size=(int(odd.sum()), 1, 1)))
    score = course.score.copy()
    score[odd] = wild.score
    nulls = replace(
        bank.nulls, statistics=replace(bank.nulls.statistics, course=replace(course, score=score))
    )
    calm, windy = (
        replace(bank, nulls=own).reference(12, noise=0.0, seed=1) for own in (bank.nulls, nulls)
    )
    most = [float(own.far[own.kinds != 7].max()) for own in (calm, windy)]
    odd_one = float(windy.far[windy.kinds == 7].max())
    swing = slice(len(windy.spread) + 2, len(windy.spread) + 2 + len(windy.powers))
    assert windy.degrees[swing].min() < 5
    assert odd_one < 2 * most[0]
    null = bank.model(bank.nulls.design)
    lifted = seen(null, {"lift.coefficient": 1.0}, course=np.zeros((12, 10, 3)))
    assert windy.test.p(windy.tested(lifted, names())) <= 2 * windy.test.least
