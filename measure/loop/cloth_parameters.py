"""The cloth's calibrated parameters in a reader's units, with intervals that include the scatter
between simulators.

Nulls of our own code show what noise and discretisation leave open: how well the same simulator
would find a parameter again. Another code's elements are another model of the same cloth, and its
truths are off by more. Both are given, as a laboratory gives repeatability and reproducibility (ISO
5725-1): the interval includes both, the standard error of the logarithm is the former alone.
"""

from __future__ import annotations

import math

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.loop.gauss_newton import Refined
from measure.verdict.criteria import CRITERIA
from measure.verdict.verdict_record import (
    Parameter,
)


def parameters(
    base: Refined, larger: Refined | None, reach: FloatArray, *, area_weight_uncertainty: float
) -> tuple[Parameter, ...]:
    """Estimates area weight, bending and damping, by their logarithms, of the base and of a larger
    model.

    Args:
        reach: (theta,) standard errors to either side within which this code's nulls lie.
        area_weight_uncertainty: relative standard uncertainty of the area weight before anything
            was fitted.
    """
    estimated: list[Parameter] = []
    for index, (name, _, _) in enumerate(THETA):
        half = float(reach[index]) * base.errors[index]
        before = _estimate(name, base.model.calibration, half, area_weight_uncertainty)
        within = half / CRITERIA.reach
        if larger is None:
            estimated.append(
                Parameter(name=name, before=before, after=None, shift=None, within=within)
            )
            continue
        steps = larger.model.calibration.steps_from(base.model.calibration)
        after = _estimate(
            name,
            larger.model.calibration,
            float(reach[index]) * larger.errors[index],
            area_weight_uncertainty,
        )
        shift = steps[index] / base.errors[index]
        estimated.append(
            Parameter(name=name, before=before, after=after, shift=shift, within=within)
        )
    return tuple(estimated)


def _estimate(
    name: str, calibration: Calibration, half: float, area_weight_uncertainty: float
) -> Quantity:
    """Estimates a parameter with its interval, of half the width `half` in its logarithm by this
    code alone.

    What codes differ by does not make that of the area weight wider than what was known before.
    """
    if name == "damping":
        return _damping(calibration.damping, half)
    value, between, prior_uncertainty = {
        "area_weight": (
            calibration.area_weight,
            CRITERIA.area_weight_between,
            area_weight_uncertainty,
        ),
        "bending": (calibration.bending, CRITERIA.bending_between, math.inf),
    }[name]
    half_width = min(
        math.hypot(half, CRITERIA.reach * between), max(half, CRITERIA.reach * prior_uncertainty)
    )
    return Quantity.of(
        value=value,
        low=value * math.exp(-half_width),
        high=value * math.exp(half_width),
        unit="of nominal",
        level=CRITERIA.interval,
    )


def _damping(value: float, half: float) -> Quantity:
    """Estimates damping [s]: what codes differ by is like so much more or less of it, and where a
    fit ends is a factor beside; none lies below 0."""
    between = CRITERIA.reach * CRITERIA.damping_between
    half_width = math.hypot(half, CRITERIA.reach * CRITERIA.damping_factor)
    low = value - math.hypot(value - value * math.exp(-half_width), between)
    high = value + math.hypot(value * math.exp(half_width) - value, between)
    return Quantity.of(value=value, low=max(0.0, low), high=high, unit="s", level=CRITERIA.interval)
