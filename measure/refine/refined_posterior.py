"""The posterior of one cloth and of the wind in each of its clips, from a synthetic likelihood and
the prior.

    p(cloth, w₁ … w_J | y₁ … y_J) ∝ p(cloth) ∏ p(w_j) p(y_j | cloth, w_j)

with `Metamodel`'s predictive density as p(y_j | cloth, w_j); summaries of clips are taken as
independent given cloth and wind. The 16 parameters of the cloth are drawn from their prior and
weighted, and each wind is integrated over a grid, since clips constrain it most. Where evaluations
were made does not weigh on the result, other than by how
well the density is known there: they may follow the amortised posterior without counting the data
twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.refine.metamodel import Metamodel
from measure.refine.space import BENDING, WIND_COLUMN, Space

CLOTHS, WINDS, DRAWS = 2000, 121, 4000


REGRESSORS = 4


def regressors(reported: FloatArray, space: Space) -> FloatArray:
    """Computes what the metamodel is linear in, of reported quantities (n, 5): (n, `REGRESSORS`).

    The wind's share u of its range and √u, since a flag that hangs in a faint wind rises within a
    few tenths of its range; the logarithm of the area weight and the scale of bending, the two that
    all of the cloth's accelerations are divided by or multiplied with. All are bounded: with
    logits, few evaluations near an end of the range would fix the slope for all others (decision
    025). Anisotropy and nonlinearity of bending are left to the residual.
    """
    wind, area_weight, scale = reported[:, 0], reported[:, 1], reported[:, 2]
    share = np.clip((wind - space.wind.low) / (space.wind.high - space.wind.low), 0.0, 1.0)
    return np.stack([np.sqrt(share), share, np.log(area_weight), scale], axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Draws.

    Attributes:
        points: (draw, 17) of [−1, 1]¹⁷, with the first clip's wind.
        winds: (draw, clip) [m/s].
        effective: Kish's effective number of the weighted prior draws of the cloth.
    """

    points: FloatArray
    winds: FloatArray
    effective: float


def posterior(
    space: Space,
    models: Sequence[Metamodel],
    observed: Sequence[FloatArray],
    *,
    seed: int,
    cloths: int = CLOTHS,
    winds: int = WINDS,
    draws: int = DRAWS,
) -> Posterior:
    """Weighs prior draws by what was observed.

    Args:
        models: of each clip.
        observed: summaries (k,) of each clip.
        seed: of the prior draws and of the posterior's.
        cloths: prior draws of the cloth.
        winds: points of the wind's grid, in the middle of as many equal parts of its range.
        draws: of the posterior.
    """
    prior = space.prior(stream(seed, "posterior", "prior"), cloths)
    low, high = space.wind.low, space.wind.high
    step = (high - low) / winds
    grid = low + step * (np.arange(winds, dtype=np.float64) + 0.5)
    reported = space.reported_quantities(prior)
    likelihoods = np.stack(
        [
            _likelihood(model, reported, grid, y, space)
            for model, y in zip(models, observed, strict=True)
        ]
    )
    marginal = np.asarray(logsumexp(likelihoods, axis=2)).sum(axis=0)
    weight = np.exp(marginal - logsumexp(marginal))
    rng = stream(seed, "posterior", "draws")
    chosen = rng.choice(cloths, size=draws, p=weight)
    out = np.empty((draws, len(models)))
    for clip, table in enumerate(likelihoods):
        share = np.exp(table[chosen] - logsumexp(table[chosen], axis=1, keepdims=True)).cumsum(
            axis=1
        )
        cell = (rng.random((draws, 1)) > share / share[:, -1:]).sum(axis=1)
        out[:, clip] = grid[cell] + step * (rng.random(draws) - 0.5)
    points = prior[chosen]
    points[:, WIND_COLUMN] = 2 * (out[:, 0] - low) / (high - low) - 1
    return Posterior(points=points, winds=out, effective=float(1 / np.square(weight).sum()))


def _likelihood(
    model: Metamodel,
    reported: FloatArray,
    grid: NDArray[np.floating],
    observed: FloatArray,
    space: Space,
) -> FloatArray:
    """Computes the logarithm of the density of what was observed, (cloth, wind)."""
    rows = np.repeat(reported, len(grid), axis=0)
    rows[:, 0] = np.tile(grid, len(reported))
    return model.log_density(regressors(rows, space), observed).reshape(len(reported), len(grid))


def bending_table(space: Space, drawn: Posterior, level: float) -> FloatArray:
    """Tabulates median and interval of each bending coefficient [N·m], (15, 3): mostly the
    prior's."""
    values = space.values(drawn.points)[:, :BENDING]
    return np.quantile(values, [0.5, (1 - level) / 2, (1 + level) / 2], axis=0).T
