"""What the terms' statistics are when nothing is missing: errors of nulls in the place of the
data's.

The response of the projected errors to the terms is the data's; the errors themselves are those of
null recordings, standardised by a null model fitted without nulls of the same numerics. So one bank
of nulls tests any number of terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.forecasting.calibrated_parameters import THETA
from measure.inference.random_effect import Nulls
from measure.inference.segment_evidence import Evidence
from measure.nulls.reference import left_out_groups
from measure.probes.statistics import Statistics
from measure.propose.projected import evidence

_NOTHING = 1e-6
"""Mean share below which a term has no projected response."""
_NOISE_TOLERANCE = 5e-4
"""Difference of the markers' noise that does not matter [m]: with more, quieter nulls fall outside
the level."""
_LEAST = 24
"""Groups of nulls as noisy as the data, below which all are taken."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Family:
    """Null distributions of all terms together.

    A term's statistic is the share of its drop of the squared distance in what is left with it,
    over the nulls' mean
    share: 1 in the mean if nothing is missing.

    Attributes:
        shares: (group, column) of null groups.
    """

    shares: FloatArray

    @classmethod
    def of(cls, nulls: Nulls, statistics: Statistics, *, noise: float, seed: int) -> Family:
        """Makes the family for the projected errors of data.

        Args:
            statistics: of the data.
            noise: of the data's markers [m].

        Raises:
            InputError: no null experiment has as many segments.
        """
        count, columns = statistics.response.shape[0], statistics.response.shape[2]
        similar = nulls.select(np.abs(nulls.noise - noise) <= _NOISE_TOLERANCE)
        pool = (
            similar
            if len(similar.noise) and len(np.unique(similar.experiment)) >= _LEAST
            else nulls
        )
        shares: list[FloatArray] = []
        for left_out in left_out_groups(nulls, pool, count, seed=seed):
            for chosen in left_out.groups:
                placed = replace(statistics, r=left_out.outside.statistics.r[chosen])
                shares.append(
                    _shares(evidence(placed, left_out.outside.speeds[chosen], left_out.model), ())
                )
        result = np.array(shares)
        return cls(shares=result[:, :columns])

    @cached_property
    def _spread(self) -> FloatArray:
        return np.maximum(self.shares.mean(axis=0), _NOTHING)

    @cached_property
    def _scaled_terms(self) -> FloatArray:
        return self.shares[:, len(THETA) :] / self._spread[len(THETA) :]

    def statistics(self, evidence_of_data: Evidence, along: Sequence[int] = ()) -> FloatArray:
        """Computes (column,) statistics of data, where some columns are fitted already."""
        return _shares(evidence_of_data, along) / self._spread

    def p_value(self, statistic: float, columns: Sequence[int]) -> float:
        """Computes the share of the groups in which the largest statistic of these columns is at
        least this one."""
        largest = self._scaled_terms[:, [column - len(THETA) for column in columns]].max(axis=1)
        return float((1 + (largest >= statistic).sum()) / (1 + len(largest)))


def _shares(evidence_of_data: Evidence, along: Sequence[int]) -> FloatArray:
    drops, remainder = evidence_of_data.drops(along), evidence_of_data.fit(along).remainder
    return drops / np.maximum(remainder - drops, 1e-9)
