"""Scores of point estimates: RMSE, Acc@0.5, bias, R², Pearson's r, error against wind, and a bound
between two of them.

All in the units of the target; wind speed in m/s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from models.evaluation.bootstrap import Resamples, ScoreEstimate, estimate, ratio
from models.evaluation.predictions import Predictions

TOLERANCE = 0.5
"""Error that Acc@0.5 allows [m/s]; Runia et al., Cloth in the Wind, CVPR 2020, section 6."""
BIN = 1.0
"""Width of the bins of the error against wind [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """A function of sums over clips.

    Attributes:
        terms: truth (n,), estimates (n,) → what is summed (n, k).
        value: sums (m, k) → scores (m,).
    """

    terms: Callable[[FloatArray, FloatArray], FloatArray]
    value: Callable[[FloatArray], FloatArray]

    def __call__(self, truth: FloatArray, mean: FloatArray) -> float:
        """Computes the score of clips themselves."""
        return float(self.value(self.terms(truth, mean).sum(axis=0, keepdims=True))[0])

    def values(self, predictions: Predictions, target: str, resamples: Resamples) -> FloatArray:
        """Computes (1 + draws,): the score of the data, then of each draw."""
        column = predictions.column(target)
        return self.value(
            resamples.sums(self.terms(predictions.truth[:, column], predictions.mean[:, column]))
        )


def _errors(truth: FloatArray, mean: FloatArray) -> FloatArray:
    error = mean - truth
    return np.column_stack(
        [np.ones_like(error), error, error**2, (np.abs(error) <= TOLERANCE).astype(np.float64)]
    )


def _moments(truth: FloatArray, mean: FloatArray) -> FloatArray:
    """Tabulates the moments 1, y, y², e², m, m², ym with y and m less their means, on which no
    score of them depends."""
    y, m, error = truth - truth.mean(), mean - mean.mean(), mean - truth
    return np.column_stack([np.ones_like(y), y, y**2, error**2, m, m**2, y * m])


def _variance(sums: FloatArray, first: int, second: int) -> FloatArray:
    """Computes n times the variance, 0 where rounding makes it less than 1e-12 of the sum of
    squares."""
    scatter = sums[:, second] - sums[:, first] ** 2 / sums[:, 0]
    return np.where(scatter > 1e-12 * sums[:, second], scatter, 0.0)


def _relative(sums: FloatArray) -> FloatArray:
    return np.sqrt(ratio(sums[:, 3], _variance(sums, 1, 2)))


def _pearson(sums: FloatArray) -> FloatArray:
    together = sums[:, 6] - sums[:, 1] * sums[:, 4] / sums[:, 0]
    return ratio(together, np.sqrt(_variance(sums, 1, 2) * _variance(sums, 4, 5)))


SCORES: dict[str, Score] = {
    "rmse": Score(terms=_errors, value=lambda sums: np.sqrt(sums[:, 2] / sums[:, 0])),
    "accuracy": Score(terms=_errors, value=lambda sums: sums[:, 3] / sums[:, 0]),
    "bias": Score(terms=_errors, value=lambda sums: sums[:, 1] / sums[:, 0]),
    "relative_error": Score(terms=_moments, value=_relative),
    "r_squared": Score(terms=_moments, value=lambda sums: 1 - _relative(sums) ** 2),
    "pearson": Score(terms=_moments, value=_pearson),
}
"""By name. "accuracy" is the share of clips whose error is at most 0.5 (Acc@0.5 for wind in m/s);
"bias" is the mean of estimate less truth; "relative_error" is the RMSE over the standard deviation
of the truth over the clips tested, which is 1 for a constant prediction of their mean, and equals
√(1 - R²)."""
OF_UNIT = ("rmse", "bias")
"""Scores that have the unit of their target."""


def rmse_bound(accuracy: float) -> float:
    """Bounds from below the RMSE [m/s] that goes with an Acc@0.5: RMSE ≥ 0.5 √(1 - A).

    Proof. Let e be the errors of n clips and A the share of those with |e| ≤ 0.5. The other (1 - A)
    n clips have e² > 0.25, and no square is negative, so n RMSE² = Σ e² ≥ 0.25 (1 - A) n. Equality
    is approached by errors of 0 and of just more than 0.5. ∎ (Chebyshev's inequality for the
    empirical distribution.)

    Raises:
        InputError: the accuracy is no share.
    """
    if not 0 <= accuracy <= 1:
        raise InputError(
            f"the accuracy {accuracy:g} is no share",
            where="accuracy",
            fix="give a share between 0 and 1",
        )
    return TOLERANCE * math.sqrt(1 - accuracy)


@dataclass(frozen=True, kw_only=True)
class BinError:
    """Errors of clips by their true wind.

    Attributes:
        wind: ends of the bin [m/s]; the lower belongs to it, the upper to the last bin only.
        rmse, bias: of its clips [m/s].
    """

    JSON_NAMES: ClassVar = ("low", "high", "rmse", "bias")

    wind: tuple[float, float]
    rmse: ScoreEstimate
    bias: ScoreEstimate

    @property
    def low(self) -> float:
        """Returns where the bin begins."""
        return self.wind[0]

    @property
    def high(self) -> float:
        """Returns where it ends."""
        return self.wind[1]


def error_against(
    predictions: tuple[Predictions, ...], target: str, resamples: Resamples, *, width: float = BIN
) -> tuple[BinError, ...]:
    """Computes RMSE and bias by the truth's bin, means over runs of one model on the same clips;
    empty bins are left out."""
    truth = predictions[0].truth[:, predictions[0].column(target)]
    first = math.floor(truth.min() / width)
    count = max(1, math.ceil(truth.max() / width) - first)
    bins = np.clip(np.floor(truth / width).astype(np.int64) - first, 0, count - 1)
    errors = []
    for number in np.unique(bins):
        inside = bins == number
        clips, groups = int(inside.sum()), len(np.unique(resamples.index[inside]))
        sums = [
            resamples.sums(_errors(truth, run.mean[:, run.column(target)]) * inside[:, None])
            for run in predictions
        ]
        rmse = np.mean([np.sqrt(ratio(s[:, 2], s[:, 0])) for s in sums], axis=0)
        bias = np.mean([ratio(s[:, 1], s[:, 0]) for s in sums], axis=0)
        errors.append(
            BinError(
                wind=(float((first + number) * width), float((first + number + 1) * width)),
                rmse=estimate(rmse, name="rmse", unit="m/s", clips=clips, groups=groups),
                bias=estimate(bias, name="bias", unit="m/s", clips=clips, groups=groups),
            )
        )
    return tuple(errors)
