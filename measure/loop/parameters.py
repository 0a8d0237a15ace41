"""The cloth's calibrated parameters in a reader's units, with intervals that include the scatter between simulators.

Nulls of our own code show what noise and discretisation leave open: how well the same simulator would find a parameter
again. Another code's elements are another model of the same cloth, and its truths are off by more. Both are given, as a
laboratory gives repeatability and reproducibility (ISO 5725-1): the interval includes both, the standard error of the
logarithm is the former alone.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from measure.forecasting.calibration import THETA, Calibration
from measure.loop.gauss_newton import Refined
from measure.verdict.criteria import CRITERIA
from measure.verdict.record import Estimate, Parameter


def parameters(
    base: Refined, larger: Refined | None, reach: NDArray[np.float64], *, weighed: float
) -> tuple[Parameter, ...]:
    """Density, bending and damping, which are estimated by their logarithms, of the base and of a larger model.

    Args:
        reach: (theta,) standard errors to either side within which this code's nulls lie.
        weighed: relative standard uncertainty of the density before anything was fitted.
    """
    made: list[Parameter] = []
    for place, (name, _, _) in enumerate(THETA):
        half = float(reach[place]) * base.errors[place]
        before = _estimate(name, base.model.calibration, half, weighed)
        within = half / CRITERIA.reach
        if larger is None:
            made.append(Parameter(name=name, before=before, after=None, shift=None, within=within))
            continue
        steps = larger.model.calibration.steps_from(base.model.calibration)
        after = _estimate(name, larger.model.calibration, float(reach[place]) * larger.errors[place], weighed)
        shift = steps[place] / base.errors[place]
        made.append(Parameter(name=name, before=before, after=after, shift=shift, within=within))
    return tuple(made)


def _estimate(name: str, calibration: Calibration, half: float, weighed: float) -> Estimate:
    """A parameter with its interval, of half the width `half` in its logarithm by this code alone.

    What codes differ by does not make that of the density wider than what was known before.
    """
    if name == "damping":
        return _damping(calibration.damping, half)
    value, between, known = {
        "density": (calibration.density, CRITERIA.density_between, weighed),
        "bending": (calibration.bending, CRITERIA.bending_between, math.inf),
    }[name]
    whole = min(math.hypot(half, CRITERIA.reach * between), max(half, CRITERIA.reach * known))
    return Estimate(
        value=value,
        low=value * math.exp(-whole),
        high=value * math.exp(whole),
        unit="of nominal",
        level=CRITERIA.interval,
    )


def _damping(value: float, half: float) -> Estimate:
    """Damping [s]: what codes differ by is like so much more or less of it, and where a fit ends is a factor beside;
    none lies below 0."""
    between = CRITERIA.reach * CRITERIA.damping_between
    whole = math.hypot(half, CRITERIA.reach * CRITERIA.damping_factor)
    low = value - math.hypot(value - value * math.exp(-whole), between)
    high = value + math.hypot(value * math.exp(whole) - value, between)
    return Estimate(value=value, low=max(0.0, low), high=high, unit="s", level=CRITERIA.interval)
