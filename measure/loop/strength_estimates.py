"""Strengths of effects: with their intervals, of each recording alone, and whether they are one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, norm

from flagdata.answer import Quantity
from measure.inference.segment_evidence import Evidence
from measure.verdict.criteria import CRITERIA
from measure.verdict.verdict_record import Candidate


def heterogeneity(strengths: Sequence[Quantity]) -> float | None:
    """Computes the p-value of one strength in all recordings, by Cochran's Q (Biometrics 10:101,
    1954); None of fewer than two.

    A strength is that of a law in the wind: a wind that rises by so many metres a second, fitted as
    one that rises by an angle, has a larger angle in lighter winds.

    Args:
        strengths: of each recording alone, with normal intervals.
    """
    if len(strengths) < 2:
        return None
    values = np.array([s.point for s in strengths])
    errors = np.array([(s.high - s.low) / 2 / norm.ppf(0.5 + s.level / 2) for s in strengths])
    weights = errors**-2.0
    common = (weights * values).sum() / weights.sum()
    return float(chi2.sf((weights * (values - common) ** 2).sum(), len(strengths) - 1))


def heterogeneous(candidate: Candidate, level: float) -> bool:
    """Returns whether its strength is another in every recording: another law in the wind would be
    a better one."""
    return candidate.heterogeneity is not None and candidate.heterogeneity <= level


def strengths_by_recording(
    evidence: Evidence,
    chosen: Sequence[int],
    column: int,
    *,
    about: float,
    larger: float,
    unit: str,
) -> tuple[Quantity, ...]:
    """Estimates the strength of a column in each recording alone, where some columns are fitted to
    it.

    Args:
        about: the strength in the model that the evidence is of.
        larger: by how much its standard errors are larger than Σ says.
    """
    strengths: list[Quantity] = []
    for index in np.unique(evidence.recording):
        value, claimed = evidence.select(evidence.recording == index).fit(chosen).of(column)
        strengths.append(estimate(about + value, larger * claimed, unit))
    return tuple(strengths)


def strength(null: float, coefficient: float, error: float, unit: str) -> Quantity:
    """Estimates the strength of an effect, by its coefficient beyond null and the standard error
    that nulls leave.

    What the fit's mesh and a mistold cloth do to an effect is a factor, so that more of the
    interval lies beyond the strength than between it and the null.
    """
    factor, reach = CRITERIA.reach * CRITERIA.strength_factor, CRITERIA.reach * error
    inward = math.hypot(coefficient * (1 - math.exp(-factor)), reach)
    outward = math.hypot(coefficient * (math.exp(factor) - 1), reach)
    low, high = (outward, inward) if coefficient < 0 else (inward, outward)
    value = null + coefficient
    return Quantity.of(
        value=value, low=value - low, high=value + high, unit=unit, level=CRITERIA.interval
    )


def estimate(value: float, error: float, unit: str) -> Quantity:
    """Computes a normal interval at the level of all intervals."""
    return Quantity.of(
        value=value,
        low=value - CRITERIA.reach * error,
        high=value + CRITERIA.reach * error,
        unit=unit,
        level=CRITERIA.interval,
    )
