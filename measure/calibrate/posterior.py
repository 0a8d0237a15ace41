"""The posterior of a cloth that several recordings show, and of their places.

    p(cloth | y) ∝ p(cloth) ∫ ∏_j p(place_j, gain_j) p(y | cloth, places, gains) d(places, gains)

over recordings j, y being the summaries of all of them: what is unknown of the cloth and of the numerics is the same in
all recordings, so that they are not independent (`measure.calibrate.scatter`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.rng import stream
from measure.calibrate.emulator import Emulator
from measure.calibrate.ensemble import ensemble
from measure.calibrate.prior import Floats
from measure.calibrate.scatter import Scatter, scatter
from measure.calibrate.sights import Placed, dimension, values

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

    cloth: Mapping[str, Floats]
    places: tuple[Mapping[str, Floats], ...]
    together: bool


def posterior(sights: Sequence[Sight], observed: Sequence[Floats], *, seed: int) -> Posterior:
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


def weighed(sights: Sequence[Sight], observed: Sequence[Floats], *, seed: int) -> Mapping[str, Floats]:
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
    observed: Sequence[Floats],
    *,
    walkers: int,
    steps: int,
    rng: np.random.Generator,
) -> Floats:
    """(flag, draw, dimension) normal scores of flags whose summaries are (flag, summary) in each recording."""
    whole = np.concatenate([own[:, one.emulator.used] for one, own in zip(sights, observed, strict=True)], axis=1)

    def likelihood(scores: Floats) -> Floats:
        cloth, places = values(scores.reshape(-1, scores.shape[2]), sights)
        found = [one.emulator.predict({**cloth, **place}) for one, place in zip(sights, places, strict=True)]
        mean = np.concatenate([own for own, _ in found], axis=1)
        stretch = np.mean([own for _, own in found], axis=0)
        offset = np.repeat(whole, scores.shape[1], axis=0) - mean
        return about.log_density(offset, stretch).reshape(scores.shape[:2])

    return ensemble(likelihood, groups=len(whole), dimension=dimension(sights), walkers=walkers, steps=steps, rng=rng)
