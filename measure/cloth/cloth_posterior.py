"""The posterior of a cloth that several recordings show, and of their places.

    p(cloth | y) ∝ p(cloth) ∫ ∏_j p(place_j, gain_j) p(y | cloth, places, gains) d(places, gains)

over recordings j, y being the summaries of all of them: what is unknown of the cloth and of the
numerics is the same in all recordings, so that they are not independent (`measure.cloth.emulator`).

Draws from a density by an ensemble of walkers, several densities at once.

Each walker steps along its line to another one, stretched by a random factor (Goodman and Weare,
Communications in Applied Mathematics and Computational Science 5, 2010). Coordinates are normal
scores, in which the prior is standard normal. Walkers start at draws of the prior that are chosen
by their likelihood.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.cloth.model_evidence import Hypothesis, hypothesis
from measure.cloth.sight import Sight

_STARTS = 4096
"""Draws of the prior among which walkers start. More start walkers nearer to a narrow posterior,
and cost one prediction each."""
_THIN = 10
"""Steps between draws that are kept. Fewer keep draws that are correlated; more keep fewer of
them."""
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
    """Draws (group, draw, dimension) normal scores; of the steps the first half is not kept, and
    one in `_THIN` of the rest.

    Args:
        likelihood: logarithms (group, n) at normal scores (group, n, dimension).
        groups: densities that are drawn from, each by walkers of its own.
        walkers: of each group, an even number.
    """

    def density(scores: FloatArray) -> FloatArray:
        return likelihood(scores) - 0.5 * np.square(scores).sum(axis=2)

    # Walkers start at draws of the prior, chosen by their likelihood.
    prior = rng.standard_normal((groups, _STARTS, dimension))
    # The largest of these are a draw by likelihood without repetition (Gumbel's maximum).
    weight = likelihood(prior) + rng.gumbel(size=prior.shape[:2])
    chosen = np.argsort(-weight, axis=1)[:, :walkers]
    at = np.take_along_axis(prior, chosen[..., None], axis=1)
    value, half, draws = density(at), walkers // 2, []
    # Stretch moves, each half of the walkers along lines to the other half (Goodman and Weare).
    sides = (slice(0, half), slice(half, None))
    for step in range(steps):
        for moving, still in (sides, sides[::-1]):
            stretch = (
                1 + rng.random((groups, half)) * (_STRETCH - 1)
            ) ** 2 / _STRETCH  # of density ∝ 1/√z
            partner = np.take_along_axis(
                at[:, still], rng.integers(half, size=(groups, half, 1)), axis=1
            )
            tried = partner + stretch[..., None] * (at[:, moving] - partner)
            tried_density = density(tried)
            odds = (dimension - 1) * np.log(stretch) + tried_density - value[:, moving]
            taken = np.log(rng.random((groups, half))) < odds
            at[:, moving] = np.where(taken[..., None], tried, at[:, moving])
            value[:, moving] = np.where(taken, tried_density, value[:, moving])
        if step >= steps // 2 and step % _THIN == 0:
            draws.append(at.copy())
    return np.concatenate(draws, axis=1)


WALKERS, STEPS = 256, 600
"""Of the ensemble that draws from the posterior."""
CHECK = (64, 600)
"""The same of each simulation that is weighed to check the intervals, which need not be smooth."""


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
    """Draws the cloth that recordings show.

    Args:
        observed: of each recording its summaries (k,).
    """
    base = hypothesis(sights, None)
    rng = stream(seed, "calibrate", "posterior")
    scores = _drawn(
        base, [summary[None] for summary in observed], walkers=WALKERS, steps=STEPS, rng=rng
    )
    cloth, places, _ = base.values(scores[0])
    return Posterior(cloth=cloth, places=tuple(places), together=base.scatter.together)


def weigh_cloths(
    sights: Sequence[Sight], observed: Sequence[FloatArray], *, seed: int
) -> Mapping[str, FloatArray]:
    """Draws the cloths of several flags, each by itself, seen from the sights' places: name →
    (flag, draw).

    Args:
        observed: of each recording (flag, summary).
    """
    base, (walkers, steps) = hypothesis(sights, None), CHECK
    scores = _drawn(
        base, observed, walkers=walkers, steps=steps, rng=stream(seed, "calibrate", "weighed")
    )
    cloth, _, _ = base.values(scores.reshape(-1, scores.shape[2]))
    return {name: values.reshape(scores.shape[:2]) for name, values in cloth.items()}


def _drawn(
    base: Hypothesis,
    observed: Sequence[FloatArray],
    *,
    walkers: int,
    steps: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Draws normal scores (flag, draw, dimension) of flags whose summaries are (flag, summary) in
    each recording."""
    summaries = np.concatenate(
        [rows[:, sight.used] for sight, rows in zip(base.sights, observed, strict=True)], axis=1
    )

    def likelihood(scores: FloatArray) -> FloatArray:
        mean, stretch, _ = base.predicted(scores.reshape(-1, scores.shape[2]))
        offset = np.repeat(summaries, scores.shape[1], axis=0) - mean
        return base.scatter.log_density(offset, stretch).reshape(scores.shape[:2])

    return ensemble(
        likelihood,
        groups=len(summaries),
        dimension=base.dimension,
        walkers=walkers,
        steps=steps,
        rng=rng,
    )
