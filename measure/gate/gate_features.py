"""All that the gate measures of a clip: the picture's statistics, hand-made features, the network's
summary, and how far the summary moves under changes that leave the physics as it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.errors import InputError
from measure.gate.checks import measure_statistics
from models.maps.handmade import features as handmade
from models.trained.estimator import Estimator
from models.trained.outliers import Familiarity

MOVES = ("mirrored", "cropped")
"""Changes that leave wind and cloth as they are: left and right exchanged, the middle nine tenths
of the picture."""
_KEPT = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class Features:
    """What was measured of one clip.

    Attributes:
        checks: (len(CHECKS),) of `measure.gate.checks`.
        handmade: (len(FEATURES),) of `models.maps.handmade`.
        summary: (d,) of the network's first learner.
        distance: of the summary to the training clips' (`models.trained.outliers`).
        moved: (len(MOVES),) whitened distances that the summary moves by.
    """

    checks: FloatArray
    handmade: FloatArray
    summary: FloatArray
    distance: float
    moved: FloatArray

    def vector(self, model: Estimator) -> FloatArray:
        """Joins all features, (f,): the summary whitened by the training clips' covariance,
        distances as logarithms."""
        cloud = _cloud(model)
        logs = np.log10(np.maximum([self.distance, *self.moved], 1e-3))
        return np.concatenate(
            [self.checks, self.handmade, cloud.whitening @ (self.summary - cloud.centre), logs]
        )


def features_of(
    model: Estimator, frames: UInt8Array, summary: NDArray[np.floating] | None = None
) -> Features:
    """Measures a clip.

    Args:
        model: with a cloud of training summaries.
        frames: (n, height, width) gray, n and their rate the model's.
        summary: (d,) the network's first learner's of them, where it is known already.

    Raises:
        InputError: frames that do not fit the model, a clip without contrast, or a model without a
            cloud.
    """
    cloud = _cloud(model)
    side = min(frames.shape[1:])
    cut = round(side * (1 - _KEPT) / 2)
    top, left = (frames.shape[1] - side) // 2, (frames.shape[2] - side) // 2
    square = frames[:, top : top + side, left : left + side]
    middle = square[:, cut : side - cut, cut : side - cut]
    clips = (
        [square[..., ::-1], middle] if summary is not None else [square, square[..., ::-1], middle]
    )
    summaries = (
        model.summaries(torch.cat([model.inputs(clip[None]) for clip in clips]))
        .cpu()
        .double()
        .numpy()
    )
    embedding = summaries[0] if summary is None else np.asarray(summary, dtype=np.float64)
    moved = (summaries[-len(MOVES) :] - embedding) @ cloud.whitening.T
    return Features(
        checks=measure_statistics(frames),
        handmade=handmade(torch.from_numpy(square.copy())[None, None], rate=model.front_end.rate)[0]
        .double()
        .numpy(),
        summary=embedding,
        distance=float(cloud.distance(embedding[None])[0]),
        moved=np.linalg.norm(moved, axis=1),
    )


def _cloud(model: Estimator) -> Familiarity:
    if model.cloud is None:
        raise InputError(
            "the model keeps no summaries of its training clips",
            where=f"model {model.name!r}",
            fix="ship it, in a checkout of flagdata: python -m tests.studies shipping keeps them",
        )
    return model.cloud
