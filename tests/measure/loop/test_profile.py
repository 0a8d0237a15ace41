"""A strength whose likelihood is flat towards an end is a bound."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from measure.forecasting import EffectColumn
from measure.loop.refit import BEYOND, Profile, across
from measure.verdict import estimate_text, with_level

HOIST = EffectColumn(effect="full-hoist", parameter="stiffness", step=20.0)
TURNED = EffectColumn(effect="direction-change", parameter="angle", step=0.05)
POROSITY = EffectColumn(effect="porosity", parameter="open_share", step=0.05)


def profile(column: EffectColumn, misfit: Callable[[float], float], *, sign: int = 1) -> Profile:
    sizes = np.geomspace(10.0, 1e5, 41)
    return Profile(column=column, sizes=sizes, sign=sign, misfit=np.vectorize(misfit)(sizes))


def saturating(size: float) -> float:
    """Nothing changes beyond 1000; each factor of e below it costs 4."""
    return 4.0 * max(math.log(1000.0 / size), 0.0)


def test_of_a_misfit_that_is_flat_from_a_strength_on_the_strength_is_at_least_where_it_rises() -> (
    None
):
    found = profile(HOIST, saturating).estimate(larger=1.0)
    assert found is not None
    # 4 ln(1000/s) = 2.706, the quantile of chi-squared at 90 %: s = 508, less the factor of
    # e^(1.645/2).
    assert found.low == pytest.approx(1000 * math.exp(-2.706 / 4) * math.exp(-1.645 / 2), rel=0.01)
    assert found.value is None
    assert (found.point, found.high, found.bound, found.level) == (
        found.low,
        math.inf,
        "at-least",
        0.95,
    )
    assert with_level(found) == "at least 220 N/m² 95 %"


def test_errors_that_are_larger_than_the_misfit_says_lower_the_bound() -> None:
    plain, larger = (profile(HOIST, saturating).estimate(larger=factor) for factor in (1.0, 2.0))
    assert plain is not None
    assert larger is not None
    assert larger.low == pytest.approx(plain.low * math.exp(-3 * 2.706 / 4), rel=0.02)


def test_a_misfit_that_is_flat_towards_none_bounds_from_above() -> None:
    found = profile(HOIST, lambda size: 4.0 * max(math.log(size / 1000.0), 0.0)).estimate(
        larger=1.0
    )
    assert found is not None
    assert (found.low, found.bound) == (0.0, "at-most")
    assert (
        found.high
        == found.point
        == pytest.approx(1000 * math.exp(2.706 / 4) * math.exp(1.645 / 2), rel=0.01)
    )


def test_of_strengths_of_either_sign_a_misfit_that_is_flat_towards_none_is_no_bound() -> None:
    sizes = np.geomspace(1e-3, 1.0, 41)
    misfit = 4.0 * np.maximum(np.log(sizes / 0.1), 0.0)
    assert Profile(column=TURNED, sizes=sizes, sign=1, misfit=misfit).estimate(larger=1.0) is None


def test_a_bound_of_a_negative_strength_is_one_from_above_and_ends_where_the_effect_does() -> None:
    sizes = np.geomspace(1e-3, 1.0, 41)
    misfit = 4.0 * np.maximum(np.log(0.1 / sizes), 0.0)
    found = Profile(column=TURNED, sizes=sizes, sign=-1, misfit=misfit).estimate(larger=1.0)
    assert found is not None
    assert (found.low, found.bound) == (pytest.approx(TURNED.described.admissible[0]), "at-most")
    assert (
        found.high
        == found.point
        == pytest.approx(-0.1 * math.exp(-2.706 / 4) * math.exp(-1.645 / 2), rel=0.01)
    )


def test_a_misfit_that_rises_to_either_side_is_no_bound() -> None:
    assert (
        profile(HOIST, lambda size: 4.0 * abs(math.log(size / 1000.0))).estimate(larger=1.0) is None
    )


def test_a_model_that_does_not_exist_beyond_a_strength_is_no_flat_end() -> None:
    assert (
        profile(HOIST, lambda size: saturating(size) if size < 2e4 else math.inf).estimate(
            larger=1.0
        )
        is None
    )


def test_a_misfit_that_is_flat_altogether_determines_nothing() -> None:
    found = profile(HOIST, lambda _: 7.0).estimate(larger=1.0)
    assert found is not None
    assert (found.low, found.high, found.bound) == (0.0, math.inf, "nothing")
    assert estimate_text(found) == with_level(found) == "not determined"


def test_strengths_reach_beyond_what_is_expected_and_what_was_fitted() -> None:
    low, high = HOIST.described.prior
    sizes, sign = across(HOIST, 25.0)
    assert (sign, sizes[0], sizes[-1]) == (
        1,
        pytest.approx(25.0 / BEYOND),
        pytest.approx(high * BEYOND, rel=1e-5),
    )
    assert across(HOIST, 2e10)[0][-1] == pytest.approx(2e10 * BEYOND, rel=1e-5)
    assert across(HOIST, -3.0)[0][0] == pytest.approx(low / BEYOND)
    assert across(TURNED, -0.1)[1] == -1


def test_a_strength_that_cannot_be_more_has_no_bound_there() -> None:
    """Of holes that take all there is an interval, which ends with the cloth."""
    sizes, sign = across(POROSITY, 0.4)
    most = POROSITY.described.admissible[1]
    assert (sign, sizes[-1]) == (1, pytest.approx(most, rel=1e-5))
    flat = Profile(column=POROSITY, sizes=sizes, sign=1, misfit=8.0 * np.log(most / sizes))
    assert flat.estimate(larger=1.0) is None
