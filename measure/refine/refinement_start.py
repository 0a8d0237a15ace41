"""Where a refinement starts: draws of the amortised posterior, completed to 17 parameters by the
prior.

The network estimates wind, area weight, scale and anisotropy of bending. The 15 coefficients follow
from the prior
given these two: of many prior draws the one whose scale and anisotropy are nearest is taken
(sampling-importance-resampling with the narrowest kernel), so that the rest is as the prior has it.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial import KDTree
from torch import Tensor

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from flagdata.errors import InputError
from measure.refine.space import AREA_WEIGHT_COLUMN, DIMENSION, WIND_COLUMN, Space
from models.networks.targets import ASPECT
from models.trained.estimator import Estimator
from models.trained.restriction import Known, usable_aspect

TARGETS = ("wind_speed", "area_weight", "bending_scale", "anisotropy")
"""Targets that a network must estimate for a refinement to start from it."""
SUMMARISED = ("wind_speed", "area_weight")
"""Targets whose estimates summarise a clip: clips hardly constrain bending (decision 025)."""
_POOL = 20_000
_MARGIN = 1e-3  # of a logit's range: parameters at the very end of theirs have none


def require(estimator: Estimator) -> None:
    """Refuses a network that does not estimate `TARGETS`, each with a distribution.

    Raises:
        InputError: it does not.
    """
    names = tuple(target.name for target in estimator.targets)
    if any(name not in names for name in TARGETS):
        raise InputError(
            f"the model estimates {', '.join(names) or 'nothing'}; a refinement needs "
            f"{', '.join(TARGETS)}",
            where=f"model {estimator.name!r}",
            fix="take a model of the posterior loss with these targets",
        )


@torch.no_grad()
def summaries(estimator: Estimator, embedding: FloatArray) -> FloatArray:
    """Computes the network's own estimates of `SUMMARISED` from embeddings (n, d), all learners'
    side by side: (n, 2).

    Each is a share of its target's range: the logistic function of the posterior's mean logit,
    which stays finite and nearly linear where the logit itself runs off, at winds near the ends of
    the range. A posterior's mean is the summary that loses least for estimating it (Fearnhead and
    Prangle, Journal of the Royal Statistical Society B 74, 2012). Rows that are not finite stay so.
    """
    finite = np.isfinite(embedding).all(axis=1)
    names = [target.name for target in estimator.targets]
    columns = [names.index(name) for name in SUMMARISED]
    out = np.full((len(embedding), len(SUMMARISED)), np.nan)
    if not finite.any():
        return out
    rows = torch.from_numpy(embedding[finite]).to(estimator.device).float()
    networks = [learner.network for learner in estimator.learners]
    widths = [int(one.dimension) for one in networks]  # pyright: ignore[reportArgumentType]
    means: list[Tensor] = []
    for learner, part in zip(estimator.learners, rows.split(widths, dim=1), strict=True):
        means.append(learner.mixture(part).mean() * learner.spread + learner.centre)
    out[finite] = torch.stack(means).mean(dim=0)[:, columns].double().sigmoid().cpu().numpy()
    return out


def amortised_draws(
    estimator: Estimator, clip: UInt8Array, space: Space, *, aspect: float, seed: int, draws: int
) -> FloatArray:
    """Draws `TARGETS` for a clip (frame, height, width): (draw, 4), in the targets' units. Where
    the space's area weights are fewer than the network's, they hold for the clip, as does the
    aspect (length over height) for a network that estimates it.
    """
    target = next(target for target in estimator.targets if target.name == "area_weight")
    low, high = max(space.area_weight.low, target.low), min(space.area_weight.high, target.high)
    fewer = low > target.low or high < target.high
    statements = (
        [Known.everywhere("area_weight", Stated(low=low, high=high), count=1)] if fewer else []
    )
    if (shape := usable_aspect(estimator.targets, aspect, 1.0)) is not None:
        statements.append(Known.everywhere(ASPECT, shape, count=1))
    estimates = estimator.estimate(
        estimator.inputs(clip[None]), seed=seed, draws=draws, known=statements
    )
    names = [target.name for target in estimates.targets]
    return estimates.draws[0][:, [names.index(name) for name in TARGETS]].astype(np.float64)


def _logits(values: FloatArray, space: Space) -> FloatArray:
    """Logits of the places of values (…, 4) of `TARGETS` in the ranges of the space, much as
    networks learn them."""
    low, high = _ends(space)
    share = np.clip((values - low) / (high - low), _MARGIN, 1 - _MARGIN)
    return np.log(share / (1 - share))


def _ends(space: Space) -> tuple[FloatArray, FloatArray]:
    """Returns lower and upper ends of `TARGETS`, (4,)."""
    return np.array([entry.low for entry in space.start_ranges]), np.array(
        [entry.high for entry in space.start_ranges]
    )


def widen_draws(values: FloatArray, factor: float, space: Space) -> FloatArray:
    """Draws (n, 4) of `TARGETS` with their logits' deviations from the mean enlarged."""
    low, high = _ends(space)
    z = _logits(values, space)
    z = z.mean(axis=0) + factor * (z - z.mean(axis=0))
    return low + (high - low) / (1 + np.exp(-z))


def complete_points(space: Space, drawn: FloatArray, *, seed: int) -> FloatArray:
    """Completes points (n, 17) of [−1, 1]¹⁷ with the wind and area weight of `drawn` (n, 4), and
    bending of the prior as near to its scale and anisotropy as 20,000 draws come, no draw twice."""
    pool = space.prior(stream(seed, "refine", "pool"), _POOL)
    offered, wanted = space.reported_quantities(pool)[:, 2:4], drawn[:, 2:4]
    spread = offered.std(axis=0)
    tree = KDTree(offered / spread)
    taken: set[int] = set()
    out = np.empty((len(drawn), DIMENSION))
    for i, row in enumerate(wanted / spread):
        _, nearest = tree.query(row, k=len(drawn) + 1)
        index = next(int(n) for n in np.atleast_1d(nearest) if int(n) not in taken)
        taken.add(index)
        out[i] = pool[index]
    values = space.values(out)
    values[:, AREA_WEIGHT_COLUMN], values[:, WIND_COLUMN] = drawn[:, 1], drawn[:, 0]
    return space.unit(values)
