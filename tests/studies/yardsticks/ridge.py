"""Ridge regression of several targets on features, its penalty chosen on sequences left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

PENALTIES = tuple(float(10.0**k) for k in np.arange(-4, 3.5, 0.5))
"""Penalties that are tried, in units of the number of clips (features are standardised)."""

FOLDS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class Ridge:
    """ŷ = intercept + (x − centre) / scale · weights (Hoerl and Kennard, Technometrics 12, 1970).

    Attributes:
        centre: (f,), means of the features over the training clips.
        scale: (f,), their standard deviations; 1 for features that are constant there, whose
            weights are 0.
        weights: (f, t).
        intercept: (t,).
        penalty: (t,), chosen for each target, a multiple of the number of clips.
    """

    centre: FloatArray
    scale: FloatArray
    weights: FloatArray
    intercept: FloatArray
    penalty: FloatArray

    def predict(self, features: NDArray[np.floating]) -> FloatArray:
        """Estimates the targets of clips with features (n, f): (n, t)."""
        if features.ndim != 2 or features.shape[1] != len(self.centre):
            raise InputError(
                f"the features have the shape {features.shape}, and the ridge takes "
                f"{len(self.centre)}",
                fix=f"give (n, {len(self.centre)})",
            )
        return (features - self.centre) / self.scale @ self.weights + self.intercept

    def arrays(self) -> dict[str, FloatArray]:
        """Returns all of its state by name, as it can be stored."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, FloatArray]) -> Ridge:
        """Rebuilds it from what `arrays` gave."""
        return cls(**{field.name: np.asarray(arrays[field.name]) for field in fields(cls)})


def fit_ridge(
    features: NDArray[np.floating], targets: NDArray[np.floating], *, group: NDArray[np.integer]
) -> Ridge:
    """Fits a ridge to clips, for each target with the penalty of least squared error on sequences
    left out.

    Sequences are dealt out to `FOLDS` folds in the order of their numbers: clips of one sequence
    are in one fold, since they share all that is to be estimated.

    Args:
        features: (n, f).
        targets: (n, t).
        group: (n,), the sequence of each clip.

    Raises:
        InputError: sizes that differ, numbers that are not finite, or fewer sequences than folds.
    """
    x, y = np.asarray(features, dtype=np.float64), np.asarray(targets, dtype=np.float64)
    require_table(x, y, group)
    check_folds(group)
    sequence = np.unique(group, return_inverse=True)[1]
    fold = sequence % FOLDS
    error = np.zeros((len(PENALTIES), y.shape[1]))
    for left_out in range(FOLDS):
        training = fold != left_out
        for row, ridge in enumerate(_path(x[training], y[training])):
            error[row] += np.square(ridge.predict(x[~training]) - y[~training]).sum(axis=0)
    best = error.argmin(axis=0)
    path = list(_path(x, y))
    return Ridge(
        centre=path[0].centre,
        scale=path[0].scale,
        weights=np.stack([path[row].weights[:, target] for target, row in enumerate(best)], axis=1),
        intercept=path[0].intercept,
        penalty=np.array(PENALTIES)[best],
    )


def check_folds(group: NDArray[np.integer]) -> None:
    """Checks that clips of these sequences (n,) can be dealt out.

    Raises:
        InputError: fewer sequences than folds.
    """
    if (sequences := len(np.unique(group))) < FOLDS:
        raise InputError(
            f"{sequences} sequences cannot be dealt out to {FOLDS} folds", fix="give more sequences"
        )


def require_table(features: FloatArray, targets: FloatArray, group: NDArray[np.integer]) -> None:
    """Checks that features (n, f), targets (n, t) and groups (n,) are of the same clips, and
    finite.

    Raises:
        InputError: they are not.
    """
    if features.ndim != 2 or targets.ndim != 2 or not len(features) == len(targets) == len(group):
        raise InputError(
            f"the features have the shape {features.shape}, the targets {targets.shape}, the "
            f"groups {group.shape}",
            fix="give (n, f), (n, t) and (n,) of the same clips",
        )
    if not (np.isfinite(features).all() and np.isfinite(targets).all()):
        clip = int(
            np.flatnonzero(~(np.isfinite(features).all(axis=1) & np.isfinite(targets).all(axis=1)))[
                0
            ]
        )
        raise InputError(
            "features or targets are not finite", where=f"clip {clip}", fix="leave that clip out"
        )


def _path(x: FloatArray, y: FloatArray) -> list[Ridge]:
    """Returns the ridge of each of `PENALTIES`, by one singular value decomposition."""
    centre, spread = x.mean(axis=0), x.std(axis=0)
    scale = np.where(spread > 1e-12 * (1 + np.abs(centre)), spread, 1.0)
    standardised = np.where(spread > 1e-12 * (1 + np.abs(centre)), (x - centre) / scale, 0.0)
    u, singular, vt = np.linalg.svd(standardised, full_matrices=False)
    along = u.T @ (y - y.mean(axis=0))
    ridges = []
    for penalty in PENALTIES:
        shrunk = singular / (np.square(singular) + penalty * len(x))
        ridges.append(
            Ridge(
                centre=centre,
                scale=scale,
                weights=vt.T @ (shrunk[:, None] * along),
                intercept=y.mean(axis=0),
                penalty=np.full(y.shape[1], penalty),
            )
        )
    return ridges
