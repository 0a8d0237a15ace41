"""The verdict's numbers: does the base model suffice, and if not, which effects may be what it lacks.

The test compares two statistics of the recordings with those of null experiments that went the same way: the misfit of
the calibrated base model, and the largest logarithm of an effect's Bayes factor. Of each kind of numerics that half of
the null experiments counts whose fitted cloths are nearest. Each statistic is brought to the scale of null experiments
of other kinds, and the larger one is counted by the grouped conformal p.

Given that something is missing, effects have posterior probabilities with equal priors. The confidence set is the
smallest that has 95 % of it; a name is given alone only where one effect has as much. The best of them has to help more
than the best one does in null experiments, and a model with one of them to pass the test of its own misfit, against
that of null experiments with the same effect fitted to them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from measure.calibrate.prior import Floats
from measure.films.weigh import Weighing
from measure.nulls.conformal import GroupedConformal
from measure.verdict.record import Conclusion

TEMPERED = 0.5
"""Share of the Bayes factors' logarithms that counts: regressions of an effect from 16 pairs err in the same way in all
recordings (decision 046)."""
CONFIDENCE = 0.95
"""Of the set of effects that may be what is missing."""
NEAR = 0.5
"""Share of the null experiments of each kind by which an experiment is judged: those whose fitted cloths are nearest to
its own, since regressions err more at the ends of the priors."""
PART = 0.25
"""Share of the misfit beyond that of null experiments which an effect that is called a part takes away."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """What was decided.

    Attributes:
        conclusion: see `Conclusion`.
        named: places of the effects named among those weighed, most probable first.
        confident: places of the confidence set's, most probable first.
        probability: (effect,) given that one of them is missing.
        leftover: (effect,) p of what the model with each leaves.
        statistic: of the test.
        parts: of which it is the larger one: misfit, Bayes factor.
        conformal: the null experiments' statistics.
        nulls: what those null experiments say of each effect.
    """

    conclusion: Conclusion
    named: tuple[int, ...]
    confident: tuple[int, ...]
    probability: Floats
    leftover: Floats
    statistic: float
    parts: tuple[float, float]
    conformal: GroupedConformal
    nulls: Weighing

    @property
    def p_value(self) -> float:
        """Of the base model."""
        return self.conformal.p(self.statistic)


def judge(own: Weighing, nulls: Weighing, kinds: NDArray[np.int64], *, level: float) -> Judged:
    """Judge one experiment.

    Args:
        own: of it alone.
        nulls: of null experiments.
        kinds: (null,) of their numerics.
        level: of the tests.
    """
    near = _near(own, nulls, kinds)
    nulls, kinds = nulls.rows(near.tolist()), kinds[near]
    statistics, null = _statistics(own)[0], _statistics(nulls)
    centre, spread = null.mean(axis=0), null.std(axis=0, ddof=1)
    parts = (statistics - centre) / spread
    scaled = np.empty(len(null))
    for kind in np.unique(kinds):
        rest, here = null[kinds != kind], kinds == kind
        scaled[here] = ((null[here] - rest.mean(axis=0)) / rest.std(axis=0, ddof=1)).max(axis=1)
    conformal = GroupedConformal(null=scaled, kinds=kinds)
    factors = own.factors[0]
    probability = np.exp(TEMPERED * factors - logsumexp(TEMPERED * factors))
    order = np.argsort(-probability)
    count = 1 + int(np.searchsorted(np.cumsum(probability[order]), CONFIDENCE - 1e-9))
    confident = tuple(int(place) for place in order[:count])
    leftover = np.array([
        GroupedConformal(null=nulls.left[:, place], kinds=kinds).p(float(own.left[0, place]))
        for place in range(len(own.effects))
    ])  # fmt: skip

    def judged(conclusion: Conclusion, named: tuple[int, ...] = ()) -> Judged:
        return Judged(
            conclusion=conclusion, named=named, confident=confident, probability=probability, leftover=leftover,
            statistic=float(parts.max()), parts=(float(parts[0]), float(parts[1])), conformal=conformal,
            nulls=nulls,
        )  # fmt: skip

    if not conformal.tests(level):
        return judged(Conclusion.UNTESTED)
    if conformal.p(float(parts.max())) > level:
        return judged(Conclusion.SUFFICIENT)
    # Where no effect helps more than the best one does in null experiments, none is named.
    if GroupedConformal(null=null[:, 1], kinds=kinds).p(float(statistics[1])) > level:
        return judged(Conclusion.OUTSIDE)
    if any(leftover[place] > level for place in confident):
        return judged(Conclusion.EFFECT if len(confident) == 1 else Conclusion.ONE_OF, confident)
    excess = float(own.misfit[0] - np.median(nulls.misfit))
    explained = float(own.misfit[0] - own.left[0, confident[0]])
    part = explained >= PART * excess
    return judged(Conclusion.PARTLY, confident[:1]) if part else judged(Conclusion.OUTSIDE)


def _near(own: Weighing, nulls: Weighing, kinds: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of each kind the half of its null experiments whose fitted cloths are nearest to an experiment's."""
    distance = np.square(nulls.cloth - own.cloth[0]).sum(axis=1)
    found = []
    for kind in np.unique(kinds):
        here = np.flatnonzero(kinds == kind)
        found.append(here[np.argsort(distance[here], kind="stable")[: math.ceil(NEAR * len(here))]])
    return np.sort(np.concatenate(found))


def _statistics(weighing: Weighing) -> Floats:
    """(n, 2) misfit of the base model, largest logarithm of a Bayes factor."""
    return np.stack([weighing.misfit, weighing.factors.max(axis=1)], axis=1)
