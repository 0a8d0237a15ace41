"""Statistics of groups of null recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.calibrated_parameters import PRIOR, THETA
from measure.inference.random_effect import Nulls
from measure.inference.segment_evidence import Evidence
from measure.probes.lines import strongest
from measure.probes.segment_rows import StatisticRows

GUSTS = "air-density.change"
"""The column that gusts fluctuate along: the scale of the wind's pressure, twice their relative
intensity."""
_LEAST_LEFT = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class NullGroups(StatisticRows):
    """Statistics of null groups.

    Attributes:
        shares: (group, column) of `shares_of_drops`.
        settled: (group, quantity) what recordings settle at, of none where it is not looked at.
        lines: (group, shape · axis) `strongest`; None where spectra are not looked at.
        deviations: (group, theta) of the calibrated parameters from the true ones, in standard
            errors.
        kinds: (group,) of numerics.
    """

    shares: FloatArray
    settled: FloatArray
    lines: FloatArray | None
    deviations: FloatArray
    kinds: IntArray

    @classmethod
    def of(cls, evidence: Evidence, segment: Nulls) -> NullGroups:
        """Computes the statistics of one group, taken at its true calibration.

        A null's cloth is as far from the nominal one as cloths known to `PRIOR` are. Where the
        data's is known better, that of a null lies nearer to its nominal one by as much.

        Args:
            segment: one segment of it.
        """
        nominal = -segment.calibration[0] * np.minimum(evidence.prior / PRIOR, 1.0)
        return cls(
            shares=shares_of_drops(evidence)[None],
            settled=(np.zeros(0) if evidence.settles is None else evidence.settles)[None],
            lines=None if evidence.lines is None else strongest(evidence.lines)[None],
            deviations=evidence.fit((), centre=nominal).in_errors(range(len(THETA)))[None],
            kinds=segment.numerics,
        )


def shares_of_drops(evidence: Evidence, along: Sequence[int] = ()) -> FloatArray:
    """Computes each column's drop over what is left with it, (column,).

    Args:
        along: columns that are fitted already.
    """
    drops = evidence.drops(along)
    return drops / np.maximum(evidence.fit(along).remainder - drops, _LEAST_LEFT)
