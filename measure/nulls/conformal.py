"""How rare a statistic is among null experiments, counted by their kinds of numerics.

Recordings of one kind of numerics are alike, so that the number of kinds, and not of recordings,
says how rare anything can be. If the data are one more kind that is exchangeable with the K of the
nulls, and their statistic is one drawn from among those that groups of their kind have, then

    p(t) = (1 + Σ_k s_k(t)) / (K + 1),   s_k(t) the share of the groups of kind k that are at least
                                         as far as t,

is at most α in a share α of experiments or fewer, whatever the distribution of the statistic within
kinds and among them (conformal prediction with hierarchical data: Lee, Barber and Willett,
arXiv:2306.06342; Dunn, Wasserman and Ramdas, J. Am. Stat. Assoc. 118:2491, 2023). Many groups of a
kind count no more than one, and only make s_k smoother than the 0 or 1 of a single draw. Nothing is
extrapolated: p is never less than 1/(K + 1), and a level below that cannot be tested.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from measure.shares import clopper_pearson

MOST_KINDS = 1000
"""Kinds of numerics beyond which none are proposed: 1,000 take some six hours of a core."""


def kinds_needed(level: float) -> int:
    """Computes the fewest kinds of numerics by which a level can be tested: K + 1 ≥ 1/level."""
    return math.ceil(1 / level - 1e-9) - 1


@dataclass(frozen=True, kw_only=True, eq=False)
class GroupedConformal:
    """How rare values of a statistic are that is large where something is missing.

    Attributes:
        null: (group,) the statistic of groups of nulls.
        kinds: (group,) of numerics.
    """

    null: FloatArray
    kinds: IntArray

    @cached_property
    def count(self) -> int:
        """K, how many kinds there are."""
        return len(np.unique(self.kinds))

    @property
    def least(self) -> float:
        """The smallest p that there can be."""
        return 1 / (1 + self.count)

    def tests(self, level: float) -> bool:
        """Returns whether any statistic can be rejected at a level."""
        return self.count >= kinds_needed(level)

    def p(self, value: float) -> float:
        """Computes p of a statistic, the data themselves counted as a kind that is as far."""
        return (1 + self._as_far(value)) / (1 + self.count)

    def critical(self, level: float) -> float | None:
        """Computes the statistic beyond which p is at most `level`; None where the level cannot be
        tested."""
        if not self.tests(level):
            return None
        return max(float(value) for value in np.unique(self.null) if self.p(float(value)) > level)

    def interval(self, value: float, *, level: float) -> tuple[float, float]:
        """Computes the interval of the share of all kinds, simulated or not, that are at least as
        far, by how many kinds happen to be among the nulls (Clopper and Pearson's interval, with
        sums of shares in place of counts)."""
        return clopper_pearson(self._as_far(value), self.count, level=level)

    def settling(self, value: float, *, at: float, level: float) -> int | None:
        """Computes the fewest kinds, no fewer than there are, whose `interval` would not hold a
        share `at`, if the same share of them is as far; None beyond `MOST_KINDS`."""
        share = self._as_far(value) / self.count

        def holds(count: int) -> bool:
            low, high = clopper_pearson(share * count, count, level=level)
            return low <= at <= high

        if holds(MOST_KINDS):
            return None
        # The interval narrows about the share, so that it holds `at` up to some count and then no
        # more.
        return next(
            (count for count in range(self.count, MOST_KINDS) if not holds(count)), MOST_KINDS
        )

    def quantile(self, share: float) -> float:
        """Computes the value that one more kind does not exceed with a chance of `share` or more;
        infinite where there are too few kinds for it."""
        order = np.argsort(self.null)
        below = np.cumsum(self._weight[order])
        rank = int(np.searchsorted(below, share * (1 + self.count) - 1e-9))
        return float(self.null[order][rank]) if rank < len(order) else math.inf

    def _as_far(self, value: float) -> float:
        """Sums, over the kinds, the share of each one's groups that are at least as far."""
        return float(self._weight[self.null >= value].sum())

    @cached_property
    def _weight(self) -> FloatArray:
        """Weighs each group by one over how many groups its kind has, (group,)."""
        _, kind, counts = np.unique(self.kinds, return_inverse=True, return_counts=True)
        return 1 / counts[kind]
