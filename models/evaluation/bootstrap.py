"""Intervals over sequences: clips of one simulation are not independent, so whole groups are drawn
with replacement.

Percentile bootstrap of clusters (Davison and Hinkley, Bootstrap Methods and their Application,
1997, sections 3.8 and 5.3). Scores are functions of sums over clips, so a draw is a vector of how
often each group occurs, and its sums are one matrix product. Two models that are scored with the
same `Resamples` are compared pair by pair.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flagdata.answer.quantity import Bound, Quantity, Span
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError

LEVEL = 0.90
DRAWS = 2000


@dataclass(frozen=True, kw_only=True)
class ScoreEstimate:
    """A score, and what it rests on.

    Attributes:
        quantity: of the data, with its percentile interval of `LEVEL`; without a value where it is
            undefined (a correlation with a constant), and without ends with fewer than two groups,
            which say nothing about others.
        clips, groups: how many the value rests on.
    """

    JSON_NAMES: ClassVar = ("value", "interval", "level=quantity.level", "clips", "groups")

    quantity: Quantity
    clips: int
    groups: int

    @property
    def value(self) -> float:
        """Of the data; NaN where it is undefined."""
        return math.nan if self.quantity.value is None else self.quantity.value

    @property
    def interval(self) -> tuple[float, float] | None:
        """Returns its ends; None where the groups are too few for any."""
        return None if self.quantity.bound is Bound.NOTHING else self.quantity.interval


@dataclass(frozen=True, kw_only=True, eq=False)
class Resamples:
    """The data and draws of its groups with replacement.

    Attributes:
        index: (n,) the group of each clip, 0 to G - 1.
        counts: (1 + draws, G) how often each group occurs; the first row is all ones, the data
            themselves.
    """

    index: IntArray
    counts: FloatArray

    @classmethod
    def of(
        cls, group: IntArray, *, generator: np.random.Generator, draws: int = DRAWS
    ) -> Resamples:
        """Draws from the groups of clips.

        Args:
            group: (n,) label of each clip's group.
            generator: of the draws; a named stream.
            draws: how many, at least 1.
        """
        if draws < 1:
            raise InputError(
                f"{draws} bootstrap draws are too few",
                where="draws",
                fix=f"give at least 1; {DRAWS} is usual",
            )
        labels, index = np.unique(group, return_inverse=True)
        size = len(labels)
        drawn = generator.multinomial(size, np.full(size, 1 / size), size=draws)
        return cls(
            index=index.astype(np.int64),
            counts=np.vstack([np.ones((1, size)), drawn.astype(np.float64)]),
        )

    @property
    def groups(self) -> int:
        return self.counts.shape[1]

    def sums(self, terms: FloatArray) -> FloatArray:
        """Sums (1 + draws, k) over clips of terms (n, k), in the data and in each draw."""
        per_group = np.zeros((self.groups, terms.shape[1]))
        np.add.at(per_group, self.index, terms)
        return self.counts @ per_group

    def pair_ratio(self, hits: FloatArray, of: FloatArray) -> FloatArray:
        """Computes Σ hits / Σ of (1 + draws,), where both (G, G) are sums over pairs of groups; a
        pair counts as often as the product of its groups' occurrences."""
        upper = np.einsum("bi,bi->b", self.counts @ hits, self.counts)
        return ratio(upper, np.einsum("bi,bi->b", self.counts @ of, self.counts))


def ratio(upper: FloatArray, lower: FloatArray) -> FloatArray:
    """Divides, NaN where the denominator is not positive."""
    return np.divide(upper, lower, out=np.full(np.shape(upper), np.nan), where=lower > 0)


def estimate(
    values: FloatArray, *, name: str, unit: str = "1", clips: int, groups: int
) -> ScoreEstimate:
    """Returns the interval of values (1 + draws,), of which the first is the data's.

    Draws in which the score is undefined (none of a bin's groups occurs) are left out.

    Args:
        name, unit: of the score.
        clips, groups: that the values rest on.
    """
    drawn = values[1:][np.isfinite(values[1:])]
    known = groups >= 2 and drawn.size > 0
    ends = (
        np.quantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2]) if known else (-math.inf, math.inf)
    )
    value = float(values[0])
    span = Span(
        low=float(ends[0]),
        high=float(ends[1]),
        level=LEVEL,
        bound=None if known else Bound.NOTHING,
        estimated=False,
    )
    quantity = Quantity(
        name=name,
        unit=unit,
        value=value if math.isfinite(value) else None,
        sigma=float(drawn.std()) if known else None,
        span=span,
    )
    return ScoreEstimate(quantity=quantity, clips=clips, groups=groups)
