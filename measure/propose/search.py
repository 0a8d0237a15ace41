"""Which terms: forward selection, each by a calibrated statistic and by what it predicts of
recordings left out.

A term is looked at only if its statistic is beyond those of nulls at the level, the largest of
*all* terms compared with the largest of all (so that trying many costs power, not false positives).
Of those that are, the one that predicts best is taken, if it does so beyond chance; the next is
sought in what is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from measure.forecasting.calibrated_parameters import THETA
from measure.inference.segment_evidence import Evidence, gains
from measure.loop.validation import total_error
from measure.propose.family import Family

MOST = 3
_FAR = 2.0
"""Standard errors of held-out gain by which a further term must improve on those before; the first
must improve."""
_TIED = 1.0
"""Standard errors within which held-out gains say nothing, and the larger statistic leads."""
_APART = 0.7
"""Cosine of two columns' directions, beside what is always fitted, below which they are not the
same thing."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """One more term that was looked at.

    Attributes:
        name: of its column.
        column: place among the evidence's columns.
        statistic: calibrated, 1 in the mean of nulls.
        p_family: share of nulls in which any term's statistic is as large.
        gain: in log likelihood of left-out recordings, over the terms before.
        gain_error: its standard error.
        taken: whether it is one of the proposal's.
        reason: why it was not; empty where it was.
    """

    name: str
    column: int
    statistic: float
    p_family: float
    gain: float
    gain_error: float
    taken: bool
    reason: str


def search(
    evidence: Evidence,
    family: Family,
    names: tuple[str, ...],
    candidates: Sequence[int],
    *,
    acting: Sequence[int] = (),
    level: float,
) -> tuple[Step, ...]:
    """Searches the terms: returns those looked at, in order: those taken, and the one at which it
    ended.

    Args:
        names: of the evidence's columns.
        candidates: columns of the terms.
        acting: columns of effects that are known to act.
        level: of each step's test.
    """
    steps: list[Step] = []
    chosen = list(acting)
    while len(steps) < MOST:
        pool = [column for column in candidates if column not in chosen]
        if not pool:
            break
        step = _best(
            evidence, family, names, pool, chosen, candidates, level=level, first=not steps
        )
        steps.append(step)
        if not step.taken:
            break
        chosen.append(step.column)
    return tuple(steps)


def _best(
    evidence: Evidence,
    family: Family,
    names: tuple[str, ...],
    pool: Sequence[int],
    chosen: Sequence[int],
    candidates: Sequence[int],
    *,
    level: float,
    first: bool,
) -> Step:
    statistics = family.statistics(evidence, chosen)
    significant = [c for c in pool if family.p_value(float(statistics[c]), candidates) <= level]
    tested = significant or [max(pool, key=lambda column: float(statistics[column]))]
    held_out = gains(evidence, [list(chosen), *([*chosen, column] for column in tested)])
    increments = held_out[1:] - held_out[0]
    leader = int(np.argmax(increments.sum(axis=1)))
    behind = increments[leader] - increments
    tied = [
        index
        for index in range(len(tested))
        if behind[index].sum() <= _TIED * total_error(behind[index], evidence.recording)
    ]
    index = max(tied, key=lambda p: float(statistics[tested[p]]))
    gain, error = float(increments[index].sum()), total_error(increments[index], evidence.recording)
    reason = ""
    if not significant:
        reason = "nulls show as much"
    elif gain <= (0.0 if first else _FAR * error):
        reason = "it does not predict what was left out better than the model before"
    column = tested[index]
    return Step(
        name=names[column],
        column=column,
        statistic=float(statistics[column]),
        p_family=family.p_value(float(statistics[column]), candidates),
        gain=gain,
        gain_error=error,
        taken=not reason,
        reason=reason,
    )


def wrong(
    evidence: Evidence, pool: Sequence[int], taken: Sequence[int], acting: Sequence[int]
) -> list[int]:
    """Selects as many other columns as were taken, of other directions than theirs, that predict
    left-out recordings best.

    Fewer where there are not as many; none where there is none.

    Args:
        pool: columns to choose from.
        acting: columns of effects that are known to act.
    """
    close = _cosines(evidence, acting)
    others_by_direction = [
        c
        for c in pool
        if c not in taken and all(abs(close[c, column_taken]) < _APART for column_taken in taken)
    ]
    chosen: list[int] = []
    while others_by_direction and len(chosen) < len(taken):
        held_out = gains(
            evidence, [[*acting, *chosen, column] for column in others_by_direction]
        ).sum(axis=1)
        chosen.append(others_by_direction.pop(int(np.argmax(held_out))))
    return chosen


def _cosines(evidence: Evidence, acting: Sequence[int]) -> np.ndarray:
    """Computes cosines (column, column) of directions, beside the nuisances and some columns more;
    0 with those."""
    total = evidence.curvature.sum(axis=0)
    fixed = [*evidence.nuisance, *acting]
    priors = np.concatenate(
        [evidence.prior**-2, np.ones(len(evidence.nuisance) - len(THETA)), np.zeros(len(acting))]
    )
    inner = total[np.ix_(fixed, fixed)] + np.diag(priors)
    remaining = total - total[:, fixed] @ np.linalg.solve(inner, total[fixed])
    size = np.sqrt(np.maximum(np.diag(remaining), 1e-9 * np.diag(total)))
    return remaining / np.outer(size, size)
