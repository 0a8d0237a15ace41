"""Draws from a density by an ensemble of walkers, several densities at once.

Each walker steps along its line to another one, stretched by a random factor (Goodman and Weare, Communications in
Applied Mathematics and Computational Science 5, 2010). Coordinates are normal scores, in which the prior is standard
normal. Walkers start at draws of the prior that are chosen by their likelihood.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_STARTS = 4096
"""Draws of the prior among which walkers start."""
_THIN = 10
"""Steps between draws that are kept."""
_STRETCH = 2.0
"""Largest factor of a step, and the inverse of the least one (Goodman and Weare's a)."""


def ensemble(
    likelihood: Callable[[Floats], Floats],
    *,
    groups: int,
    dimension: int,
    walkers: int,
    steps: int,
    rng: np.random.Generator,
) -> Floats:
    """(group, draw, dimension) normal scores; of the steps the first half is not kept, and one in `_THIN` of the rest.

    Args:
        likelihood: logarithms (group, n) at normal scores (group, n, dimension).
        groups: densities that are drawn from, each by walkers of its own.
        walkers: of each group, an even number.
    """

    def density(scores: Floats) -> Floats:
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
