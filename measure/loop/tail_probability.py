"""How rare a statistic is among groups of nulls of which those of one kind of numerics are alike.

What is rare, few kinds say. Beyond the groups' highest tenth the distribution is taken for an exponential tail, whose
mean excess m is known as that of as many independent draws as kinds k reach it; the chance of the next draw at an
excess x is then (1 + x/(k m))^(−k). (Peaks over a threshold: Davison and Smith, J. R. Stat. Soc. B 52:393, 1990; for
tests of few permutations: Knijnenburg et al., Bioinformatics 25:i161, 2009.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flagdata.rng import stream
from measure.loop.criteria import CRITERIA

Floats = NDArray[np.float64]

_RESAMPLES = 400


def share_as_large(null: Floats, value: float) -> float:
    """Share of the nulls (group,) as large, the value itself counted: a permutation test's p, never 0."""
    return (1 + int((null >= value).sum())) / (1 + len(null))


@dataclass(frozen=True, kw_only=True, eq=False)
class TailProbability:
    """Of a statistic that is large where something is missing.

    Attributes:
        null: (group,) the statistic of groups of nulls.
        kinds: (group,) of numerics.
    """

    null: Floats
    kinds: NDArray[np.int64]

    def p(self, value: float) -> float:
        """Chance of a null as large: the share of groups, beyond their highest tenth by the tail; never less than
        1/(1 + groups)."""
        if value <= self._threshold or self._reaching == 0:
            return share_as_large(self.null, value)
        excess = (value - self._threshold) / (self._reaching * self._mean)
        return max(CRITERIA.tail * (1 + excess) ** -self._reaching, self._least)

    def critical(self, level: float) -> float | None:
        """The statistic beyond which the chance is at most `level`; None where there are too few groups for any."""
        if level < self._least:
            return None
        if level <= CRITERIA.tail and self._reaching:
            excess = (CRITERIA.tail / level) ** (1 / self._reaching) - 1
            return self._threshold + self._reaching * self._mean * excess
        larger = np.sort(self.null)[::-1]
        allowed = int(level * (1 + len(larger)) + 1e-9) - 1
        return float(larger[allowed])

    def interval(self, value: float, *, level: float) -> tuple[float, float]:
        """Of the chance, for what kinds of numerics happen to be among the nulls: by drawing kinds anew (bootstrap)."""
        rng = stream(0, "null", "tail")
        numbers, place = np.unique(self.kinds, return_inverse=True)
        members = [np.flatnonzero(place == k) for k in range(len(numbers))]
        found = np.empty(_RESAMPLES)
        for index in range(_RESAMPLES):
            drawn = [members[k] for k in rng.integers(len(members), size=len(members))]
            drawn_anew = np.concatenate(drawn)
            own = np.repeat(np.arange(len(drawn)), [len(part) for part in drawn])
            found[index] = TailProbability(null=self.null[drawn_anew], kinds=own).p(value)
        low, high = np.quantile(found, [(1 - level) / 2, (1 + level) / 2])
        return float(low), float(high)

    @cached_property
    def _threshold(self) -> float:
        return float(np.quantile(self.null, 1 - CRITERIA.tail))

    @cached_property
    def _beyond(self) -> NDArray[np.bool_]:
        return self.null > self._threshold

    @cached_property
    def _reaching(self) -> int:
        """How many kinds have groups in the tail."""
        return len(np.unique(self.kinds[self._beyond]))

    @cached_property
    def _mean(self) -> float:
        return float((self.null[self._beyond] - self._threshold).mean())

    @property
    def _least(self) -> float:
        return 1 / (1 + len(self.null))
