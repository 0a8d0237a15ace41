"""How rare a statistic is among null flags that come in kinds of numerics and are alike within a
kind to some degree.

n flags of kinds of m each, whose statistic has the intraclass correlation ρ, show as much of how
often one more flag is as far as

    n' = n / (1 + (m − 1) ρ)

independent ones do (Kish, Survey Sampling, 1965, section 5.4), so that with s the share of flags
that are as far as t

    p(t) = (1 + n' s(t)) / (1 + n').

Where flags of a kind are as unlike as those of two kinds (ρ = 0) this is the count of flags, and
where they are all alike (ρ = 1) that of kinds. ρ is estimated by the analysis of variance of the
statistic's normal scores, which heavy tails do not move, and is 0 where the estimate is negative.
Beside it stands the tail of Student's t with n' − 1 degrees of freedom about the flags' mean, which
extrapolates and decides nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtri
from scipy.stats import rankdata, t

from flagdata.core.arrays import FloatArray, IntArray
from measure.nulls.conformal import MOST_KINDS
from measure.shares import clopper_pearson


@dataclass(frozen=True, kw_only=True, eq=False)
class ClusteredNulls:
    """How rare values of a statistic are that is large where something is missing.

    Attributes:
        null: (flag,) the statistic of null flags.
        kinds: (flag,) of numerics.
    """

    null: FloatArray
    kinds: IntArray

    @cached_property
    def count(self) -> int:
        """How many kinds there are."""
        return len(np.unique(self.kinds))

    @cached_property
    def correlation(self) -> float:
        """Estimates ρ of normal scores, from 0 to 1; 1 of a single kind, which shows nothing of
        it."""
        if self.count < 2:
            return 1.0
        if self.count == len(self.null):
            return 0.0
        scores = ndtri((rankdata(self.null) - 0.5) / len(self.null))
        _, kind, sizes = np.unique(self.kinds, return_inverse=True, return_counts=True)
        means = np.bincount(kind, scores) / sizes
        between = float((sizes * np.square(means - scores.mean())).sum()) / (self.count - 1)
        within = float(np.square(scores - means[kind]).sum()) / (len(scores) - self.count)
        total = between + (self._flags_a_kind - 1) * within
        return min(max((between - within) / total, 0.0), 1.0) if total > 0 else 0.0

    @cached_property
    def effective(self) -> float:
        """n', how many independent flags say as much."""
        return len(self.null) / (1 + (len(self.null) / self.count - 1) * self.correlation)

    @property
    def least(self) -> float:
        """The smallest p that there can be."""
        return 1 / (1 + self.effective)

    def tests(self, level: float) -> bool:
        """Returns whether any statistic can be rejected at a level."""
        return self.count >= self.kinds_needed(level)

    def kinds_needed(self, level: float) -> int:
        """Computes the fewest kinds, as large and as alike as these, by which a level can be
        tested."""
        return math.ceil((1 / level - 1) * self.count / self.effective - 1e-9)

    def p(self, value: float) -> float:
        """Computes p of a statistic, the data themselves counted as a flag that is as far."""
        return (1 + self.effective * self._share(value)) / (1 + self.effective)

    def tail(self, value: float) -> float:
        """Computes, beside p, the share of Student's t that is as far, by the flags' mean and
        standard deviation."""
        freedom = self.effective - 1
        spread = float(self.null.std(ddof=1)) * math.sqrt(1 + 1 / self.effective)
        return float(t.sf((value - float(self.null.mean())) / spread, freedom))

    def critical(self, level: float) -> float | None:
        """Computes the statistic beyond which p is at most `level`; None where the level cannot be
        tested."""
        if not self.tests(level):
            return None
        return max(float(value) for value in np.unique(self.null) if self.p(float(value)) > level)

    def interval(self, value: float, *, level: float) -> tuple[float, float]:
        """Computes the interval of the share of all flags, simulated or not, that are at least as
        far, by which happen to be among the nulls (Clopper and Pearson's interval of n' flags)."""
        return clopper_pearson(self._share(value) * self.effective, self.effective, level=level)

    def settling(self, value: float, *, at: float, level: float) -> int | None:
        """Computes the fewest kinds, no fewer than there are, whose `interval` would not hold a
        share `at`, if the same share of their flags is as far; None beyond `MOST_KINDS`."""
        share, flags_a_kind = self._share(value), self.effective / self.count

        def holds(count: int) -> bool:
            low, high = clopper_pearson(
                share * count * flags_a_kind, count * flags_a_kind, level=level
            )
            return low <= at <= high

        if holds(MOST_KINDS):
            return None
        return next(
            (count for count in range(self.count, MOST_KINDS) if not holds(count)), MOST_KINDS
        )

    def _share(self, value: float) -> float:
        return float((self.null >= value).mean())

    @property
    def _flags_a_kind(self) -> float:
        """Counts flags of a kind, as the analysis of variance of kinds of several sizes counts
        them."""
        _, sizes = np.unique(self.kinds, return_counts=True)
        return (len(self.null) - float(np.square(sizes).sum()) / len(self.null)) / (self.count - 1)
