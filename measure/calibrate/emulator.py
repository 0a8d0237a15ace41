"""What summaries a flag would have of a cloth, a place and an anemometer's gain, and the posterior of these.

The emulator is a regression of summaries on simulations with the predictive density of `measure.refine.metamodel`:
multivariate t, whose scatter holds what differs among simulations and is not regressed on (stretching, eddies,
turbulence above the log's rate, chaos) and how little so many simulations know. Errors of numerics and of pixels are
drawn and added to the simulations' summaries, so that they are a part of that scatter as well.

    p(cloth | y) ∝ p(cloth) ∏_j ∫ p(place_j, gain_j) p(y_j | cloth, place_j, gain_j)

over recordings j.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.calibrate.ensemble import ensemble
from measure.calibrate.prior import CLOTH, NUISANCES, Floats, Uncertain
from measure.refine.metamodel import Metamodel, least

SOUGHT = tuple(quantity.name for quantity in CLOTH)
BESIDE = ("gain", "scale")
"""Nuisances that are fitted beside the place."""
WALKERS, STEPS = 256, 600
"""Of the ensemble that draws from the posterior."""
_THERE = 0.8
"""Share of the simulations that are to show a summary."""
_INFORMATIVE = 0.8
"""Error of a summary's emulator, as a share of the summary's spread, from which on it is left out: what depends on
nothing that is regressed on adds noise to the scatter's estimate, and nothing else."""
_CHECK = (64, 600)
"""The same of each simulation that is weighed to check the intervals, which need not be smooth."""


def regressors(values: Mapping[str, Floats]) -> Floats:
    """(n, p) what summaries are linear in: quadratics in the logarithms of weight and damping with their product, the
    logarithm of bending, and the place through the cosine of its azimuth, the chord's shortening."""
    weight, bending, damping = (
        np.log(values[quantity.name] / _middle(quantity)) / _half(quantity) for quantity in CLOTH
    )
    gain, scale = np.log(values["gain"]) / 0.03, np.log(values["scale"]) / 0.01
    along, up = np.cos(values["azimuth"]), np.sin(values["elevation"]) / 0.09
    return np.stack([weight, weight**2, bending, damping, damping**2, weight * damping, gain, scale, along, up], axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Emulator:
    """A fitted emulator of one recording.

    Attributes:
        model: of whitened summaries.
        used: (2·observable,) summaries that it is of.
        rows: simulations it was fitted to.
        error: (summary,) root mean square of its predictions' errors on simulations left out, as a share of the
            summaries' spread among simulations.
    """

    model: Metamodel
    used: NDArray[np.bool_]
    rows: int
    error: Floats

    @classmethod
    def fit(cls, values: Mapping[str, Floats], summaries: Floats, used: NDArray[np.bool_]) -> Emulator:
        """Fit it to simulations.

        Args:
            values: name → (n,) of the simulations.
            summaries: (n, k), NaN where a simulation does not show one.
            used: (k,) those that the recording shows.

        Raises:
            InputError: too few simulations show what the recording shows.
        """
        there = np.isfinite(summaries)
        used = used & (there.mean(axis=0) > _THERE)
        complete = np.asarray(there[:, used].all(axis=1) & used.any(), dtype=np.bool_)
        x, y = regressors(values)[complete], summaries[complete][:, used]
        needed = least(x.shape[1] + 1, y.shape[1]) + 8
        if len(x) < needed:
            raise InputError(
                f"{len(x)} of {len(complete)} simulations show what the film shows, and {needed} are needed",
                where="emulator", fix="give more simulations with --simulations",
            )  # fmt: skip
        error = _left_out(x, y) / y.std(axis=0)
        informative = error < _INFORMATIVE
        if not informative.any():
            raise InputError(
                "what the film shows does not depend on the cloth in these simulations", where="emulator",
                fix="give more simulations with --simulations, or windows with more wind",
            )  # fmt: skip
        used[np.flatnonzero(used)[~informative]] = False
        model = Metamodel.fit(x, y[:, informative], np.arange(len(x)))
        return cls(model=model, used=used, rows=len(x), error=error[informative])

    def log_density(self, values: Mapping[str, Floats], observed: Floats) -> Floats:
        """(n,) of a recording's summaries (k,), or of one's each (n, k), at values."""
        return self.model.log_density(regressors(values), observed[..., self.used])

    def predict(self, values: Mapping[str, Floats], *, seed: int) -> Floats:
        """(n, used summary) draws of the predictive density at values."""
        return self.model.draw(regressors(values), stream(seed, "calibrate", "predicted"))


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight:
    """A recording as its posterior needs it.

    Attributes:
        emulator: of its simulations.
        observed: (k,) summaries.
        azimuth, elevation: their priors.
        place: what recordings from one place with one anemometer share; None for a place of its own.
    """

    emulator: Emulator
    observed: Floats
    azimuth: Uncertain
    elevation: Uncertain
    place: str | None = None

    @property
    def quantities(self) -> tuple[Uncertain, ...]:
        """That are fitted for it alone: gain, scale, azimuth and elevation."""
        return (*(quantity for quantity in NUISANCES if quantity.name in BESIDE), self.azimuth, self.elevation)


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Draws.

    Attributes:
        cloth: name → (draw,) of area_weight, bending and damping.
        places: for each recording name → (draw,) of gain, scale, azimuth and elevation.
    """

    cloth: Mapping[str, Floats]
    places: tuple[Mapping[str, Floats], ...]


def posterior(sights: Sequence[Sight], *, seed: int) -> Posterior:
    """Draws of the cloth that several recordings show, and of their places."""
    rng = stream(seed, "calibrate", "posterior")
    dimension = len(CLOTH) + sum(len(sights[first].quantities) for first in sorted(set(_places(sights))))

    def likelihood(scores: Floats) -> Floats:
        cloth, places = _values(scores[0], sights)
        found = [
            sight.emulator.log_density({**cloth, **place}, sight.observed)
            for sight, place in zip(sights, places, strict=True)
        ]
        return np.sum(found, axis=0)[None]

    scores = ensemble(likelihood, groups=1, dimension=dimension, walkers=WALKERS, steps=STEPS, rng=rng)
    cloth, places = _values(scores[0], sights)
    return Posterior(cloth=cloth, places=tuple(places))


def weighed(sight: Sight, observed: Floats, *, seed: int) -> Mapping[str, Floats]:
    """Name → (flag, draw) of the cloths of several flags (flag, summary), each by itself, seen from a sight's place."""
    rng = stream(seed, "calibrate", "weighed")
    walkers, steps = _CHECK

    def likelihood(scores: Floats) -> Floats:
        cloth, (place,) = _values(scores.reshape(-1, scores.shape[2]), [sight])
        rows = np.repeat(observed, scores.shape[1], axis=0)
        return sight.emulator.log_density({**cloth, **place}, rows).reshape(scores.shape[:2])

    scores = ensemble(
        likelihood, groups=len(observed), dimension=len(CLOTH) + len(sight.quantities), walkers=walkers, steps=steps,
        rng=rng,
    )  # fmt: skip
    cloth, _ = _values(scores.reshape(-1, scores.shape[2]), [sight])
    return {name: own.reshape(scores.shape[:2]) for name, own in cloth.items()}


def _values(scores: Floats, sights: Sequence[Sight]) -> tuple[dict[str, Floats], list[dict[str, Floats]]]:
    """Cloths and each sight's places at normal scores (n, dimension)."""
    shares = iter(ndtr(scores).T)
    cloth = {quantity.name: quantity.at(next(shares)) for quantity in CLOTH}
    owners = _places(sights)
    own = {first: {q.name: q.at(next(shares)) for q in sights[first].quantities} for first in sorted(set(owners))}
    return cloth, [own[first] for first in owners]


def _places(sights: Sequence[Sight]) -> list[int]:
    """For each sight the first one of its place."""
    names = [sight.place for sight in sights]
    return [number if name is None else names.index(name) for number, name in enumerate(names)]


def _left_out(x: Floats, y: Floats) -> Floats:
    """(k,) root mean square of leave-one-out errors of least squares."""
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
