"""Effects of the library as they were weighed, and their order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray, IntArray
from measure.loop.strength_estimates import (
    heterogeneous,
)
from measure.loop.validation import total_error
from measure.verdict.verdict_record import Candidate


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighed:
    """A candidate with what the decision needs.

    Attributes:
        column: place among the evidence's columns.
        candidate: as reported.
        error: standard error of the strength.
        score: how far the recordings go its way, see `measure.nulls.directed_test`; of gusts, how
            far the wind's course swings; −∞ of what is not tested for.
        gains: (segment,) held-out gain.
        recording: (segment,) of each.
        admissible: whether the model exists: its strength is one that the effect may have, its
            cloth stays one, and a wind that fluctuates does it as turbulence does.
        unlike: why such a model does not exist, beside its strength: how the wind's course differs
            from that of turbulence, or that a log's direction is within its tolerance; empty where
            it does.
        measured: the strength where it is found apart from the other columns; None where it is
            fitted beside them.
    """

    column: int
    candidate: Candidate
    error: float
    score: float
    gains: FloatArray
    recording: IntArray
    admissible: bool
    unlike: str = ""
    measured: Quantity | None = None

    def passes(self, least: float, level: float) -> bool:
        """Returns whether the model passes its predictive test: no other effect acts beside it at p
        of `least` or less, and its strength is the same in all recordings at a level."""
        return self.candidate.leftover > least and not heterogeneous(self.candidate, level)


def rank_candidates(candidates: Sequence[Weighed]) -> list[Weighed]:
    """Ranks candidates by their directed scores, those first that are admissible, and notes how far
    each lies behind the one that predicts best."""
    best = best_by_gain(candidates)
    return [
        replace(w, candidate=replace(w.candidate, behind=lag_behind(best, w)))
        for w in sorted(candidates, key=lambda w: (-w.admissible, -w.score))
    ]


def best_by_gain(candidates: Sequence[Weighed]) -> Weighed:
    """Returns the candidate with the largest held-out gain, of the admissible ones if any is."""
    return max(candidates, key=lambda w: (w.admissible, w.gains.sum()))


def lag_behind(best: Weighed, compared: Weighed) -> float:
    """Computes standard errors of the paired difference."""
    if compared is best:
        return 0.0
    difference = best.gains - compared.gains
    error = total_error(difference, best.recording)
    return float(difference.sum() / error) if error > 0 else 0.0
