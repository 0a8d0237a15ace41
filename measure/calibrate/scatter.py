"""How far what recordings show lies from its prediction by chance: of all recordings of a cloth together.

What is not regressed on, the fabric most of all, is the same in all recordings of a cloth: the residuals of droop and
extension of two recordings are correlated by 0.9. So their covariance is that of all recordings' summaries at once,
from simulated flags that are the same cloths in all of them. It is the predictive one, S/(n − p − k − 1) of n
simulations' residuals with p regressors and k summaries (`measure.refine.metamodel`), so that it is the wider the more
summaries so few simulations are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.special import gammaln

from flagdata.arrays import FloatArray
from flagdata.findings import Finding
from measure.calibrate.emulator import Emulator

FEWEST_FREEDOM = 20
"""Degrees of freedom below which recordings are taken as independent."""
HEAVY = 10.0
"""Most degrees of freedom of the t distribution: residuals of simulations have a kurtosis of 4, 3 + 6/(ν − 4)."""
TAKEN_APART = Finding.of(
    "recordings-taken-apart",
    "too few simulations for so many recordings: the cloth was taken as a different one in each, so that "
    "intervals are too narrow and probabilities too sure",
    fix="give fewer recordings, or more simulations with --simulations",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Scatter:
    """Of k summaries.

    Attributes:
        white: (k, k), from offsets to coordinates in which it is one.
        determinant: half the logarithm of its determinant.
        freedom: degrees of freedom of the t distribution.
        together: whether recordings' residuals were taken together.
    """

    white: FloatArray
    determinant: float
    freedom: float
    together: bool

    def log_density(self, offset: FloatArray, stretch: FloatArray) -> FloatArray:
        """(n,) logarithm of multivariate t at offsets (n, k), its covariance (n,) times as large."""
        k, freedom = offset.shape[1], self.freedom
        constant = gammaln((freedom + k) / 2) - gammaln(freedom / 2) - 0.5 * k * math.log(freedom * math.pi)
        return (
            constant
            - self.determinant
            - 0.5 * k * np.log(stretch)
            - 0.5 * (freedom + k) * np.log1p(self.distance(offset, stretch) / freedom)
        )

    def distance(self, offset: FloatArray, stretch: FloatArray) -> FloatArray:
        """(n,) squared standardised distance of offsets (n, k)."""
        return np.asarray(np.square(offset @ self.white.T).sum(axis=1) / stretch)


def scatter(emulators: Sequence[Emulator]) -> Scatter:
    """Of recordings of one cloth."""
    covariance, freedom, together = _covariance(emulators)
    freedom = min(freedom, HEAVY)
    factor = np.linalg.cholesky(covariance * (freedom - 2) / freedom)
    return Scatter(
        white=np.asarray(np.linalg.inv(factor), dtype=np.float64),
        freedom=freedom,
        together=together,
        determinant=float(np.log(np.diag(factor)).sum()),
    )


def _covariance(emulators: Sequence[Emulator]) -> tuple[FloatArray, float, bool]:
    """Predictive one of the residuals, its degrees of freedom, and whether it is of all recordings together."""
    first = emulators[0]
    if all(np.array_equal(one.weights, first.weights) for one in emulators):
        residuals = np.concatenate([one.residuals for one in emulators], axis=1)
        whole = residuals[np.isfinite(residuals).all(axis=1)]
        freedom = float(len(whole) - len(first.model.coefficients) - residuals.shape[1] + 1)
        if freedom >= FEWEST_FREEDOM or len(emulators) == 1:
            freedom = max(freedom, 3.0)
            return np.asarray(whole.T @ whole / (freedom - 2)), freedom, True
    blocks = [one.model.scatter / max(one.model.freedom - 2, 1.0) for one in emulators]
    return np.asarray(block_diag(*blocks)), max(min(one.model.freedom for one in emulators), 3.0), False
