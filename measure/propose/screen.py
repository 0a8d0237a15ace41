"""Which of many terms are worth nulls: those that predict best what they were not fitted to.

Errors are taken as they are here, neighbours in space and time as independent, and nothing is known of what numerics
leave: it is a ranking, not a test. The test against nulls, and that on untouched data, come after (`propose`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from measure.loop.columns import PRIOR, THETA, Column, EffectColumn
from measure.loop.forecast import Forecaster, Segments
from measure.loop.statistics import Statistics
from measure.propose.sensitivities import statistics
from measure.propose.terms import Term, TermColumn

Floats = NDArray[np.float64]

SHORT = 12
"""Terms that are shortlisted."""
_LEADERS, _BESIDE = 6, 3
"""Of them the best alone, and the best beside the first; the others are the best of another direction."""
_APART = 0.7
"""Cosine below which two terms are of different directions."""
_MOVES = (0.12, 0.06)
"""By which the places of local terms are improved, as shares of width and height."""
_CLOSE = 0.8
"""A local term with this share of the best one's gain is worth a better place."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Screened:
    """What a screening says.

    Attributes:
        columns: the shortlist, best first.
        gains: name of every term that was tried → share of what the best term gains on data it was not fitted to.
    """

    columns: tuple[EffectColumn, ...]
    gains: dict[str, float]


def screen(
    forecaster: Forecaster, segments: Segments, candidates: Sequence[EffectColumn], beside: Sequence[Column] = ()
) -> Screened:
    """The shortlist of candidates beside columns that are known to act."""
    tried = list(candidates)
    table = Table.of(statistics(forecaster, segments, [*beside, *tried]), len(THETA) + len(beside))
    gains = dict(zip(tried, table.gains(), strict=True))
    for size in _MOVES:
        moved = _moved(gains, size)
        if not moved:
            break
        extra = Table.of(statistics(forecaster, segments, [*beside, *moved]), len(THETA) + len(beside))
        gains |= dict(zip(moved, extra.gains(), strict=True))
    if len(gains) > len(tried):
        best = max(gains, key=lambda column: gains[column])
        tried = [best, *(column for column in tried if column is not best)]
        table = Table.of(statistics(forecaster, segments, [*beside, *tried]), len(THETA) + len(beside))
    top = max(max(gains.values()), 1e-300)
    return Screened(
        columns=tuple(tried[place] for place in table.shortlist(SHORT)),
        gains={column.name: gain / top for column, gain in gains.items()},
    )


def _moved(gains: dict[EffectColumn, float], size: float) -> list[TermColumn]:
    """The best local term at places nearby, if it is among the best at all."""
    first = max(gains.values())
    near = [c for c in gains if isinstance(c, TermColumn) and c.term.at.place and gains[c] >= _CLOSE * first]
    if not near or first <= 0:
        return []
    best = max(near, key=lambda column: gains[column]).term
    steps = np.array(np.meshgrid(*[(-size, 0.0, size)] * len(best.at.place))).reshape(len(best.at.place), -1).T
    known = {column.name for column in gains}
    terms: dict[str, Term] = {term.name: term for term in (best.moved(*step) for step in steps.tolist())}
    return [column for column in map(TermColumn.of, terms.values()) if column.name not in known]


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Normal equations of all columns, by fold.

    Attributes:
        curvature: (fold, column, column) Σ s_i·s_j of weighted sensitivities.
        score: (fold, column) Σ s_i·e.
        fixed: how many columns are always fitted; the calibrated parameters first.
    """

    curvature: Floats
    score: Floats
    fixed: int

    @classmethod
    def of(cls, found: Statistics, fixed: int) -> Table:
        """Folds are the recordings, or the halves of a single one."""
        length = np.diagonal(found.response, axis1=1, axis2=2)
        curvature, score = found.response * length[:, :, None], found.r * length
        fold = found.recording
        if len(np.unique(fold)) < 2:
            fold = (np.arange(len(fold)) >= len(fold) / 2).astype(np.int64)
        folds = [fold == index for index in np.unique(fold)]
        return cls(
            curvature=np.stack([curvature[own].sum(axis=0) for own in folds]),
            score=np.stack([score[own].sum(axis=0) for own in folds]), fixed=fixed,
        )  # fmt: skip

    def gains(self, beside: Sequence[int] = ()) -> Floats:
        """(candidate,) by how much each lowers the squared errors of folds it was not fitted to, the fixed columns and
        some more fitted with it and without."""
        shared = [*range(self.fixed), *(self.fixed + place for place in beside)]
        result = np.zeros(self.score.shape[1] - self.fixed)
        for out in range(len(self.score)):
            inner, outer = self.curvature.sum(axis=0) - self.curvature[out], self.curvature[out]
            slope, seen = self.score.sum(axis=0) - self.score[out], self.score[out]
            base = _gain(inner, slope, outer, seen, shared)
            for place in range(len(result)):
                if place not in beside:
                    result[place] += _gain(inner, slope, outer, seen, [*shared, self.fixed + place]) - base
        return result

    def cosines(self) -> Floats:
        """(candidate, candidate) of the terms' directions, beside the fixed columns."""
        total = _with_prior(self.curvature.sum(axis=0))
        first = slice(0, self.fixed)
        own = total[self.fixed :, self.fixed :] - total[self.fixed :, first] @ np.linalg.solve(
            total[first, first], total[first, self.fixed :]
        )
        size = np.sqrt(np.maximum(np.diag(own), 1e-12 * np.diag(total)[self.fixed :]))
        return own / np.outer(size, size)

    def shortlist(self, count: int) -> list[int]:
        """Candidates, best first: the best alone, the best beside the first, the best of other directions."""
        alone = self.gains()
        order = np.argsort(-alone, kind="stable").tolist()
        first = order[0]
        beside = np.argsort(-self.gains([first]), kind="stable").tolist()
        apart = [place for place in order if abs(self.cosines()[first, place]) < _APART]
        chosen = dict.fromkeys(order[:_LEADERS])
        for ranking, until in ((beside, _LEADERS + _BESIDE), (apart, count), (order, count)):
            for place in ranking:
                if len(chosen) >= until:
                    break
                chosen.setdefault(place)
        return list(chosen)[:count]


def _gain(inner: Floats, slope: Floats, outer: Floats, seen: Floats, active: list[int]) -> float:
    """By how much a fit to the inside lowers the squared errors outside."""
    value = np.linalg.solve(_with_prior(inner)[np.ix_(active, active)], slope[active])
    gain = float(2 * value @ seen[active] - value @ outer[np.ix_(active, active)] @ value)
    return gain if math.isfinite(gain) else -math.inf


def _with_prior(curvature: Floats) -> Floats:
    held = curvature.copy()
    places = range(len(THETA))
    held[places, places] += PRIOR**-2
    return held
