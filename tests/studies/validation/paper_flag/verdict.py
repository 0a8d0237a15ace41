"""What the study says, by stated rules: which candidates remain, and whether what remains is
enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tests.studies.validation.paper_flag.candidates import Candidate, Shear
from tests.studies.validation.paper_flag.evidence import Condition, Kind
from tests.studies.validation.paper_flag.observe import Observations
from tests.studies.validation.paper_flag.recipe import Case, Group
from tests.studies.validation.paper_flag.study import Outcome, Study

_ERRORS = 2.0
"""Standard errors by which a candidate must be worse than the best to be left out."""


class Conclusion(StrEnum):
    """The classes of a verdict."""

    EFFECT = "one effect"
    ONE_OF = "one of several effects"
    PARTLY = "partly explained"
    NONE = "none of the library"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What is concluded, and from what.

    Attributes:
        best: the model in time with the least error on what was not fitted.
        remaining_fitted: models in time that the fitted kinds cannot distinguish from the best of
            them.
        remaining: those that all kinds cannot distinguish from the best.
        insufficient: kinds in which the best misses what was measured, by its mean |log error|.
        tolerance: kind → mean |log error| that measurement and mesh leave open.
    """

    conclusion: Conclusion
    best: Outcome
    remaining_fitted: tuple[Outcome, ...]
    remaining: tuple[Outcome, ...]
    insufficient: dict[Kind, float]
    tolerance: dict[Kind, float]


def judge(case: Case, seen: Observations, study: Study) -> Verdict:
    """The verdict.

    A candidate remains unless the best has smaller errors on held-out conditions by more than two
    standard errors of the paired difference. What remains is enough if no kind's mean error exceeds
    what the measurements' intervals and the mesh leave open.
    """
    fitted = study.in_time[0].fitted_to
    best = min(study.in_time, key=lambda outcome: outcome.score)
    tolerance = {
        kind: max(_half_width(_conditions(case, seen, kind)), study.floor.get(kind, 0.0))
        for kind in best.held_out
    }
    missed = {
        kind: best.held_out_error(kind)
        for kind in best.held_out
        if best.held_out_error(kind) > tolerance[kind]
    }
    remaining = _remaining(study.in_time, tuple(best.held_out))
    names = {outcome.candidate for outcome in remaining}
    if not any(outcome.gains[kind].low > 0 for outcome in remaining for kind in fitted):
        conclusion = Conclusion.NONE
    elif missed:
        conclusion = Conclusion.PARTLY
    else:
        conclusion = Conclusion.EFFECT if len(names) == 1 else Conclusion.ONE_OF
    return Verdict(
        conclusion=conclusion,
        best=best,
        remaining_fitted=_remaining(study.in_time, fitted),
        remaining=remaining,
        insufficient=missed,
        tolerance=tolerance,
    )


def _remaining(outcomes: Sequence[Outcome], kinds: Sequence[Kind]) -> tuple[Outcome, ...]:
    sizes = {
        index: np.concatenate([np.abs(outcome.held_out[kind]) for kind in kinds])
        for index, outcome in enumerate(outcomes)
    }
    best = min(sizes, key=lambda index: float(sizes[index].mean()))
    kept = []
    for index, outcome in enumerate(outcomes):
        worse = sizes[index] - sizes[best]
        error = float(worse.std(ddof=1) / math.sqrt(len(worse)))
        if index == best or float(worse.mean()) <= _ERRORS * error:
            kept.append(outcome)
    return tuple(kept)


def _conditions(case: Case, seen: Observations, kind: Kind) -> tuple[Condition, ...]:
    return tuple(
        c for group in (Group.FIT, Group.HELD_OUT) for c in seen.conditions(case, group, (kind,))
    )


def _half_width(conditions: Sequence[Condition]) -> float:
    """Mean half-width of the measured intervals, as logarithms."""
    widths = [
        math.log(c.high / c.low) / 2 for c in conditions if math.isfinite(c.low) and c.low > 0
    ]
    return float(np.mean(widths)) if widths else 0.0


def free(outcomes: Sequence[Outcome], candidate: Candidate) -> Outcome:
    """The model of a candidate with a free factor."""
    return next(o for o in outcomes if o.candidate is candidate and o.shear is Shear.FREE)
