"""Whether predictive distributions say how wrong they are: coverage, PIT, rank histogram and TARP.

All rest on ranks. Of s draws, u are below the truth and v are below or equal; were truth and draws
exchangeable, a uniform point of the cell [u / (s + 1), (v + 1) / (s + 1)] would be uniform over [0,
1], whatever s is. Shares are expectations over that point, in closed form, so that they are neither
random nor biased by a small s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.errors import InputError
from models.evaluation.bootstrap import Resamples, ScoreEstimate, estimate
from models.evaluation.predictions import Predictions

LEVELS = (0.50, 0.80, 0.90)
"""Nominal levels of the central intervals in the table."""
CURVE = tuple(round(0.05 * step, 2) for step in range(1, 20))
"""Nominal levels of the curves."""
BINS = 10
"""Number of bins of the rank histogram."""
BAND = 0.99
"""Share of a binomial within the rank histogram's band: Talts et al. show 99 %."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cells:
    """The rank of the truth among the draws: `low`, `high` (n,) between 0 and 1, low < high."""

    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, truth: NDArray, draws: NDArray) -> Cells:
        """Ranks truth (n,) among draws (n, s)."""
        size = draws.shape[1] + 1
        below = (draws < truth[:, None]).sum(axis=1)
        up_to = (draws <= truth[:, None]).sum(axis=1)
        return cls(low=below / size, high=(up_to + 1) / size)

    def below(self, level: float) -> FloatArray:
        """Computes the share (n,) of each cell below a level."""
        return np.clip((level - self.low) / (self.high - self.low), 0.0, 1.0)

    def central(self, level: float) -> FloatArray:
        """Computes the share (n,) of each cell inside the central interval of a level."""
        return self.below((1 + level) / 2) - self.below((1 - level) / 2)


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """Share of truths within intervals of a nominal level."""

    level: float
    share: ScoreEstimate


@dataclass(frozen=True, kw_only=True)
class RankHistogram:
    """Simulation-based calibration (Talts et al., arXiv:1804.06788, 2018) in equal bins.

    Attributes:
        share: of the clips, each group weighing the same, in each bin; 1 / bins if calibrated. A
            hump says that the distributions are too wide, a trough that they are too narrow, a
            slope that they are biased.
        band: where `BAND` of the shares of a calibrated model lie at least, bin by bin: binomial
            with one clip a group. Means over a group's clips vary less, however they depend on each
            other.
        groups: how many sequences.
    """

    JSON_NAMES: ClassVar = ("share", "low", "high", "groups")

    share: tuple[float, ...]
    band: tuple[float, float]
    groups: int

    @property
    def low(self) -> float:
        """Returns the lower end of the band."""
        return self.band[0]

    @property
    def high(self) -> float:
        """Returns its upper end."""
        return self.band[1]

    @property
    def outside(self) -> int:
        """How many bins lie outside the band."""
        return sum(not self.low <= value <= self.high for value in self.share)


def cells(predictions: Predictions, target: str) -> Cells:
    """Ranks each clip's truth among the model's draws of a target.

    Raises:
        InputError: the model gives no draws.
    """
    column = predictions.column(target)
    draws = _draws(predictions)[:, :, column]
    return Cells.of(predictions.truth[:, column].astype(np.float32), draws)


def _draws(predictions: Predictions) -> Float32Array:
    if predictions.samples is None:
        raise InputError(
            "the model gives no samples",
            where=f"predictions of {predictions.label!r}",
            fix="calibration is a question to models with a predictive distribution",
        )
    return predictions.samples


def coverage_values(
    predictions: Predictions, target: str, level: float, resamples: Resamples
) -> FloatArray:
    """Computes (1 + draws,): share of clips whose central interval of a level has the truth, in the
    data and in each draw."""
    return _mean(cells(predictions, target).central(level), resamples)


def _mean(share: FloatArray, resamples: Resamples) -> FloatArray:
    sums = resamples.sums(np.column_stack([share, np.ones_like(share)]))
    return sums[:, 0] / sums[:, 1]


def coverage(
    runs: tuple[Predictions, ...],
    target: str,
    resamples: Resamples,
    *,
    levels: tuple[float, ...] = LEVELS,
) -> tuple[Coverage, ...]:
    """Measures the covered share of central intervals at nominal levels, mean over runs of one
    model, with intervals over groups."""
    ranks = [cells(run, target) for run in runs]
    return tuple(
        _coverage_of(level, [of.central(level) for of in ranks], resamples) for level in levels
    )


def _coverage_of(level: float, shares: list[FloatArray], resamples: Resamples) -> Coverage:
    values = np.mean([_mean(share, resamples) for share in shares], axis=0)
    return Coverage(
        level=level,
        share=estimate(values, name="coverage", clips=len(shares[0]), groups=resamples.groups),
    )


def rank_histogram(
    runs: tuple[Predictions, ...], target: str, *, bins: int = BINS
) -> RankHistogram:
    """Counts the ranks of the truths among the draws in `bins` bins (simulation-based calibration),
    mean over runs of one model, with a calibrated model's band.

    A cell that reaches over an edge counts in both bins by its shares, so s + 1 need not be a
    multiple of the bins.
    """
    if bins < 2:
        raise InputError(f"{bins} bins are too few", where="bins", fix="give at least 2")
    edges = np.linspace(0, 1, bins + 1)
    ranks = [cells(run, target) for run in runs]
    below = np.mean([[of.below(float(edge)) for edge in edges] for of in ranks], axis=0)
    _, index, size = np.unique(runs[0].group, return_inverse=True, return_counts=True)
    groups = len(size)
    low, high = binom.interval(BAND, groups, 1 / bins)
    return RankHistogram(
        share=tuple(
            float(share) for share in (np.diff(below, axis=0) / size[index]).sum(axis=1) / groups
        ),
        band=(float(low) / groups, float(high) / groups),
        groups=groups,
    )


def tarp(
    runs: tuple[Predictions, ...],
    resamples: Resamples,
    *,
    generator: np.random.Generator,
    levels: tuple[float, ...] = CURVE,
) -> tuple[Coverage, ...]:
    """Tests expected coverage of all targets together with random points (TARP), mean over runs of
    one model.

    Each clip gets a reference point, uniform over the box of all truths and independent of the
    clip. The ball around it that reaches to the truth holds a share of the draws; if the
    distributions are calibrated, that share is uniform. Lemos, Coogan, Hezaveh and
    Perreault-Levasseur, ICML 2023, algorithm 2. Distances are Euclidean, each target over its
    range. A model whose distributions are all the prior is calibrated too: this says nothing of
    sharpness.

    Args:
        runs: with samples.
        resamples: of the clips' groups.
        generator: of the reference points, which are the same for all runs.
        levels: nominal.

    Raises:
        InputError: no samples, or a target that is the same in all clips.
    """
    reference = generator.uniform(size=runs[0].truth.shape)
    ranks = [_ball(run, reference) for run in runs]
    return tuple(
        _coverage_of(level, [of.below(level) for of in ranks], resamples) for level in levels
    )


def _ball(predictions: Predictions, reference: FloatArray) -> Cells:
    """Ranks the truth's distance from the reference (n, t) among the draws'."""
    draws = _draws(predictions).astype(np.float64)
    low, high = predictions.truth.min(axis=0), predictions.truth.max(axis=0)
    if not (high > low).all():
        constant = predictions.targets[int(np.argmin(high - low))]
        raise InputError(
            f"{constant} is the same in all clips",
            where=f"predictions of {predictions.label!r}",
            fix="test on sequences that differ in it, or leave it out of the targets",
        )
    to_truth = np.linalg.norm((predictions.truth - low) / (high - low) - reference, axis=1)
    to_draws = np.linalg.norm((draws - low) / (high - low) - reference[:, None, :], axis=2)
    return Cells.of(to_truth, to_draws)
