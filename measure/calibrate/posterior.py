"""The posterior of a cloth that several recordings show, and of their places.

    p(cloth | y) ∝ p(cloth) ∫ ∏_j p(place_j, gain_j) p(y | cloth, places, gains) d(places, gains)

over recordings j, y being the summaries of all of them: what is unknown of the cloth and of the numerics is the same in
all recordings, so that they are not independent (`measure.calibrate.scatter`).

Draws from a density by an ensemble of walkers, several densities at once.

Each walker steps along its line to another one, stretched by a random factor (Goodman and Weare, Communications in
Applied Mathematics and Computational Science 5, 2010). Coordinates are normal scores, in which the prior is standard
normal. Walkers start at draws of the prior that are chosen by their likelihood.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.arrays import FloatArray
from flagdata.rng import stream
from measure.calibrate.emulator import Emulator
from measure.calibrate.scatter import Scatter, scatter
from measure.calibrate.sights import Placed, dimension, values

_STARTS = 4096
"""Draws of the prior among which walkers start."""
_THIN = 10
"""Steps between draws that are kept."""
_STRETCH = 2.0
"""Largest factor of a step, and the inverse of the least one (Goodman and Weare's a)."""


def ensemble(
    likelihood: Callable[[FloatArray], FloatArray],
    *,
    groups: int,
    dimension: int,
    walkers: int,
    steps: int,
    rng: np.random.Generator,
) -> FloatArray:
    """(group, draw, dimension) normal scores; of the steps the first half is not kept, and one in `_THIN` of the rest.

    Args:
        likelihood: logarithms (group, n) at normal scores (group, n, dimension).
        groups: densities that are drawn from, each by walkers of its own.
        walkers: of each group, an even number.
    """

    def density(scores: FloatArray) -> FloatArray:
        return likelihood(scores) - 0.5 * np.square(scores).sum(axis=2)

    prior = rng.standard_normal((groups, _STARTS, dimension))
    # The largest of these are a draw by likelihood without repetition (Gumbel's maximum).
    weight = likelihood(prior) + rng.gumbel(size=prior.shape[:2])
    chosen = np.argsort(-weight, axis=1)[:, :walkers]
    at = np.take_along_axis(prior, chosen[..., None], axis=1)
    value, half, kept = density(at), walkers // 2, []
    sides = (slice(0, half), slice(half, None))
    for step in range(steps):
        for moving, still in (sides, sides[::-1]):
            stretch = (1 + rng.random((groups, half)) * (_STRETCH - 1)) ** 2 / _STRETCH  # of density ∝ 1/√z
            other = np.take_along_axis(at[:, still], rng.integers(half, size=(groups, half, 1)), axis=1)
            tried = other + stretch[..., None] * (at[:, moving] - other)
            found = density(tried)
            odds = (dimension - 1) * np.log(stretch) + found - value[:, moving]
            taken = np.log(rng.random((groups, half))) < odds
            at[:, moving] = np.where(taken[..., None], tried, at[:, moving])
            value[:, moving] = np.where(taken, found, value[:, moving])
        if step >= steps // 2 and step % _THIN == 0:
            kept.append(at.copy())
    return np.concatenate(kept, axis=1)


WALKERS, STEPS = 256, 600
"""Of the ensemble that draws from the posterior."""
CHECK = (64, 600)
"""The same of each simulation that is weighed to check the intervals, which need not be smooth."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight(Placed):
    """A recording as its posterior needs it.

    Attributes:
        emulator: of its simulations.
    """

    emulator: Emulator


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Draws.

    Attributes:
        cloth: name → (draw,) of area_weight, bending and damping.
        places: for each recording name → (draw,) of gain, scale, azimuth and elevation.
        together: whether what is unknown of the cloth was taken as the same in all recordings.
    """

    cloth: Mapping[str, FloatArray]
    places: tuple[Mapping[str, FloatArray], ...]
    together: bool


def posterior(sights: Sequence[Sight], observed: Sequence[FloatArray], *, seed: int) -> Posterior:
    """Draws of the cloth that recordings show.

    Args:
        observed: of each recording its summaries (k,).
    """
    about = scatter([one.emulator for one in sights])
    scores = _drawn(
        sights,
        about,
        [own[None] for own in observed],
        walkers=WALKERS,
        steps=STEPS,
        rng=stream(seed, "calibrate", "posterior"),
    )
    cloth, places = values(scores[0], sights)
    return Posterior(cloth=cloth, places=tuple(places), together=about.together)


def weighed(sights: Sequence[Sight], observed: Sequence[FloatArray], *, seed: int) -> Mapping[str, FloatArray]:
    """Name → (flag, draw) of the cloths of several flags, each by itself, seen from the sights' places.

    Args:
        observed: of each recording (flag, summary).
    """
    walkers, steps = CHECK
    scores = _drawn(
        sights,
        scatter([one.emulator for one in sights]),
        observed,
        walkers=walkers,
        steps=steps,
        rng=stream(seed, "calibrate", "weighed"),
    )
    cloth, _ = values(scores.reshape(-1, scores.shape[2]), sights)
    return {name: own.reshape(scores.shape[:2]) for name, own in cloth.items()}


def _drawn(
    sights: Sequence[Sight],
    about: Scatter,
    observed: Sequence[FloatArray],
    *,
    walkers: int,
    steps: int,
    rng: np.random.Generator,
) -> FloatArray:
    """(flag, draw, dimension) normal scores of flags whose summaries are (flag, summary) in each recording."""
    whole = np.concatenate([own[:, one.emulator.used] for one, own in zip(sights, observed, strict=True)], axis=1)

    def likelihood(scores: FloatArray) -> FloatArray:
        cloth, places = values(scores.reshape(-1, scores.shape[2]), sights)
        found = [one.emulator.predict({**cloth, **place}) for one, place in zip(sights, places, strict=True)]
        mean = np.concatenate([own for own, _ in found], axis=1)
        stretch = np.mean([own for _, own in found], axis=0)
        offset = np.repeat(whole, scores.shape[1], axis=0) - mean
        return about.log_density(offset, stretch).reshape(scores.shape[:2])

    return ensemble(likelihood, groups=len(whole), dimension=dimension(sights), walkers=walkers, steps=steps, rng=rng)
