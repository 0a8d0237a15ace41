"""Several windows of one recording as one answer: the cloth is one and the same, each window has
its own wind.

*Cloth.* If windows were independent given θ, their likelihoods would multiply:

    p(θ | x_1 … x_K) ∝ p(θ) Π_k [p(θ | x_k) / p(θ)].

They are not: windows of one film share its view, light and scale, and so the errors these cause.
With a correlation ρ of the errors of two windows, the mean of K estimates has the variance σ² (1 +
(K − 1) ρ)/K of

    K_eff = K / (1 + (K − 1) ρ)

independent ones, which is never more than 1/ρ (Kish, Survey Sampling, 1965, section 5.4). The
likelihood is therefore tempered by K_eff/K. Means and covariances are those of Gaussians on the
targets' logits, on which models are trained. In coordinates in which the prior is a standard normal
distribution, window k contributes the precision Λ_k = S_k⁻¹ − 1, from which directions that are
less precise than the prior are left out, and the information S_k⁻¹ m_k along the others.
The shape is not made Gaussian: the draws are the windows' own, each less its window's mean and over
the square root of its covariance, at the mean and with the covariance of the product.

*Wind.* The wind of window k given the cloth is its residual r_k about the regression on cloth, w_k
= r_k + B_k θ, at the cloth that all windows agree on (Matheron's rule). The residuals keep each
window's own distribution; among windows they are drawn with the correlation ρ of a Gaussian copula.
The recording's wind is the mean over its windows.

One window is left as it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from measure.estimate.card_entries import card_entry

if TYPE_CHECKING:
    from models.trained.estimator import Estimator

OWN = frozenset({"wind_speed"})
"""Targets of which each window has its own; all others are one cloth's."""


@dataclass(frozen=True, kw_only=True)
class Dependence:
    """How alike the errors of two windows of one film are.

    Attributes:
        wind, cloth: correlations, 0 to 1.
        source: where they are from, in words.

    Raises:
        InputError: a correlation out of range.
    """

    wind: float
    cloth: float
    source: str

    def __post_init__(self) -> None:
        if not (0 <= self.wind <= 1 and 0 <= self.cloth <= 1):
            raise InputError(
                f"correlations {self.wind:g} and {self.cloth:g}", fix="give numbers from 0 to 1"
            )

    @classmethod
    def of_entry(cls, entry: Mapping[str, Any]) -> Dependence:
        """Reads what a card says.

        Raises:
            KeyError, TypeError, ValueError, InputError: it is damaged.
        """
        return cls(
            wind=float(entry["wind"]), cloth=float(entry["cloth"]), source=str(entry["source"])
        )


UNKNOWN = Dependence(
    wind=1.0,
    cloth=1.0,
    source="not measured for this model, so that windows count as repetitions of one and narrow no "
    "interval",
)
CARD_KEY = "window_correlation"
"""Where a model's card states its `Dependence`."""


def of_model(model: Estimator) -> Dependence:
    """Reads how alike windows err from a model's card; `UNKNOWN` where it does not say.

    Raises:
        CorruptError: the entry is damaged.
    """
    measured = card_entry(model, CARD_KEY, Dependence.of_entry, study="dependence")
    return UNKNOWN if measured is None else measured


def effective(count: int, correlation: float) -> float:
    """Computes K_eff: the number of independent estimates that so many correlated ones are
    worth."""
    return count / (1 + (count - 1) * correlation)


def combine_windows(
    logits: NDArray[np.floating],
    *,
    names: Sequence[str],
    centre: FloatArray,
    spread: FloatArray,
    dependence: Dependence,
    generator: np.random.Generator,
    exact: Sequence[str] = (),
) -> tuple[FloatArray, FloatArray]:
    """Combines all windows into one posterior.

    Args:
        logits: (k, n, target) draws of each window's posterior.
        names: of the targets.
        centre, spread: (target,) mean and standard deviation of the prior's logits.
        generator: for the draws.
        exact: targets of the cloth whose values were stated, draw by draw the same in all windows.

    Returns:
        (k, n, own) logits of the targets that each window has its own of, draw by draw in the given
            correlation, and
        (n, cloth) of the cloth; both in the order of `names`.

    Raises:
        InputError: no windows.
    """
    draws = np.asarray(logits, dtype=np.float64)
    if draws.ndim != 3 or not draws.shape[0]:
        raise InputError(
            f"draws of shape {draws.shape}",
            fix="give (window, draw, target) of at least one window",
        )
    wind_columns = [column for column, name in enumerate(names) if name in OWN]
    cloth_columns = [column for column, name in enumerate(names) if name not in OWN]
    if len(draws) == 1:
        return draws[:, :, wind_columns], draws[0][:, cloth_columns]
    free_columns = [column for column in cloth_columns if names[column] not in exact]
    joint = draws[0].copy()
    joint[:, free_columns] = centre[free_columns] + spread[free_columns] * _cloth(
        (draws[:, :, free_columns] - centre[free_columns]) / spread[free_columns], dependence.cloth
    )
    shared = joint[:, cloth_columns]
    winds = _winds(
        draws[:, :, wind_columns], draws[:, :, cloth_columns], shared, dependence.wind, generator
    )
    return winds, shared


def _cloth(white: FloatArray, correlation: float) -> FloatArray:
    """Draws from the tempered product of posteriors (k, n, cloth), in units of the prior: (n,
    cloth)."""
    count, n, size = white.shape
    if not size:
        return np.zeros((n, 0))
    tempered = effective(count, correlation) / count
    precision, information = np.eye(size), np.zeros(size)
    shapes = np.empty_like(white)
    for k, window in enumerate(white):
        mean, covariance = window.mean(axis=0), np.atleast_2d(np.cov(window.T))
        values, vectors = np.linalg.eigh(covariance)
        constrained = values < 1
        gain = vectors[:, constrained] * (1 / values[constrained] - 1)
        precision += tempered * gain @ vectors[:, constrained].T
        information += (
            tempered
            * (vectors[:, constrained] / values[constrained])
            @ (vectors[:, constrained].T @ mean)
        )
        shapes[k] = (window - mean) @ (vectors / np.sqrt(values)) @ vectors.T
    values, vectors = np.linalg.eigh(precision)
    shape = shapes[np.arange(n) % count, np.arange(n)]
    return np.linalg.solve(precision, information) + shape @ (vectors / np.sqrt(values)) @ vectors.T


def _winds(
    winds: FloatArray,
    cloths: FloatArray,
    shared: FloatArray,
    correlation: float,
    generator: np.random.Generator,
) -> FloatArray:
    """Draws each window's wind at the shared cloth, (k, n, own)."""
    count, n, _ = winds.shape
    common = generator.standard_normal(n)
    out = np.empty_like(winds)
    for k in range(count):
        score = math.sqrt(correlation) * common + math.sqrt(
            1 - correlation
        ) * generator.standard_normal(n)
        rank = ndtr(score)
        for column in range(winds.shape[2]):
            slope = _regression(cloths[k], winds[k, :, column])
            residual = winds[k, :, column] - cloths[k] @ slope
            out[k, :, column] = np.quantile(residual, rank) + shared @ slope
    return out


def _regression(cloth: FloatArray, wind: FloatArray) -> FloatArray:
    """Computes slopes (cloth,) of the linear regression of wind on cloth, over the draws."""
    if not cloth.shape[1]:
        return np.zeros(0)
    offset = cloth - cloth.mean(axis=0)
    return np.linalg.lstsq(offset, wind - wind.mean(), rcond=None)[0]
