"""Intervals of draws that pile up at an end of their range: which side they bound, and where the
interval then ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.answer import Bound, Span
from flagdata.core.arrays import FloatArray
from measure.posterior_ends import bound_of, limits_of, of_profile, span

ANY = (-math.inf, math.inf)


def places(below: int, above: int) -> FloatArray:
    """100 places, so many of them 2 % from the lower end and from the upper one, the rest in the
    middle."""
    return np.repeat([0.02, 0.5, 0.98], [below, 100 - below - above, above])


@pytest.mark.parametrize(
    ("below", "above", "bound"),
    [
        (0, 0, None),
        (9, 9, None),
        (0, 10, Bound.LEAST),
        (10, 0, Bound.MOST),
        (10, 10, Bound.NOTHING),
    ],
)
def test_a_tenth_of_the_draws_within_three_percent_of_an_end_bounds_one_side(
    below: int, above: int, bound: Bound | None
) -> None:
    assert bound_of(places(below, above)) is bound


def test_draws_further_than_three_percent_from_the_ends_or_spread_evenly_keep_both() -> None:
    assert bound_of(np.full(100, 0.969)) is None
    assert bound_of(np.full(100, 0.031)) is None
    assert bound_of(np.linspace(0, 1, 1001)) is None
    assert (
        bound_of(np.full(100, 1.004)) is Bound.LEAST
    )  # networks' ranges reach half a percent beyond the ends


def of(draws: FloatArray, limits: tuple[float, float]) -> Span:
    return span(draws, draws / 10, level=0.9, limits=limits, assumed=(0.0, 10.0))


def test_draws_at_the_upper_end_bound_from_below_with_half_of_the_rest() -> None:
    found = of(np.linspace(9.0, 10.0, 1001), limits_of("wind_speed"))
    assert (found.low, found.high) == (pytest.approx(9.05), math.inf)
    assert found.level == pytest.approx(0.95)
    assert not found.estimated
    assert found.ends() == [pytest.approx(9.05), None]
    assert found.phrase(1, " m/s") == "at least 9.1 m/s"


def test_no_wind_is_slower_than_calm_air_so_that_its_interval_begins_at_0_and_the_mean_is_an_estimate() -> (
    None
):
    """Central intervals of draws in 0 to 0.5 m/s begin at 0.025 m/s and would exclude calm air."""
    found = of(np.linspace(0.0, 0.5, 1001), limits_of("wind_speed"))
    assert (found.low, found.high, found.estimated) == (0.0, pytest.approx(0.475), True)
    assert found.phrase(1, " m/s") == "at most 0.5 m/s"


def test_draws_at_the_lower_end_of_what_has_no_limit_there_have_no_lower_end_and_no_estimate() -> (
    None
):
    found = of(np.linspace(0.0, 0.5, 1001), ANY)
    assert (found.ends(), found.estimated) == ([None, pytest.approx(0.475)], False)


def test_a_range_that_is_known_ends_the_interval_where_it_ends() -> None:
    found = of(np.linspace(9.0, 10.0, 1001), (0.0, 10.0))
    assert (found.low, found.high, found.estimated) == (pytest.approx(9.05), 10.0, True)


def test_an_interval_with_two_ends_does_not_leave_what_is_possible() -> None:
    found = of(np.linspace(-0.02, 8.0, 1001), (0.0, math.inf))
    assert found.bound is None
    assert found.low >= 0.0
    assert found.phrase(1) == f"[{found.low:.1f}, 7.6]"


def test_draws_at_both_ends_constrain_nothing() -> None:
    found = of(np.repeat([0.1, 5.0, 9.9], 10), limits_of("wind_speed"))
    assert (found.ends(), found.estimated) == ([0.0, None], False)
    assert found.phrase(1) == "not constrained"


def profiled(misfit: FloatArray, *, larger: float = 1.0) -> Span:
    return of_profile(
        np.linspace(0.0, 10.0, len(misfit)), misfit, level=0.9, limits=ANY, larger=larger
    )


def test_the_profile_of_a_normal_likelihood_has_its_central_interval() -> None:
    values = np.linspace(0.0, 10.0, 2001)
    for larger in (1.0, 2.0):
        found = profiled(((values - 5.0) / 0.7) ** 2, larger=larger)
        half = 1.6449 * 0.7 * larger
        assert (found.low, found.high) == (
            pytest.approx(5 - half, abs=0.01),
            pytest.approx(5 + half, abs=0.01),
        )
        assert (found.bound, found.level) == (None, 0.9)


def test_a_profile_whose_interval_reaches_an_end_of_its_values_is_a_bound_of_half_of_the_rest() -> (
    None
):
    values = np.linspace(0.0, 10.0, 2001)
    least = profiled(((values - 9.5) / 0.7) ** 2)
    assert (least.bound, least.level, least.high) == (Bound.LEAST, pytest.approx(0.95), math.inf)
    assert least.low == pytest.approx(9.5 - 1.6449 * 0.7, abs=0.01)
    assert profiled(((values - 0.5) / 0.7) ** 2).bound is Bound.MOST
    assert profiled(0 * values).bound is Bound.NOTHING
