"""When a base model that is not rejected suffices, and where no model explains recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence

from measure.verdict.criteria import CRITERIA
from measure.verdict.quantity import known, number
from measure.verdict.verdict_record import Comparison, Conclusion, Verdict

NOT_REJECTED = (Conclusion.UNTESTED, Conclusion.SUFFICIENT, Conclusion.UNDECIDED)
"""Conclusions that state nothing to be missing."""


def undecided_sentences(
    p: float, *, level: float, departure: float, power: Sequence[float]
) -> tuple[str, ...]:
    """Explains, in sentences, why a base model that is not rejected is not shown to suffice;
    nothing where it does.

    Args:
        p: of the base model, above the level.
        level: of the test.
        departure: root mean square departure of the observables from the base model fitted to them
            [their scatters].
        power: of the test for each effect that is tested, at its expected strength.
    """
    reasons = []
    if p <= CRITERIA.borderline * level:
        reasons.append(
            f"p is within a factor of {CRITERIA.borderline:g} of the level {level:g}, at which the "
            "base model would be "
            "rejected"
        )
    if departure > CRITERIA.departure:
        reasons.append(
            "the observables depart from the base model that was fitted to them by "
            f"{number(departure, digits=2)} of "
            f"their scatters, root mean square, and more than {CRITERIA.departure:g} is not chance"
        )
    mean = sum(power) / len(power) if power else 0.0
    if mean < CRITERIA.least_power:
        reasons.append(
            "an effect of its expected strength would have been seen with a chance of "
            f"{number(mean, digits=2)} on "
            f"average, and below {CRITERIA.least_power:g} nothing seen says little"
        )
    return tuple(reasons)


def erring(verdict: Verdict) -> list[Comparison]:
    """Selects the comparisons on unseen data in which the model that is offered as the answer errs
    by more than three
    of their floors: with what was named, or else the base model."""
    return [
        comparison
        for comparison in verdict.comparisons
        if times_floor(comparison, verdict) > CRITERIA.errs
    ]


def times_floor(comparison: Comparison, verdict: Verdict) -> float:
    """Computes the error of that model in floors; 0 where either is not known."""
    after = bool(verdict.named) and known(comparison.after)
    error, floor = comparison.after if after else comparison.before, comparison.floor
    if not known(error) or not known(floor) or not math.isfinite(floor.point) or floor.point <= 0:
        return 0.0
    return error.point / floor.point
