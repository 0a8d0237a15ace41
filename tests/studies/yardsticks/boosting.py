"""Gradient boosting of trees on features: a mean and quantiles of each target.

Friedman, Annals of Statistics 29, 2001; quantiles by the pinball loss (Koenker and Bassett,
Econometrica 46, 1978). Needs scikit-learn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.errors import InputError
from tests.studies.yardsticks.ridge import require_table

LEVELS = (0.025, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.975)
"""Levels of the quantiles: the ends of central intervals of 95, 90, 80 and 50 %, and the median."""
ENSEMBLES = 1 + len(LEVELS)
"""Ensembles of each target: of its mean, and of each level."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Boosting:
    """Trees that were fitted to each target: one ensemble for the mean, one for each quantile.

    Attributes:
        means: an ensemble for each of t targets.
        quantiles: for each of t targets an ensemble for each level.
        levels: of the quantiles, ascending.
        features: number of features.
    """

    means: tuple[HistGradientBoostingRegressor, ...]
    quantiles: tuple[tuple[HistGradientBoostingRegressor, ...], ...]
    levels: tuple[float, ...]
    features: int

    def predict(self, features: NDArray[np.floating]) -> FloatArray:
        """Estimates the mean of the targets of clips with features (n, f): (n, t)."""
        self._require(features)
        return np.stack([model.predict(features) for model in self.means], axis=1)

    def predict_quantiles(self, features: NDArray[np.floating]) -> FloatArray:
        """Estimates quantiles of the targets: (n, level, t), ascending.

        Ensembles of neighbouring levels know nothing of each other and may cross; sorting them
        never makes a quantile worse (Chernozhukov, Fernández-Val and Galichon, Econometrica 78,
        2010).
        """
        self._require(features)
        quantiles = [[model.predict(features) for model in models] for models in self.quantiles]
        return np.sort(np.asarray(quantiles).transpose(2, 1, 0), axis=1)

    def samples(self, features: NDArray[np.floating], *, count: int) -> Float32Array:
        """Returns `count` equally probable values of each target by itself: (n, count, t) float32.

        They stand at the levels (i + ½)/count of the quantile function, linear between the fitted
        levels and constant
        beyond the outermost: no interval is wider than the one between these, and the samples do
        not show how targets vary together.
        """
        if count < 1:
            raise InputError(f"{count} samples cannot be drawn", fix="ask for at least 1")
        level = (np.arange(count) + 0.5) / count
        upper = np.clip(np.searchsorted(self.levels, level), 1, len(self.levels) - 1)
        low, high = np.array(self.levels)[upper - 1], np.array(self.levels)[upper]
        share = np.clip((level - low) / (high - low), 0, 1)[None, :, None]
        quantiles = self.predict_quantiles(features)
        return ((1 - share) * quantiles[:, upper - 1] + share * quantiles[:, upper]).astype(
            np.float32
        )

    def _require(self, features: NDArray[np.floating]) -> None:
        if features.ndim != 2 or features.shape[1] != self.features:
            raise InputError(
                f"the features have the shape {features.shape}, and the trees take {self.features}",
                fix=f"give (n, {self.features})",
            )


def fit_boosting(
    features: NDArray[np.floating],
    targets: NDArray[np.floating],
    *,
    seed: int,
    rounds: int = 300,
    rate: float = 0.05,
    leaves: int = 15,
    levels: Sequence[float] = LEVELS,
    advance: Callable[[int], None] = lambda done: None,
) -> Boosting:
    """Fits trees to clips.

    The number of rounds is fixed: stopping early on clips drawn at random would judge by other
    clips of the same sequences.

    Args:
        features: (n, f).
        targets: (n, t).
        seed: of the bins, which are made from a draw of 200,000 clips where there are more.
        rounds: trees of each ensemble.
        rate: by which each tree counts.
        leaves: of each tree, at most.
        levels: of the quantiles, ascending, at least two.
        advance: called with 1 after each ensemble, `ENSEMBLES` times for each target where the
            levels are `LEVELS`.

    Raises:
        InputError: sizes that differ, numbers that are not finite, or a number out of its range.
    """
    x, y = np.asarray(features, dtype=np.float64), np.asarray(targets, dtype=np.float64)
    require_table(x, y, np.arange(len(x)))
    if rounds < 1 or not 0 < rate <= 1 or leaves < 2:
        raise InputError(
            f"{rounds} rounds at rate {rate} with {leaves} leaves",
            fix="give at least 1 round, a rate in (0, 1] and at least 2 leaves",
        )
    ascending = tuple(float(level) for level in levels)
    if (
        len(ascending) < 2
        or ascending != tuple(sorted(set(ascending)))
        or not 0 < ascending[0] < ascending[-1] < 1
    ):
        raise InputError(
            f"the levels are {ascending}", fix="give at least two between 0 and 1, ascending"
        )

    def fit_one(
        target: FloatArray, loss: str, level: float | None
    ) -> HistGradientBoostingRegressor:
        trees = HistGradientBoostingRegressor(
            loss=loss,
            quantile=level,
            learning_rate=rate,
            max_iter=rounds,
            max_leaf_nodes=leaves,
            early_stopping=False,  # pyright: ignore[reportArgumentType]  (its default is a string)
            random_state=seed,
        ).fit(x, target)
        advance(1)
        return trees

    return Boosting(
        means=tuple(fit_one(target, "squared_error", None) for target in y.T),
        quantiles=tuple(
            tuple(fit_one(target, "quantile", level) for level in ascending) for target in y.T
        ),
        levels=ascending,
        features=x.shape[1],
    )
