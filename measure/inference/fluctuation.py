"""A coefficient that fluctuates from segment to segment: what gusts, whose course is unknown, do to
the pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.inference.segment_evidence import Evidence, left_together


@dataclass(frozen=True, kw_only=True)
class Fluctuation:
    """A coefficient that differs from segment to segment, normally distributed about a constant.

    Attributes:
        deviation: its standard deviation, in units of its column.
        error: of the deviation, from the curvature of the likelihood.
        likelihood: restricted log likelihood ratio against a constant: what pushes alike in all
            segments does not fluctuate.
    """

    deviation: float
    error: float
    likelihood: float


def fluctuation(evidence: Evidence, column: int) -> Fluctuation:
    """Estimates how much a column's coefficient fluctuates, beside the nuisances.

    Errors are taken to be as large as this set's are across the column.
    """
    fit = evidence.fit([column])
    active = list(fit.active)
    score = evidence.score[:, column] - evidence.curvature[:, column][:, active] @ fit.value
    curvature = np.maximum(evidence.curvature[:, column, column], np.finfo(np.float64).tiny)
    across = fit.remainder - float((score**2 / curvature).sum())
    size = across / (len(score) * (evidence.columns - 1))
    score, curvature = score / size, curvature / size
    grid: FloatArray = np.concatenate([np.zeros(1), np.geomspace(1e-3, 10.0, 200)]) ** 2
    likelihood = _restricted_likelihood(grid, score, curvature)
    best = int(np.argmax(likelihood))
    deviation = float(np.sqrt(grid[best]))
    # Of τ where information is a normal variance's: Σ h²/(1 + τ² h)²/2 for τ², 4 τ² times that for
    # τ.
    information = 2 * grid[best] * float((curvature**2 / (1 + grid[best] * curvature) ** 2).sum())
    error = (
        information**-0.5 if information > 0 else float(np.sqrt(1 / np.sqrt((curvature**2).sum())))
    )
    return Fluctuation(deviation=deviation, error=error, likelihood=float(likelihood[best]))


def fluctuation_gains(evidence: Evidence, column: int) -> FloatArray:
    """Computes the log likelihood of each left-out recording's segments under the others' constant
    and fluctuation, over their constant alone, (segment,)."""
    folds = left_together(evidence.recording)
    result = np.zeros(len(folds))
    for index in np.unique(folds):
        inside, outside = evidence.select(folds != index), evidence.select(folds == index)
        fit = inside.fit((column,))
        active = list(fit.active)
        score = outside.score[:, column] - outside.curvature[:, column][:, active] @ fit.value
        variance = fluctuation(inside, column).deviation ** 2
        # log N(r; 0, Σ + τ² R Rᵀ) − log N(r; 0, Σ), by the matrix determinant lemma.
        grown = 1 + variance * outside.curvature[:, column, column]
        result[folds == index] = -np.log(grown) / 2 + variance * score**2 / grown / 2
    return result


def _restricted_likelihood(
    variances: FloatArray, score: FloatArray, curvature: FloatArray
) -> FloatArray:
    """Computes the restricted log likelihood of coefficients s/h ± 1/√h that vary by τ² about a
    constant, over none, (variance,)."""
    single = score / curvature
    weight = curvature / (1 + variances[:, None] * curvature)
    mean = weight @ single / weight.sum(axis=1)
    misfit = (weight * (single - mean[:, None]) ** 2).sum(axis=1)
    likelihood = (np.log(weight).sum(axis=1) - misfit - np.log(weight.sum(axis=1))) / 2
    return likelihood - likelihood[0]
