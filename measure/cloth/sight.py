"""What summaries a recording would have of a cloth, a place, and an effect of a strength.

A place is one in normal scores, in which a quantity's prior is standard normal: first the cloth's,
then those of each place. Recordings from one place with one anemometer share gain and view.

Without an effect this is an emulator, of all summaries that the recording shows. An effect adds
what it changed in pairs of simulations,

    Δ = Dᵀz(s, θ),   z = (u, u², u ln w),

u the strength or its logarithm, whichever predicts pairs that are left out better, and w the area
weight. How far what is shown lies from its prediction is in `measure.cloth.emulator`. With an
effect its covariance S is that of the base model times 1 + c + h r: c is by how much flags with the
effect scatter more about their prediction than the same flags without it, and h r what so few pairs
leave open of D, in units of S each, averages over all summaries.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from flagdata.core.arrays import BoolArray, FloatArray
from measure.cloth.design import Weighable
from measure.cloth.emulator import Emulator
from measure.cloth.flag_prior import CLOTH, NUISANCES, Uncertain

BESIDE = ("gain", "scale")
"""Nuisances that are fitted beside the place."""


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
        residual: r, the variance of pairs about the regression [base model's variance].
        excess: c [base model's variance].
        expected: mean size of the pairs' strengths, in the effect's unit.
        change: (k,) mean change by them, upwards: of pairs with a strength below null the opposite.
    """

    effect: Weighable
    logarithmic: bool
    coefficients: FloatArray
    inverse: FloatArray
    residual: float
    excess: float
    expected: float
    change: FloatArray

    def features(self, strength: FloatArray, weight: FloatArray) -> FloatArray:
        """Returns z (n, 3) at strengths beyond null (n,) and area weights (n,) [kg/m²]."""
        return _features(self.effect, self.logarithmic, strength, weight)


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight:
    """A recording as a cloth's posterior and its verdict see it.

    Attributes:
        emulator: of its simulations' summaries that are used.
        azimuth, elevation: their priors.
        place: what recordings from one place with one anemometer share; None for a place of its
            own.
        responses: name of an effect → what it changes.
    """

    emulator: Emulator
    azimuth: Uncertain
    elevation: Uncertain
    place: str | None = None
    responses: Mapping[str, Response] = field(default_factory=dict)

    @property
    def quantities(self) -> tuple[Uncertain, ...]:
        """Returns what is fitted for it alone: gain, scale, azimuth and elevation."""
        return (
            *(nuisance for nuisance in NUISANCES if nuisance.name in BESIDE),
            self.azimuth,
            self.elevation,
        )

    @property
    def used(self) -> BoolArray:
        """Returns (2·observable,) which summaries are used."""
        return self.emulator.used

    def predict(
        self,
        values: Mapping[str, FloatArray],
        effect: str | None = None,
        strength: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Returns means (n, k) of the used summaries, and factors (n,) of the scatter."""
        mean, stretch = self.emulator.predict(values)
        if effect is None or strength is None:
            return mean, stretch
        response = self.responses[effect]
        z = response.features(strength, values["area_weight"])
        leverage = ((z @ response.inverse) * z).sum(axis=1)
        return (
            mean + z @ response.coefficients,
            stretch + response.excess + leverage * response.residual,
        )


def first_of(places: Sequence[str | None]) -> list[int]:
    """Returns for each recording the first one of its place; None is a place of its own."""
    return [
        number if name is None else list(places).index(name) for number, name in enumerate(places)
    ]


def dimension(sights: Sequence[Sight]) -> int:
    """Counts the coordinates of the cloth and of all places."""
    return len(CLOTH) + sum(
        len(sights[first].quantities) for first in set(first_of([sight.place for sight in sights]))
    )


def values(
    scores: FloatArray, sights: Sequence[Sight]
) -> tuple[dict[str, FloatArray], list[dict[str, FloatArray]]]:
    """Returns cloths, and places of each recording, at normal scores (n, dimension or more)."""
    shares: Iterator[FloatArray] = iter(ndtr(scores).T)
    cloth = {quantity.name: quantity.at(next(shares)) for quantity in CLOTH}
    owners = first_of([sight.place for sight in sights])
    placed = {
        first: {quantity.name: quantity.at(next(shares)) for quantity in sights[first].quantities}
        for first in sorted(set(owners))
    }
    return cloth, [placed[first] for first in owners]


def response_of(
    emulator: Emulator,
    effect: Weighable,
    strengths: FloatArray,
    values: Mapping[str, FloatArray],
    with_it: FloatArray,
    without: FloatArray,
) -> Response | None:
    """Fits what an effect changes to pairs; None where too few of them show the flag.

    Args:
        strengths: (pair,) beyond the null value.
        values: name → (pair,).
        with_it, without: summaries (pair, k), without errors of numerics and pixels.
    """
    change = (with_it - without)[:, emulator.used]
    finite = np.asarray(np.isfinite(change).all(axis=1), dtype=np.bool_)
    if finite.sum() < FEWEST_PAIRS:
        return None
    change, strengths = change[finite], strengths[finite]
    values = {name: drawn[finite] for name, drawn in values.items()}
    white = np.linalg.solve(emulator.factor, change.T).T
    tried = []
    for logarithmic in (False, True) if effect.low > 0 else (False,):
        z = _features(effect, logarithmic, strengths, values["area_weight"])
        inverse = np.linalg.inv(z.T @ z + _RIDGE * np.eye(z.shape[1]))
        hat = z @ inverse @ z.T
        residual = white - hat @ white
        error = float(np.square(residual / (1 - np.diag(hat))[:, None]).mean())
        tried.append((error, logarithmic, z, inverse, residual))
    _, logarithmic, z, inverse, missed = min(tried, key=lambda trial: trial[0])
    coefficients = inverse @ z.T @ change
    predicted, stretch = emulator.predict(values)
    off = np.linalg.solve(emulator.factor, (without[finite][:, emulator.used] - predicted).T).T
    # The regression was fitted to the flags without the effect: their residuals are the smaller for
    # it.
    fitted, fresh = (2 - stretch)[:, None], stretch[:, None]
    return Response(
        effect=effect,
        logarithmic=logarithmic,
        coefficients=coefficients,
        inverse=inverse,
        residual=float(np.square(missed).sum() / (max(len(z) - z.shape[1], 1) * missed.shape[1])),
        excess=max(
            0.0, float((np.square(off + missed) / fresh).mean() - (np.square(off) / fitted).mean())
        ),
        expected=float(np.abs(strengths).mean()),
        change=(np.sign(strengths)[:, None] * change).mean(axis=0),
    )


def _features(
    effect: Weighable, logarithmic: bool, strength: FloatArray, weight: FloatArray
) -> FloatArray:
    most = max(abs(effect.low), abs(effect.high))
    u = strength / most
    if logarithmic:
        # 0 without the effect, 1 at its strongest, and linear below its weakest.
        u = np.log1p(np.maximum(strength, 0.0) / effect.low) / math.log1p(most / effect.low)
    return np.stack([u, u**2, u * np.log(weight / _MIDDLE_WEIGHT)], axis=1)
