"""What summaries a flag would have of a cloth, a place and an anemometer's gain, by a regression on
simulations.

Its predictive density is that of `measure.refine.metamodel`: multivariate t, whose scatter holds
what differs among simulations and is not regressed on (fabric, stretching, eddies, turbulence above
the log's rate, chaos) and how little so many simulations know. Errors of numerics and of pixels are
drawn and added to the simulations' summaries, so that they are a part of that scatter as well.

What is not regressed on, the fabric most of all, is the same in all recordings of a cloth: the
residuals of droop and extension of two recordings are correlated by 0.9. So their covariance is
that of all recordings' summaries at once, from simulated flags that are the same cloths in all of
them. It is the predictive one, S/(n − p − k − 1) of n simulations' residuals with p regressors and
k summaries (`measure.refine.metamodel`), so that it is the wider the more summaries so few
simulations are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.special import gammaln

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.findings import Finding
from flagdata.core.rng import stream
from flagdata.errors import RefusedError
from measure.cloth.flag_prior import CLOTH, Uncertain
from measure.refine.metamodel import Metamodel, least

SHOWN_BY = 0.8
"""Share of the simulations that are to show a summary that is used. Higher drops summaries that
some flags hide; lower leaves fewer complete simulations to fit to."""
INFORMATIVE = 0.8
"""Error of a summary's emulator, as a share of the summary's spread, from which on it is left out
of a weighing: what depends on nothing that is regressed on adds noise to the scatter's estimate,
and nothing else."""


def regressors(values: Mapping[str, FloatArray]) -> FloatArray:
    """Returns (n, p) what summaries are linear in: quadratics in the logarithms of weight and
    damping with their product, the logarithm of bending, and the place through the cosine of its
    azimuth, the chord's shortening."""
    weight, bending, damping = (
        np.log(values[quantity.name] / _middle(quantity)) / _half(quantity) for quantity in CLOTH
    )
    gain, scale = np.log(values["gain"]) / 0.03, np.log(values["scale"]) / 0.01
    along, up = np.cos(values["azimuth"]), np.sin(values["elevation"]) / 0.09
    return np.stack(
        [weight, weight**2, bending, damping, damping**2, weight * damping, gain, scale, along, up],
        axis=1,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Emulator:
    """A fitted emulator of one recording.

    Attributes:
        model: of the summaries that are used.
        used: (2·observable,) which.
        residuals: (simulation, k) of them; NaN of simulations that do not show all.
        weights: (simulation,) area weights [kg/m²], by which recordings of the same cloths are
            known.
    """

    model: Metamodel
    used: BoolArray
    residuals: FloatArray
    weights: FloatArray

    @classmethod
    def fit(
        cls,
        values: Mapping[str, FloatArray],
        summaries: FloatArray,
        is_shown: BoolArray,
        *,
        name: str,
    ) -> Emulator:
        """Fit it to simulations.

        Args:
            values: name → (n,) of the simulations.
            summaries: (n, k), NaN where a simulation does not show one.
            is_shown: (k,) those that the recording shows.
            name: of the recording.

        Raises:
            RefusedError: too few simulations show what the recording shows.
        """
        used = is_shown & (np.isfinite(summaries).mean(axis=0) > SHOWN_BY)
        complete = np.asarray(
            np.isfinite(summaries[:, used]).all(axis=1) & used.any(), dtype=np.bool_
        )
        x, y = regressors(values)[complete], summaries[complete][:, used]
        needed = least(x.shape[1] + 1, y.shape[1]) + 8
        if len(x) < needed:
            raise RefusedError(
                f"{len(x)} of {len(summaries)} simulations show what the film shows, and {needed} "
                "are needed",
                where=name,
                fix="check --flag-size, --attachment and --azimuth: flags that were simulated so "
                "look otherwise; or "
                "give more simulations with --simulations",
            )
        model = Metamodel.fit(x, y, np.arange(len(x)))
        residuals = np.full((len(summaries), y.shape[1]), np.nan)
        emulator = cls(model=model, used=used, residuals=residuals, weights=values[CLOTH[0].name])
        mean, _ = emulator.predict(values)
        return replace(
            emulator, residuals=np.where(complete[:, None], summaries[:, used] - mean, np.nan)
        )

    @property
    def factor(self) -> FloatArray:
        """Returns the lower Cholesky factor of the scale matrix of this recording alone."""
        return np.asarray(
            np.linalg.cholesky(self.model.scatter / self.model.freedom), dtype=np.float64
        )

    @property
    def deviations(self) -> FloatArray:
        """Returns (used summary,) of replicates about their prediction."""
        return np.sqrt(np.diag(self.model.scatter) / self.model.freedom)

    def predict(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Means (n, k) of the used summaries at values, and factors (n,) of the scatter there."""
        x = (regressors(values) - self.model.centre) / self.model.spread
        x = np.concatenate([np.ones((len(x), 1)), x], axis=1)
        return x @ self.model.coefficients, 1 + ((x @ self.model.inverse) * x).sum(axis=1)

    def draw(self, values: Mapping[str, FloatArray], *, seed: int) -> FloatArray:
        """Returns (n, used summary) draws of the predictive density at values."""
        return self.model.draw(regressors(values), stream(seed, "calibrate", "predicted"))


def informative(
    values: Mapping[str, FloatArray], summaries: FloatArray, is_shown: BoolArray, *, name: str
) -> BoolArray:
    """Returns (k,) those of the shown summaries that depend on what is regressed on.

    Raises:
        RefusedError: none does.
    """
    used = is_shown & (np.isfinite(summaries).mean(axis=0) > SHOWN_BY)
    complete = np.isfinite(summaries[:, used]).all(axis=1)
    x, y = regressors(values)[complete], summaries[complete][:, used]
    if len(x) <= x.shape[1] + 1 or not used.any():
        return used  # the fit refuses it
    useful = _left_out(x, y) / y.std(axis=0) < INFORMATIVE
    if not useful.any():
        raise RefusedError(
            "what the film shows does not depend on the cloth in these simulations",
            where=name,
            fix="give more simulations with --simulations, or windows with more wind",
        )
    used[np.flatnonzero(used)[~useful]] = False
    return used


def _left_out(x: FloatArray, y: FloatArray) -> FloatArray:
    """Returns (k,) root mean square of leave-one-out errors of least squares."""
    design = np.concatenate([np.ones((len(x), 1)), (x - x.mean(axis=0)) / x.std(axis=0)], axis=1)
    hat = design @ np.linalg.pinv(design)
    residual = (y - hat @ y) / (1 - np.diag(hat))[:, None]
    return np.asarray(np.sqrt(np.square(residual).mean(axis=0)))


def _middle(quantity: Uncertain) -> float:
    low, high = _ends(quantity)
    return math.sqrt(low * high)


def _half(quantity: Uncertain) -> float:
    low, high = _ends(quantity)
    return math.log(high / low) / 2


def _ends(quantity: Uncertain) -> tuple[float, float]:
    low, high = quantity.at(np.array([0.0, 1.0])).tolist()
    return low, high


FEWEST_FREEDOM = 20
"""Degrees of freedom below which recordings are taken as independent. Higher does so more often,
and leaves out how their residuals are correlated."""
HEAVY = 10.0
"""Most degrees of freedom of the t distribution: residuals of simulations have a kurtosis of 4, 3 +
6/(ν − 4). Fewer allow for larger residuals and widen the intervals; more approach a normal
distribution."""
TAKEN_APART = Finding.of(
    "recordings-taken-apart",
    "too few simulations for so many recordings: the cloth was taken as a different one in each, "
    "so that "
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
        """Returns (n,) logarithm of multivariate t at offsets (n, k), its covariance (n,) times as
        large."""
        k, freedom = offset.shape[1], self.freedom
        constant = (
            gammaln((freedom + k) / 2)
            - gammaln(freedom / 2)
            - 0.5 * k * math.log(freedom * math.pi)
        )
        return (
            constant
            - self.determinant
            - 0.5 * k * np.log(stretch)
            - 0.5 * (freedom + k) * np.log1p(self.distance(offset, stretch) / freedom)
        )

    def distance(self, offset: FloatArray, stretch: FloatArray) -> FloatArray:
        """Returns (n,) squared standardised distance of offsets (n, k)."""
        return np.asarray(np.square(offset @ self.white.T).sum(axis=1) / stretch)


def scatter(emulators: Sequence[Emulator]) -> Scatter:
    """Estimates the scatter of recordings of one cloth."""
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
    """Estimates the predictive covariance of the residuals, its degrees of freedom, and whether it
    is of all recordings together."""
    first = emulators[0]
    if all(np.array_equal(emulator.weights, first.weights) for emulator in emulators):
        residuals = np.concatenate([emulator.residuals for emulator in emulators], axis=1)
        complete = residuals[np.isfinite(residuals).all(axis=1)]
        freedom = float(len(complete) - len(first.model.coefficients) - residuals.shape[1] + 1)
        if freedom >= FEWEST_FREEDOM or len(emulators) == 1:
            freedom = max(freedom, 3.0)
            return np.asarray(complete.T @ complete / (freedom - 2)), freedom, True
    blocks = [
        emulator.model.scatter / max(emulator.model.freedom - 2, 1.0) for emulator in emulators
    ]
    return (
        np.asarray(block_diag(*blocks)),
        max(min(emulator.model.freedom for emulator in emulators), 3.0),
        False,
    )
