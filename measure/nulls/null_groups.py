"""Statistics of groups of null recordings, and what they are usually like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.calibrated_parameters import DAMPING, PRIOR, THETA
from measure.forecasting.regressors import TURNED
from measure.inference.fluctuation import fluctuation
from measure.inference.growth import power
from measure.inference.random_effect import Nulls
from measure.inference.segment_evidence import Evidence, best_gain
from measure.nulls.directions import (
    NOTHING,
    pulls_of,
    shares_of,
    standardise_pulls,
)
from measure.nulls.tails import as_normal, freedom
from measure.probes.lines import Lines, strongest
from measure.probes.segment_rows import StatisticRows

GUSTS = "air-density.change"
"""The column that gusts fluctuate along: the scale of the wind's pressure, twice their relative
intensity."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NullGroups(StatisticRows):
    """Statistics of null groups.

    Attributes:
        shares: (group, column) of `unscaled_drops`.
        pulls: (group, column, part) of `pulled`.
        left: (group,) what the base model leaves.
        gained: (group,) best held-out gains.
        swings: (group, part) of the wind's course, of no part where it is not looked at.
        settled: (group, quantity) what recordings settle at, of none where it is not looked at.
        lines: (group, shape · axis) `strongest`; None where spectra are not looked at.
        deviations: (group, theta) of the calibrated parameters from the true ones, in standard
            errors.
        noise: (group,) of the markers [m].
        kinds: (group,) of numerics.
        damping: (group,) logarithm of its ratio to the nominal one.
    """

    shares: FloatArray
    pulls: FloatArray
    left: FloatArray
    gained: FloatArray
    swings: FloatArray
    settled: FloatArray
    lines: FloatArray | None
    deviations: FloatArray
    noise: FloatArray
    kinds: IntArray
    damping: FloatArray

    @classmethod
    def of(cls, evidence: Evidence, columns: tuple[str, ...], segment: Nulls) -> NullGroups:
        """Computes the statistics of one group, taken at its true calibration.

        A null's cloth is as far from the nominal one as cloths known to `PRIOR` are. Where the
        data's is known better, that of a null lies nearer to its nominal one by as much.

        Args:
            segment: one segment of it.
        """
        nominal = -segment.calibration[0] * np.minimum(evidence.prior / PRIOR, 1.0)
        swing, settles = (
            np.zeros(0) if values is None else values
            for values in (evidence.swing, evidence.settles)
        )
        return cls(
            shares=unscaled_drops(evidence, columns)[None],
            pulls=pulls_of(evidence)[None],
            left=np.array([evidence.fit(()).remainder]),
            gained=np.array([best_gain(evidence, without=uncounted_columns(columns))]),
            swings=swing[None],
            settled=settles[None],
            lines=None if evidence.lines is None else strongest(evidence.lines)[None],
            deviations=evidence.fit((), centre=nominal).in_errors(range(len(THETA)))[None],
            noise=segment.noise,
            kinds=segment.numerics,
            damping=segment.calibration[:, DAMPING],
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class UsualStatistics:
    """What the statistics of some null groups are like: see `Reference`."""

    spread: FloatArray
    centre: FloatArray
    width: FloatArray
    lines: Lines | None
    powers: FloatArray
    degrees: FloatArray
    pull: FloatArray
    pull_width: FloatArray

    @classmethod
    def of(cls, groups: NullGroups) -> UsualStatistics:
        lines = None if groups.lines is None else Lines.of(groups.lines)
        powers = np.array([power(np.abs(swings), groups.damping) for swings in groups.swings.T])
        roots = _roots(groups, lines, powers)
        return cls(
            powers=powers,
            spread=np.maximum(groups.shares.mean(axis=0), NOTHING),
            centre=roots.mean(axis=0),
            width=np.maximum(roots.std(axis=0), np.cbrt(NOTHING)),
            lines=lines,
            degrees=freedom(roots),
            pull=groups.pulls.mean(axis=0),
            pull_width=groups.pulls.std(axis=0),
        )

    def pulled(self, pulls: FloatArray) -> FloatArray:
        """Computes how far each column pulls more than it does in nulls, in their standard
        deviations, (group, column, part)."""
        return standardise_pulls(pulls, self.pull, self.pull_width)

    def far(self, groups: NullGroups) -> FloatArray:
        """Computes how far groups are from their mean, in deviations by each one's own tail,
        (group, column + 2 to 11)."""
        distances = as_normal(
            (_roots(groups, self.lines, self.powers) - self.centre) / self.width, self.degrees
        )
        begin = groups.shares.shape[1] + 2
        either = slice(begin, begin + groups.swings.shape[1] + groups.settled.shape[1])
        distances[:, either] = np.abs(distances[:, either])
        return distances


def _roots(groups: NullGroups, lines: Lines | None, powers: FloatArray) -> FloatArray:
    swings = groups.swings * np.exp(-np.outer(groups.damping, powers))
    roots = np.c_[np.cbrt(np.c_[groups.shares, groups.left, groups.gained]), swings, groups.settled]
    return (
        roots
        if lines is None or groups.lines is None
        else np.c_[roots, lines.standing_out(groups.lines)]
    )


def uncounted_columns(columns: tuple[str, ...]) -> list[int]:
    """Columns whose held-out gains do not count in the test: what a log may be off by within its
    tolerance gains on recordings whose own log was not fitted."""
    return [columns.index(TURNED)] if TURNED in columns else []


def unscaled_drops(
    evidence: Evidence, columns: tuple[str, ...], along: Sequence[int] = ()
) -> FloatArray:
    """Computes each column's drop over what is left with it in some segments, and the likelihood
    ratio of gusts; where moments about the pole are looked at, then the same drops of these, and
    what they leave.

    Args:
        along: columns that are fitted already.
    """
    drops, remainder = evidence.drops(along), evidence.fit(along).remainder
    gusts = fluctuation(evidence, columns.index(GUSTS), along).likelihood
    values = np.append(shares_of(drops, remainder), max(gusts, 0.0))
    if evidence.turning is None:
        return values
    drops, remainder = evidence.turning.drops(along), evidence.turning.fit(along).remainder
    return np.concatenate([values, shares_of(drops, remainder), [remainder]])
