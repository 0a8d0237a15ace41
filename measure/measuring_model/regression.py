"""Ridge regression of the log's wind on what windows show, chosen by cross-validation over blocks
of time.

*Neighbours.* A window is joined by the one before and the one after it, since a flag follows the
wind and a cup follows it later. A neighbour that is missing is replaced by the window itself.

*Errors in both.* The log's noise widens the residuals and biases no coefficient. The features' own
errors are those of any later film of this flag from this place, so that the regression of wind on
features as they are read is the one that predicts (Fuller, Measurement Error Models, 1987, section
1.6.3); correcting it for attenuation would make it worse. The clock between film and log has one
error for the whole recording, which is fitted before the rest, without neighbours,
since these would make up for it: an offset is as probable as its prior and the errors of the blocks
left out make it.

*Two penalties.* A summary has many numbers that say little each, beside a few features with names
and units that say more. Under one penalty either the first are fitted to noise or the second are
lost, so that both have their own.

*Blocks.* Windows of one gust are alike, so that whole blocks of time are left out, and the windows
next to a block are not fitted either when it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray

BLOCK = 20.0
"""Length of a block [s]: gusts last some seconds. Longer makes blocks more independent and leaves
fewer of them; shorter makes errors look smaller than they are."""
PENALTIES = tuple(float(v) for v in np.geomspace(1.0, 1e5, 21))
"""Penalties that are tried, in squares of standardised features."""
WEIGHTS = (1.0, 3.0, 10.0, 30.0)
"""Weights of the named features that are tried: their penalty is over the square."""
_BESIDE = 2
"""Windows beside a block that are left out with it: they share its neighbours. With fewer, the fit
has seen what it is tested on, and errors look smaller."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ridge:
    """A linear predictor.

    Attributes:
        centre, spread: (column,) of the features that it was fitted to.
        coefficients: (column,) of standardised features [m/s].
        offset: [m/s].
        penalty: that was chosen.
    """

    centre: FloatArray
    spread: FloatArray
    coefficients: FloatArray
    offset: float
    penalty: float

    @classmethod
    def fitted(
        cls, rows: FloatArray, winds: FloatArray, penalty: float, weights: FloatArray | float = 1.0
    ) -> Ridge:
        """Fits to rows (n, column) and winds (n,) [m/s], all finite; the penalty of a column is
        divided by its squared weight."""
        centre, spread = _standard(rows, weights)
        offset = float(winds.mean())
        coefficients = _solve_ridge((rows - centre) / spread, winds - offset, [penalty])[0]
        return cls(
            centre=centre, spread=spread, coefficients=coefficients, offset=offset, penalty=penalty
        )

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Predicts winds (n,) [m/s] from rows (n, column)."""
        return self.offset + (rows - self.centre) / self.spread @ self.coefficients


def _standard(rows: FloatArray, weights: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Computes mean and standard deviation of columns, the latter divided by the weights."""
    spread = rows.std(axis=0)
    return rows.mean(axis=0), np.where(spread > 0, spread, 1.0) / weights


def _solve_ridge(rows: FloatArray, winds: FloatArray, penalties: Sequence[float]) -> FloatArray:
    """Solves for the coefficients (penalty, column) of centred rows (n, column) and winds (n,)."""
    left, values, right = np.linalg.svd(rows, full_matrices=False)
    along = left.T @ winds
    return np.stack([(values / (values**2 + penalty) * along) @ right for penalty in penalties])


def with_neighbours(values: FloatArray) -> FloatArray:
    """Joins each window's features (w, feature) with those before and after it: (w, 3 ·
    feature)."""
    before, after = np.roll(values, 1, axis=0), np.roll(values, -1, axis=0)
    before[0], after[-1] = np.nan, np.nan
    return np.concatenate(
        [values, *(np.where(np.isfinite(shifted), shifted, values) for shifted in (before, after))],
        axis=1,
    )


def blocks_of(times: FloatArray, recordings: NDArray[np.int_]) -> NDArray[np.int_]:
    """Numbers the block of time of each window, (n,); no block is of two recordings.

    Args:
        times: (n,) [s].
        recordings: (n,) number of each window's recording.
    """
    block = np.floor((times - times.min()) / BLOCK).astype(int)
    _, numbers = np.unique(np.stack([recordings, block]), axis=1, return_inverse=True)
    return np.asarray(numbers).reshape(-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Validated:
    """What cross-validation over blocks found.

    Attributes:
        penalty: with the least error.
        weights: of the columns, likewise.
        predicted: (n,) of each window by the fit without its block [m/s].
        rmse: root mean square of their errors [m/s].
    """

    penalty: float
    weights: FloatArray
    predicted: FloatArray
    rmse: float


def validate_penalties(
    rows: FloatArray, winds: FloatArray, blocks: NDArray[np.int_], is_named: BoolArray
) -> Validated:
    """Leaves each block out in turn, with the windows around it, for each penalty and weight of the
    named features.

    Args:
        rows: (n, column).
        winds: (n,) [m/s].
        blocks: (n,) of each window; two or more.
        is_named: (column,) which are numbers with a unit, each of which says more than one of a
            summary.
    """
    results = [
        _validate_penalties(rows, winds, blocks, np.where(is_named, weight, 1.0))
        for weight in WEIGHTS
    ]
    return min(results, key=lambda result: result.rmse)


def _validate_penalties(
    rows: FloatArray, winds: FloatArray, blocks: NDArray[np.int_], weights: FloatArray
) -> Validated:
    predicted = np.empty((len(PENALTIES), len(winds)))
    for block in np.unique(blocks):
        inside = np.flatnonzero(blocks == block)
        fitted = np.ones(len(winds), bool)
        fitted[max(0, inside[0] - _BESIDE) : inside[-1] + _BESIDE + 1] = False
        centre, spread = _standard(rows[fitted], weights)
        offset = winds[fitted].mean()
        coefficients = _solve_ridge(
            (rows[fitted] - centre) / spread, winds[fitted] - offset, PENALTIES
        )
        predicted[:, inside] = offset + coefficients @ ((rows[inside] - centre) / spread).T
    errors = np.sqrt(np.square(predicted - winds).mean(axis=1))
    best = int(errors.argmin())
    return Validated(
        penalty=PENALTIES[best],
        weights=weights,
        predicted=predicted[best],
        rmse=float(errors[best]),
    )
