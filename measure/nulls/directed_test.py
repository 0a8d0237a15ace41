"""Is anything missing, and which way: one test along the directions in which effects move an
experiment.

An experiment is one vector x of summaries. Of kinds of nulls, in which nothing acts, and of data

    x = μ(u) + U ξ + D δ + ε,   ε of covariance s² V,

u what the mean moves with, U what is not known (calibrated parameters, logs of the wind) by a
standard deviation of each, D what effects of strengths δ do. μ is a ridge regression on u. V is
that of the kinds about it, shrunk (Ledoit and Wolf, Journal of Multivariate Analysis 88:365, 2004)
towards a multiple of the covariance C within kinds, so that a column counts in units of chance. s
is how the size of ε goes with the damping, ln s quadratic in its logarithm.

With W = s² V + U Uᵀ an effect that is expected to be δ strong stands at

    z = dᵀ W⁻¹ (x − μ) / √(dᵀ W⁻¹ d) · √(h/(h + 1/(a δ)²)),

the best linear discriminant of this direction where the design shows the effect. h is dᵀ W⁻¹ d of
kinds, their median: where the design does not show it, what is left along d is chance, and the
factor makes nothing of it. It is not that of data, whose d is in units of their own errors: an
effect that makes most of these would hide itself. z
of each kind is computed by all others, and z of data and of kinds is standardised by the mean and
the spread of the others'; no spread is less than the mean one of all effects, each weighed by how
much of it the design shows. The statistic is the largest z of all effects, each with the signs that
it may have.

An effect that is named is free: W is infinite along it, for kinds as for data, and the same test
says whether anything is missing beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray
from models.trained.outliers import shrunk_covariance

SHOWN = 0.25
"""a: the design shows an effect where a quarter of its expected strength is a standard error. Of
0.1, 0.25, 0.5 and 1 all see as many of 78 effects at 5 %, to two, and a quarter most at 2 %."""
_OWN_VARIANCE = 0.1
"""Share of C that is its diagonal alone."""
_SLOPES, _SIZES = 1.0, 3.0
"""Ridge penalties of μ on u, and of ln s, in units of one kind."""
_DAMPINGS = 1.5
"""Logarithm of a damping that ln s is a polynomial in, in units of its prior's width."""
_TINY = 1e-9


@dataclass(frozen=True, kw_only=True)
class Sought:
    """An effect that is tested for.

    Attributes:
        name: of it.
        expected: strength, in the unit of the directions.
        signs: 1, −1 or both.
    """

    name: str
    expected: float
    signs: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Summary:
    """An experiment as one vector.

    Attributes:
        values: (column,) x.
        directions: (column, effect) D.
        unknown: (column, k) U.
        covariates: (covariate,) u, about a usual value of each.
        damping: logarithm of its ratio to the usual one.
    """

    values: FloatArray
    directions: FloatArray
    unknown: FloatArray
    covariates: FloatArray
    damping: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class _Scored:
    """Scores of one experiment that are not standardised.

    Attributes:
        z: (effect,).
        information: (effect,) dᵀ W⁻¹ d.
        moved: (effect, effect) how z of the first moves with a unit of the second.
    """

    z: FloatArray
    information: FloatArray
    moved: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class _Learnt:
    """What kinds show of experiments in which nothing acts.

    Attributes:
        mean: (1 + covariate, column) of μ.
        width: (column,) by which columns are divided.
        covariance: (column, column) V of columns over `width`.
        sizes: (3,) of ln s.
    """

    mean: FloatArray
    width: FloatArray
    covariance: FloatArray
    sizes: FloatArray

    @classmethod
    def of(cls, kinds: Sequence[Summary], within: Sequence[FloatArray]) -> _Learnt:
        features = np.stack([_with_one(kind.covariates) for kind in kinds])
        values = np.stack([kind.values for kind in kinds])
        mean = _ridge(features, values, _SLOPES)
        residuals = values - features @ mean
        relative = residuals / (residuals.std(axis=0) + _TINY)
        powers = np.stack([_powers(kind.damping) for kind in kinds])
        sizes = _ridge(powers, np.log((relative**2).mean(axis=1) + _TINY) / 2, _SIZES)
        residuals = residuals / np.exp(powers @ sizes)[:, None]
        width = residuals.std(axis=0) + _TINY
        chance = np.concatenate(within) / width
        of_chance = chance.T @ chance / len(chance)
        diagonal = np.diag(np.diag(of_chance))
        of_chance = (1 - _OWN_VARIANCE) * of_chance + _OWN_VARIANCE * diagonal
        of_chance += 1e-6 * np.diag(of_chance).mean() * np.eye(len(of_chance))
        factor = np.linalg.cholesky(of_chance)
        shrunk, _ = shrunk_covariance(np.linalg.solve(factor, (residuals / width).T).T)
        return cls(mean=mean, width=width, covariance=factor @ shrunk @ factor.T, sizes=sizes)

    def score(self, summary: Summary, free: Sequence[int]) -> _Scored:
        """Scores an experiment, some effects free."""
        size = math.exp(2 * float(_powers(summary.damping) @ self.sizes))
        unknown = summary.unknown / self.width[:, None]
        directions = summary.directions / self.width[:, None]
        left = (summary.values - _with_one(summary.covariates) @ self.mean) / self.width
        covariance = size * self.covariance + unknown @ unknown.T
        solved = np.linalg.solve(covariance, np.c_[directions, left])
        if free:
            along = directions[:, list(free)]
            inner = along.T @ solved[:, list(free)]
            solved = solved - solved[:, list(free)] @ (np.linalg.pinv(inner) @ (along.T @ solved))
        moved, gained = directions.T @ solved[:, :-1], directions.T @ solved[:, -1]
        information = np.maximum(np.diag(moved), 0.0)
        scale = np.sqrt(np.maximum(information, _TINY**2))
        return _Scored(z=gained / scale, information=information, moved=moved / scale[:, None])


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectedScores:
    """How far an experiment and the kinds of nulls go the way of each effect.

    Attributes:
        sought: the effects.
        tested: (effect,) whether each is: all but those that are free.
        z: (effect,) of the experiment.
        null: (kind, effect) of the kinds.
        moved: (kind, effect, effect) how z of the first moves with a unit of the second, in kinds.
    """

    sought: tuple[Sought, ...]
    tested: BoolArray
    z: FloatArray
    null: FloatArray
    moved: FloatArray

    @cached_property
    def largest(self) -> FloatArray:
        """(effect,) z with the sign, of those that the effect may have, by which it is largest."""
        return self._with_signs(self.z)

    @property
    def farthest(self) -> float:
        """The statistic."""
        return float(self.largest.max())

    @cached_property
    def of_kinds(self) -> FloatArray:
        """(kind,) the statistic of each kind by all others."""
        return self._with_signs(self.null).max(axis=-1)

    def of_kinds_along(self, effect: int) -> FloatArray:
        """Returns `largest` of one effect of each kind by all others, (kind,)."""
        return self._with_signs(self.null)[:, effect]

    def of_kinds_with(self, effect: int, coefficient: float) -> FloatArray:
        """Computes the statistic of each kind, were an effect to act on it, (kind,)."""
        return self._with_signs(self.null + coefficient * self.moved[:, :, effect]).max(axis=-1)

    def along(self, effect: int, sign: int) -> tuple[float, FloatArray]:
        """Returns the statistic along one effect alone, of the experiment and of kinds, (kind,)."""
        return sign * float(self.z[effect]), sign * self.null[:, effect]

    def within(self, deviations: float) -> list[int]:
        """Lists the effects that are so close to the first, the first before all others."""
        order = np.argsort(-self.largest)
        return [int(i) for i in order if self.largest[i] >= self.farthest - deviations]

    def _with_signs(self, z: FloatArray) -> FloatArray:
        signs = [max(one.signs) for one in self.sought], [min(one.signs) for one in self.sought]
        return np.where(self.tested, np.maximum(*(np.array(sign) * z for sign in signs)), -np.inf)


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectedTest:
    """The test by some kinds of nulls.

    Attributes:
        sought: effects, in the order of the directions.
        kinds: one experiment of each.
        all_kinds: what all of them show.
        others: what all but each one show.
    """

    sought: tuple[Sought, ...]
    kinds: tuple[Summary, ...]
    all_kinds: _Learnt
    others: tuple[_Learnt, ...]

    @classmethod
    def of(
        cls, sought: Sequence[Sought], kinds: Sequence[Summary], within: Sequence[FloatArray]
    ) -> DirectedTest:
        """Learns from kinds.

        Args:
            within: of each kind (segment, column) deviations of segments from the mean of their
                recordings.
        """
        places = range(len(kinds))
        without = [[place for place in places if place != kind] for kind in places]
        return cls(
            sought=tuple(sought),
            kinds=tuple(kinds),
            all_kinds=_Learnt.of(kinds, within),
            others=tuple(
                _Learnt.of([kinds[i] for i in left], [within[i] for i in left]) for left in without
            ),
        )

    def scores(self, summary: Summary, free: Sequence[int] = ()) -> DirectedScores:
        """Scores an experiment.

        Args:
            free: effects whose strength is free.
        """
        weak = np.array([(SHOWN * one.expected) ** -2 for one in self.sought])
        scored = [
            others.score(kind, free) for others, kind in zip(self.others, self.kinds, strict=True)
        ]
        information = np.median([one.information for one in scored], axis=0)
        shown = information / (information + weak)
        factor, own = np.sqrt(shown), self.all_kinds.score(summary, free)
        z = factor * np.stack([one.z for one in scored])
        usual = [_usual(np.delete(z, kind, axis=0), shown) for kind in range(len(z))]
        centre, spread = _usual(z, shown)
        tested = np.ones(len(weak), dtype=bool)
        tested[list(free)] = False
        return DirectedScores(
            sought=self.sought,
            tested=tested,
            z=(factor * own.z - centre) / spread,
            null=np.stack([(z[k] - usual[k][0]) / usual[k][1] for k in range(len(z))]),
            moved=np.stack(
                [(factor / usual[k][1])[:, None] * one.moved for k, one in enumerate(scored)]
            ),
        )


def beside(
    first: FloatArray, second: FloatArray, value: float, *, share: float
) -> tuple[FloatArray, float]:
    """Brings a second test's statistic, of kinds (kind,) and of data, onto the scale of the first's
    (kind,), so that of both the larger one has a share of the level for the second.

    Both are the largest of many, whose tails fall by exp(−π u/√6), u in standard deviations
    (Gumbel): the second counts as far as it is out, less √6/π ln((1 − share)/share). This alone is
    a model; how rare the larger one is, is counted. A kind's scales are those of all others.
    """
    behind = math.sqrt(6) / math.pi * math.log((1 - share) / share)

    def scaled(kinds: FloatArray, others: FloatArray, values: float) -> float:
        out = (values - others.mean()) / (others.std(ddof=1) + _TINY)
        return float(kinds.mean() + kinds.std(ddof=1) * (out - behind))

    of_kinds = [
        scaled(np.delete(first, kind), np.delete(second, kind), float(second[kind]))
        for kind in range(len(first))
    ]
    return np.array(of_kinds), scaled(first, second, value)


def _ridge(features: FloatArray, values: FloatArray, penalty: float) -> FloatArray:
    """Fits values (kind, …) by features (kind, feature) whose first is 1 and is not drawn to 0."""
    penalties = np.full(features.shape[1], penalty)
    penalties[0] = _TINY
    solved = np.linalg.solve(features.T @ features + np.diag(penalties), features.T @ values)
    return np.asarray(solved, dtype=np.float64)


def _with_one(covariates: FloatArray) -> FloatArray:
    return np.concatenate([np.ones(1), covariates])


def _powers(damping: float) -> FloatArray:
    """Computes what ln s is linear in."""
    scaled = damping / _DAMPINGS
    return np.array([1.0, scaled, scaled**2 / 2])


def _usual(z: FloatArray, shown: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Computes mean and spread of z of kinds (kind, effect), (effect,) each.

    Args:
        shown: (effect,) how much of it the design shows, from 0 to 1.
    """
    spread = z.std(axis=0, ddof=1)
    common = math.sqrt(float((shown * spread**2).sum() / max(float(shown.sum()), _TINY)))
    return z.mean(axis=0), np.maximum(spread, max(common, _TINY))
