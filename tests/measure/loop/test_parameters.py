"""Intervals of calibrated parameters: this code's own scatter and what codes differ by, in
quadrature."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from measure.forecasting import THETA, Calibration
from measure.loop.cloth_parameters import parameters
from measure.verdict import CRITERIA, Parameter

REACH = 1.6448536269514722  # of a normal, 90 % to either side


def estimated(
    calibration: Calibration, errors: dict[str, float], *, weighed: float = 0.3
) -> dict[str, Parameter]:
    fitted: Any = SimpleNamespace(
        model=SimpleNamespace(calibration=calibration),
        errors=np.array([errors[name] for name, _, _ in THETA]),
    )
    return {
        one.name: one
        for one in parameters(
            fitted, None, np.full(len(THETA), REACH), area_weight_uncertainty=weighed
        )
    }


def test_scatter_and_spread_among_codes_add_in_quadrature() -> None:
    """3 % and 7 %: √(0.03² + 0.07²) = 0.0762 of the area weight's logarithm; 0.8 and 0.6: 1 of the
    bending's."""
    found = estimated(
        Calibration(area_weight=1.2, bending=2.0),
        {"area_weight": 0.03, "bending": 0.8, "damping": 0.1},
    )
    assert CRITERIA.area_weight_between == 0.07
    assert CRITERIA.bending_between == 0.6
    area_weight, bending = found["area_weight"], found["bending"]
    assert math.log(area_weight.before.high / area_weight.before.point) == pytest.approx(
        REACH * math.sqrt(0.0058), rel=1e-6
    )
    assert math.log(area_weight.before.point / area_weight.before.low) == pytest.approx(
        REACH * math.sqrt(0.0058), rel=1e-6
    )
    assert math.log(bending.before.high / bending.before.low) == pytest.approx(2 * REACH, rel=1e-6)
    assert area_weight.within == pytest.approx(0.03)
    assert bending.within == pytest.approx(0.8)


def test_codes_do_not_make_the_interval_wider_than_the_scale_did() -> None:
    """Weighed to 2 %: what codes differ by, 7 %, is no doubt of the weight. Known to 50 %, it
    is."""
    fitted, errors = (
        Calibration(area_weight=1.01),
        {"area_weight": 0.015, "bending": 0.8, "damping": 0.1},
    )
    area_weight = estimated(fitted, errors, weighed=0.02)["area_weight"].before
    assert math.log(area_weight.high / area_weight.point) == pytest.approx(REACH * 0.02, rel=1e-6)
    area_weight = estimated(fitted, errors, weighed=0.5)["area_weight"].before
    assert math.log(area_weight.high / area_weight.point) == pytest.approx(
        REACH * math.hypot(0.015, 0.07), rel=1e-6
    )


def test_nulls_that_are_off_by_more_than_the_scale_widen_it() -> None:
    """An error of 5 % by nulls is kept although the recipe gives the weight to 2 %."""
    errors = {"area_weight": 0.05, "bending": 0.8, "damping": 0.1}
    area_weight = estimated(Calibration(), errors, weighed=0.02)["area_weight"].before
    assert math.log(area_weight.high) == pytest.approx(REACH * 0.05, rel=1e-6)


def test_the_factor_by_which_a_fit_ends_elsewhere_stands_beside_what_codes_differ_by() -> None:
    """A standard deviation of 1.1 is a factor of e^(1.1 · 1.645) = 6.11 either way; 2.4 ms · 1.645
    = 3.95 ms: of 1 ms, √(5.11² + 3.95²) = 6.46 ms above it, and nothing below."""
    damping = estimated(
        Calibration(damping=1e-3), {"area_weight": 0.1, "bending": 0.1, "damping": 1e-6}
    )["damping"].before
    assert (CRITERIA.damping_factor, CRITERIA.damping_between) == (1.1, 2.4e-3)
    assert damping.low == 0.0
    assert damping.high == pytest.approx(1e-3 + 6.456e-3, rel=1e-3)


def test_of_much_damping_what_codes_differ_by_hardly_shows() -> None:
    """30 ms known to 20 %: √(1.1² + 0.2²) = 1.118 is a factor of 6.29, to 4.77 and 189 ms, beside
    which 2.4 ms count little."""
    damping = estimated(
        Calibration(damping=30e-3), {"area_weight": 0.1, "bending": 0.1, "damping": 0.2}
    )["damping"].before
    factor = math.exp(REACH * math.hypot(0.2, 1.1))
    assert damping.low == pytest.approx(30e-3 / factor, rel=0.1)
    assert damping.high == pytest.approx(30e-3 * factor, rel=1e-3)
    assert damping.point - damping.low == pytest.approx(
        math.hypot(30e-3 * (1 - 1 / factor), REACH * 2.4e-3), rel=1e-6
    )
