"""What summary a clip of given parameters would have: a linear model of the simulator, and its
predictive density.

Rows y (k) of what was evaluated follow y = Bᵀx + ε with ε ~ N(0, Σ). Under the diffuse prior p(B,
Σ) ∝ |Σ|^(−(k+1)/2) a new row at x* has the multivariate Student-t density

    y* ~ t_ν(B̂ᵀx*, (1 + x*ᵀ(XᵀX)⁻¹x*) S/ν),   ν = n − p − k + 1

(Geisser, Annals of Mathematical Statistics 36, 1965; Zellner, An Introduction to Bayesian Inference
in Econometrics, 1971, section 8.4), S being the residuals' scatter. It is a synthetic likelihood
(Wood, Nature 466, 2010) whose mean is a regression over parameters, and which knows how few
evaluations it is from. What parameters that are no regressors do, as single bending coefficients,
is a part of ε: they are drawn from their prior, and so marginalised.

Replicates of one θ share that part. Their rows count by Kish's design effect, 1/(1 + (R − 1) ρ), ρ
being their residuals' intra-class correlation (Kish, Survey Sampling, 1965).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class Metamodel:
    """A fitted model.

    Attributes:
        centre, spread: (p − 1,) of the regressors, without the constant.
        coefficients: B̂ (p, k).
        inverse: (XᵀX)⁻¹ (p, p).
        scatter: S (k, k).
        freedom: ν.
        correlation: ρ of replicates.
        rows: n, each counted by the design effect.
    """

    centre: FloatArray
    spread: FloatArray
    coefficients: FloatArray
    inverse: FloatArray
    scatter: FloatArray
    freedom: float
    correlation: float
    rows: float

    @classmethod
    def fit(cls, regressors: FloatArray, summaries: FloatArray, group: IntArray) -> Metamodel:
        """Fits it.

        Args:
            regressors: (n, p − 1), without the constant.
            summaries: (n, k), finite.
            group: (n,) number of each row's θ.

        Raises:
            InputError: too few rows for so many regressors and summaries (see `least`), or
                regressors that do not vary.
        """
        n, k = summaries.shape
        p = regressors.shape[1] + 1
        if n < least(p, k):
            raise InputError(
                f"{n} evaluations are too few for {p} regressors",
                fix=f"evaluate at least {least(p, k)}",
            )
        centre, spread = regressors.mean(axis=0), regressors.std(axis=0)
        if not (spread > 0).all():
            raise InputError(
                "a regressor is the same in all evaluations", fix="spread the evaluated points"
            )
        x = _design(regressors, centre, spread)
        plain, *_ = np.linalg.lstsq(x, summaries, rcond=None)
        residual = summaries - x @ plain
        correlation = _correlation(residual, group)
        size = np.bincount(group)[group]
        weight = 1 / (1 + (size - 1) * correlation)
        rows = float(weight.sum())
        freedom = rows - p - k + 1
        if freedom < 1:
            raise InputError(
                f"{rows:.1f} independent evaluations are too few for {p} regressors and {k} "
                "summaries",
                fix="evaluate more points, or fewer replicates of each",
            )
        inverse = np.asarray(np.linalg.inv((x * weight[:, None]).T @ x), dtype=np.float64)
        coefficients = inverse @ (x * weight[:, None]).T @ summaries
        residual = summaries - x @ coefficients
        return cls(
            centre=centre,
            spread=spread,
            coefficients=coefficients,
            inverse=inverse,
            scatter=(residual * weight[:, None]).T @ residual,
            freedom=freedom,
            correlation=correlation,
            rows=rows,
        )

    def log_density(self, regressors: FloatArray, observed: FloatArray) -> FloatArray:
        """Logarithms (m,) of the density of a summary (k,), or of one each (m, k), at regressors
        (m, p − 1)."""
        k, freedom = observed.shape[-1], self.freedom
        x = _design(regressors, self.centre, self.spread)
        stretch = 1 + ((x @ self.inverse) * x).sum(axis=1)
        offset = observed - x @ self.coefficients
        factor = np.linalg.cholesky(self.scatter / freedom)
        white = np.linalg.solve(factor, offset.T)
        distance = np.square(white).sum(axis=0) / stretch
        constant = (
            gammaln((freedom + k) / 2) - gammaln(freedom / 2) - 0.5 * k * np.log(freedom * np.pi)
        )
        return (
            constant
            - np.log(np.diag(factor)).sum()
            - 0.5 * k * np.log(stretch)
            - 0.5 * (freedom + k) * np.log1p(distance / freedom)
        )

    def draw(self, regressors: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draws from that density at each of regressors (m, p − 1), (m, k)."""
        x = _design(regressors, self.centre, self.spread)
        stretch = 1 + ((x @ self.inverse) * x).sum(axis=1)
        factor = np.linalg.cholesky(self.scatter / self.freedom)
        normal = rng.standard_normal((len(x), len(factor))) @ factor.T
        heavy = np.sqrt(self.freedom / rng.chisquare(self.freedom, len(x)))
        return x @ self.coefficients + normal * (np.sqrt(stretch) * heavy)[:, None]


def least(regressors: int, summaries: int) -> int:
    """Returns the fewest independent rows for p regressors with the constant and k summaries: such
    that ν ≥ 2."""
    return regressors + summaries + 1


def _design(regressors: FloatArray, centre: FloatArray, spread: FloatArray) -> FloatArray:
    return np.concatenate([np.ones((len(regressors), 1)), (regressors - centre) / spread], axis=1)


def _correlation(residual: FloatArray, group: IntArray) -> float:
    """Estimates the intra-class correlation of residuals (n, k) in their own covariance, 0 to 1; 0
    without replicates."""
    covariance = residual.T @ residual / len(residual)
    values, vectors = np.linalg.eigh(covariance)
    white = residual @ vectors / np.sqrt(np.maximum(values, values[-1] * 1e-12))
    products, pairs = 0.0, 0
    for number in np.unique(group):
        of_group = white[group == number]
        total = of_group.sum(axis=0)
        products += float((total @ total - np.square(of_group).sum()) / 2)
        pairs += len(of_group) * (len(of_group) - 1) // 2
    return float(np.clip(products / (pairs * residual.shape[1]), 0.0, 1.0)) if pairs else 0.0
