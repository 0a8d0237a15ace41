"""How far what recordings show lies from its prediction by chance: of all recordings of a cloth together.

What is not regressed on, the fabric most of all, is the same in all recordings of a cloth: the residuals of droop and
extension of two recordings are correlated by 0.9. So their covariance is that of all recordings' summaries at once,
from simulated flags that are the same cloths in all of them.

With an effect the covariance has a second part, R, of the residuals of pairs about the effect's regression: h R for
what so few pairs leave open of it, and R once more for what the regression misses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.special import gammaln

from measure.calibrate.prior import Floats
from measure.films.model import Model

FEWEST_FREEDOM = 20
"""Degrees of freedom below which recordings are taken as independent."""
HEAVY = 10.0
"""Most degrees of freedom of the t distribution: residuals of simulations have a kurtosis of 4, 3 + 6/(ν − 4)."""
_MISSED = 1.0
_SHRUNK = 0.5
"""Share of the pairs' covariances between summaries that is kept: they are from some dozen residuals."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scatter:
    """Of k summaries, in coordinates in which both parts are diagonal.

    Attributes:
        white: (k, k), from offsets to these coordinates.
        open: (k,) the second part there; the first is one.
        determinant: half the logarithm of the first part's determinant.
        freedom: degrees of freedom of the t distribution.
        together: whether recordings' residuals were taken together.
    """

    white: Floats
    open: Floats
    determinant: float
    freedom: float
    together: bool

    def variances(self, stretch: Floats, leverage: Floats) -> Floats:
        """(n, k) of what lies so far (n,) from the simulations, and so far from the pairs."""
        return stretch[:, None] + (leverage + _MISSED)[:, None] * self.open

    def log_density(self, offset: Floats, variances: Floats) -> Floats:
        """(n,) logarithm of multivariate t at offsets (n, k)."""
        k, freedom = offset.shape[1], self.freedom
        constant = gammaln((freedom + k) / 2) - gammaln(freedom / 2) - 0.5 * k * math.log(freedom * math.pi)
        return (
            constant - self.determinant - 0.5 * np.log(variances).sum(axis=1)
            - 0.5 * (freedom + k) * np.log1p(self.distance(offset, variances) / freedom)
        )  # fmt: skip

    def distance(self, offset: Floats, variances: Floats) -> Floats:
        """(n,) squared standardised distance of offsets (n, k)."""
        return np.asarray((np.square(offset @ self.white.T) / variances).sum(axis=1))


def scatter(models: Sequence[Model], effect: str | None) -> Scatter:
    """Of recordings of one cloth, without or with an effect."""
    covariance, freedom, together = _covariance(models)
    freedom = min(freedom, HEAVY)
    scale = covariance * (freedom - 2) / freedom
    factor = np.linalg.cholesky(scale)
    inverse = np.linalg.inv(factor)
    open_, turned = np.zeros(len(scale)), np.eye(len(scale))
    if effect is not None:
        residuals = np.concatenate([one.responses[effect].residuals for one in models], axis=1)
        whole = residuals[np.isfinite(residuals).all(axis=1)]
        features = models[0].responses[effect].inverse.shape[0]
        own = whole.T @ whole / max(len(whole) - features, 1)
        own = _SHRUNK * own + (1 - _SHRUNK) * np.diag(np.diag(own))
        open_, turned = np.linalg.eigh(inverse @ own @ inverse.T)
    return Scatter(
        white=np.asarray(turned.T @ inverse, dtype=np.float64), open=np.maximum(open_, 0.0), freedom=freedom,
        together=together, determinant=float(np.log(np.diag(factor)).sum()),
    )  # fmt: skip


def _covariance(models: Sequence[Model]) -> tuple[Floats, float, bool]:
    """Of the base model's residuals, its degrees of freedom, and whether it is of all recordings together."""
    first = models[0]
    if all(np.array_equal(one.weights, first.weights) for one in models):
        residuals = np.concatenate([one.residuals for one in models], axis=1)
        whole = residuals[np.isfinite(residuals).all(axis=1)]
        freedom = len(whole) - len(first.base.coefficients) - residuals.shape[1] + 1
        if freedom >= FEWEST_FREEDOM or len(models) == 1:
            count = len(whole) - len(first.base.coefficients)
            return np.asarray(whole.T @ whole / max(count, 1)), max(float(freedom), 3.0), True
    blocks = [one.base.scatter / (one.base.rows - len(one.base.coefficients)) for one in models]
    return np.asarray(block_diag(*blocks)), min(one.base.freedom for one in models), False
