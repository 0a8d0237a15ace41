"""The verdict's numbers: does the base model suffice, and if not, which effects may be what it lacks.

Whether anything is missing is decided by the score test (`measure.films.score_test`): its statistic is counted among
those of null flags.

Given that something is missing, effects have posterior probabilities with equal priors. The confidence set is the
smallest that has 95 % of it; a name is given alone only where one effect has as much. None is named where what was
found lies along no effect's direction. A model with one of them has to pass the test of its own misfit, against that of
null flags with the same effect fitted to them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from flagdata.arrays import FloatArray, IntArray
from measure.films.score_test import Scored
from measure.films.weigh import Misfits, Weighing
from measure.nulls.clustered import ClusteredNulls
from measure.verdict.decided import undecided
from measure.verdict.record import Conclusion

TEMPERED = 0.5
"""Share of the Bayes factors' logarithms that counts: regressions of an effect from 16 pairs err in the same way in all
recordings (decision 046)."""
CONFIDENCE = 0.95
"""Of the set of effects that may be what is missing."""
PART = 0.25
"""Share of the misfit beyond that of null flags which an effect that is called a part takes away."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """What was decided.

    Attributes:
        conclusion: see `Conclusion`.
        named: places of the effects named among those weighed, most probable first.
        confident: places of the confidence set's, most probable first.
        probability: (effect,) given that one of them is missing.
        leftover: (effect,) p of what the model with each leaves.
        scored: the test.
        open: why the base model is neither rejected nor said to suffice, sentences; empty where it is.
    """

    conclusion: Conclusion
    named: tuple[int, ...]
    confident: tuple[int, ...]
    probability: FloatArray
    leftover: FloatArray
    scored: Scored
    open: tuple[str, ...] = ()

    @property
    def p_value(self) -> float:
        """Of the base model."""
        return self.scored.p_value


def judge(own: Weighing, nulls: Misfits, kinds: IntArray, scored: Scored, *, level: float, departure: float) -> Judged:
    """Judge one experiment.

    Args:
        own: of it alone.
        nulls: what models leave of null flags.
        kinds: (null,) of their numerics.
        scored: how it was tested.
        level: of the tests.
        departure: root mean square departure of its observables from the base model fitted to it [their scatters].
    """
    nulls, kinds = nulls.rows(np.flatnonzero(scored.alike).tolist()), kinds[scored.alike]
    factors = own.factors[0]
    probability = np.exp(TEMPERED * factors - logsumexp(TEMPERED * factors))
    order = np.argsort(-probability)
    count = 1 + int(np.searchsorted(np.cumsum(probability[order]), CONFIDENCE - 1e-9))
    confident = tuple(int(place) for place in order[:count])
    leftover = np.array(
        [
            ClusteredNulls(null=nulls.left[:, place], kinds=kinds).p(float(own.misfits.left[0, place]))
            for place in range(len(own.effects))
        ]
    )

    def judged(conclusion: Conclusion, named: tuple[int, ...] = (), reasons: tuple[str, ...] = ()) -> Judged:
        return Judged(
            conclusion=conclusion,
            named=named,
            confident=confident,
            probability=probability,
            leftover=leftover,
            scored=scored,
            open=reasons,
        )

    if not scored.nulls.tests(level):
        return judged(Conclusion.UNTESTED)
    if scored.p_value > level:
        reasons = undecided(scored.p_value, level=level, departure=departure, power=scored.tested.tolist())
        return judged(Conclusion.UNDECIDED if reasons else Conclusion.SUFFICIENT, reasons=reasons)
    if not scored.pointed:
        return judged(Conclusion.OUTSIDE)
    if any(leftover[place] > level for place in confident):
        return judged(Conclusion.EFFECT if len(confident) == 1 else Conclusion.ONE_OF, confident)
    excess = float(own.misfits.base[0] - np.median(nulls.base))
    explained = float(own.misfits.base[0] - own.misfits.left[0, confident[0]])
    part = explained >= PART * excess
    return judged(Conclusion.PARTLY, confident[:1]) if part else judged(Conclusion.OUTSIDE)
