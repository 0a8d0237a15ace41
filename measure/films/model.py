"""What summaries a recording would have of a cloth, a place, and an effect of a strength.

Without an effect this is the regression of `measure.refine.metamodel` on the base model's simulations, of all summaries
that the recording shows. An effect adds what it changed in pairs of simulations,

    Δ = Dᵀz(s, θ),   z = (u, u², u ln w),

u the strength or its logarithm, whichever predicts pairs that are left out better, and w the area weight. How far what
is shown lies from its prediction is in `measure.films.scatter`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from measure.calibrate.emulator import regressors
from measure.calibrate.prior import Floats
from measure.films.library import Weighable
from measure.refine.metamodel import Metamodel, least

SHOWN_BY = 0.8
"""Share of the simulations that are to show a summary that is used."""
_RIDGE = 1e-3
"""Added to ZᵀZ, whose columns are of the order of one."""
FEWEST_PAIRS = 8
_MIDDLE_WEIGHT = 0.15
"""kg/m² about which the area weight changes what an effect does."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """What an effect changes.

    Attributes:
        effect: which.
        logarithmic: whether u is the strength's logarithm.
        coefficients: D (3, k).
        inverse: (ZᵀZ)⁻¹ (3, 3).
        residuals: (pair, k) of the pairs; NaN of those that do not show all.
    """

    effect: Weighable
    logarithmic: bool
    coefficients: Floats
    inverse: Floats
    residuals: Floats

    def features(self, strength: Floats, weight: Floats) -> Floats:
        """z (n, 3) at strengths beyond null (n,) and area weights (n,) [kg/m²]."""
        return _features(self.effect, self.logarithmic, strength, weight)


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """Of one recording.

    Attributes:
        base: of the summaries that are used.
        used: (2·observable,) which.
        residuals: (simulation, k) of the base model's simulations; NaN of those that do not show all.
        weights: (simulation,) their area weights [kg/m²], by which recordings of the same cloths are known.
        responses: name of an effect → what it changes.
    """

    base: Metamodel
    used: NDArray[np.bool_]
    residuals: Floats
    weights: Floats
    responses: Mapping[str, Response]

    @property
    def factor(self) -> Floats:
        """Lower Cholesky factor of the scale matrix."""
        return np.asarray(np.linalg.cholesky(self.base.scatter / self.base.freedom), dtype=np.float64)

    def predict(
        self, values: Mapping[str, Floats], effect: str | None = None, strength: Floats | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """Means (n, k) of the used summaries, factors (n,) of the scatter, and of the pairs' residuals' covariance."""
        x = (regressors(values) - self.base.centre) / self.base.spread
        x = np.concatenate([np.ones((len(x), 1)), x], axis=1)
        mean, stretch = x @ self.base.coefficients, 1 + ((x @ self.base.inverse) * x).sum(axis=1)
        if effect is None or strength is None:
            return mean, stretch, np.zeros(len(x))
        own = self.responses[effect]
        z = own.features(strength, values["area_weight"])
        return mean + z @ own.coefficients, stretch, ((z @ own.inverse) * z).sum(axis=1)


def fit(values: Mapping[str, Floats], summaries: Floats, shown: NDArray[np.bool_], *, name: str) -> Model:
    """The base model's part.

    Args:
        values: name → (n,) of the simulations.
        summaries: (n, k), NaN where a simulation does not show one.
        shown: (k,) those that the recording shows.
        name: of the recording.

    Raises:
        InputError: too few simulations show what the recording shows.
    """
    there = np.isfinite(summaries)
    used = shown & (there.mean(axis=0) > SHOWN_BY)
    complete = np.asarray(there[:, used].all(axis=1) & used.any(), dtype=np.bool_)
    x, y = regressors(values)[complete], summaries[complete][:, used]
    needed = least(x.shape[1] + 1, int(used.sum())) + 8
    if len(x) < needed:
        raise InputError(
            f"{len(x)} of {len(summaries)} simulations show what the film shows, and {needed} are needed", where=name,
            fix="check --flag-size, --attachment and --azimuth: flags that were simulated so look otherwise",
        )  # fmt: skip
    base = Metamodel.fit(x, y, np.arange(len(x)))
    model = Model(base=base, used=used, residuals=np.zeros(0), weights=values["area_weight"], responses={})
    mean, _, _ = model.predict(values)
    residuals = np.where(complete[:, None], summaries[:, used] - mean, np.nan)
    return replace(model, residuals=residuals)


def responded(
    model: Model, effect: Weighable, strengths: Floats, values: Mapping[str, Floats], with_it: Floats, without: Floats
) -> Response | None:
    """What an effect changes, by pairs; None where too few of them show the flag.

    Args:
        strengths: (pair,) beyond the null value.
        values: name → (pair,).
        with_it, without: summaries (pair, k), without errors of numerics and pixels.
    """
    change = (with_it - without)[:, model.used]
    there = np.asarray(np.isfinite(change).all(axis=1), dtype=np.bool_)
    if there.sum() < FEWEST_PAIRS:
        return None
    change, strengths = change[there], strengths[there]
    values = {name: own[there] for name, own in values.items()}
    white = np.linalg.solve(model.factor, change.T).T
    tried = []
    for logarithmic in (False, True) if effect.low > 0 else (False,):
        z = _features(effect, logarithmic, strengths, values["area_weight"])
        inverse = np.linalg.inv(z.T @ z + _RIDGE * np.eye(z.shape[1]))
        hat = z @ inverse @ z.T
        residual = white - hat @ white
        error = float(np.square(residual / (1 - np.diag(hat))[:, None]).mean())
        tried.append((error, logarithmic, z, inverse))
    _, logarithmic, z, inverse = min(tried, key=lambda one: one[0])
    coefficients = inverse @ z.T @ change
    residuals = np.full((len(there), change.shape[1]), np.nan)
    residuals[there] = change - z @ coefficients
    return Response(
        effect=effect, logarithmic=logarithmic, coefficients=coefficients, inverse=inverse, residuals=residuals
    )


def _features(effect: Weighable, logarithmic: bool, strength: Floats, weight: Floats) -> Floats:
    most = max(abs(effect.low), abs(effect.high))
    u = strength / most
    if logarithmic:
        # 0 without the effect, 1 at its strongest, and linear below its weakest.
        u = np.log1p(np.maximum(strength, 0.0) / effect.low) / math.log1p(most / effect.low)
    return np.stack([u, u**2, u * np.log(weight / _MIDDLE_WEIGHT)], axis=1)
