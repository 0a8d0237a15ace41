"""What a trained model said of clips: the input to every score."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import Float32Array, FloatArray, IntArray
from flagdata.errors import InputError, UnknownNameError

WIND = "wind_speed"
AREA_WEIGHT = "area_weight"


@dataclass(frozen=True, kw_only=True, eq=False)
class Predictions:
    """What one trained model said of n clips.

    Attributes:
        label: the model's name in the table. Several predictions of one label are runs of it with
            other seeds.
        targets: names of t quantities: "wind_speed" [m/s], "area_weight" [kg/m²], "log_bending",
            "anisotropy", ...
        truth: (n, t) float64, SI.
        mean: (n, t) float64, point estimates.
        samples: (n, s, t) float32, s ≥ 2 draws of the predictive distribution of each clip; None
            for a model without.
        embedding: (n, d) float32; None for a model without.
        group: (n,) int64, seed of the clip's simulation. Clips of one sequence are not independent.
        parameters: of the network.
        milliseconds: time a clip takes on one core, from pixels [ms].
        note: input size, epochs, what differs from the paper.

    Raises:
        InputError: shapes or types that do not fit, values that are not finite, a target named
            twice.
    """

    label: str
    targets: tuple[str, ...]
    truth: FloatArray
    mean: FloatArray
    samples: Float32Array | None
    embedding: Float32Array | None
    group: IntArray
    parameters: int
    milliseconds: float
    note: str

    def __post_init__(self) -> None:
        where = f"predictions of {self.label!r}"
        if not self.label.strip():
            raise InputError("the model has no name", where="predictions", fix="give a label")
        if not self.targets or len(set(self.targets)) < len(self.targets):
            raise InputError(
                f"the targets are {', '.join(self.targets) or 'none'}",
                where=where,
                fix="name each target once",
            )
        clips, targets = (self.truth.shape[0] if self.truth.ndim else 0), len(self.targets)
        if clips == 0:
            raise InputError("there is no clip", where=where, fix="predict at least one clip")
        self._check(where, "truth", self.truth, np.dtype(np.float64), (clips, targets))
        self._check(where, "mean", self.mean, np.dtype(np.float64), (clips, targets))
        self._check(where, "group", self.group, np.dtype(np.int64), (clips,))
        if self.samples is not None:
            draws = self.samples.shape[1] if self.samples.ndim == 3 else 2
            self._check(
                where, "samples", self.samples, np.dtype(np.float32), (clips, draws, targets)
            )
            if draws < 2:
                raise InputError(
                    f"there is {draws} sample a clip",
                    where=where,
                    fix="draw at least 2, better 200",
                )
        if self.embedding is not None:
            dimension = self.embedding.shape[1] if self.embedding.ndim == 2 else 1
            self._check(
                where, "embedding", self.embedding, np.dtype(np.float32), (clips, dimension)
            )
            if dimension == 0:
                raise InputError(
                    "the embedding has no dimension",
                    where=where,
                    fix="give None for a model without",
                )
        if self.parameters < 0 or not math.isfinite(self.milliseconds) or self.milliseconds < 0:
            raise InputError(
                f"the model has {self.parameters} parameters and takes {self.milliseconds} ms a "
                "clip",
                where=where,
                fix="give both as numbers of 0 or more",
            )

    @staticmethod
    def _check(
        where: str, name: str, array: NDArray, dtype: np.dtype, shape: tuple[int, ...]
    ) -> None:
        if array.dtype != dtype or array.shape != shape:
            raise InputError(
                f"{name} is {array.dtype} {array.shape}, not {dtype} {shape}",
                where=where,
                fix="give one row for each clip and one column for each target, in the types that "
                "Predictions states",
            )
        if not np.isfinite(array).all():
            bad = int(np.argwhere(~np.isfinite(array))[0][0])
            raise InputError(
                f"{name} holds a value that is not finite",
                where=f"{where}, clip {bad}",
                fix="a model that gives NaN has no score; look at its loss and its input",
            )

    @property
    def clips(self) -> int:
        return len(self.group)

    @property
    def groups(self) -> int:
        """How many sequences the clips are of."""
        return len(np.unique(self.group))

    def column(self, target: str) -> int:
        """Returns the column of a target in `truth`, `mean` and `samples`.

        Raises:
            UnknownNameError: the model does not give it.
        """
        if target not in self.targets:
            raise UnknownNameError.of(
                "target", target, self.targets, where=f"predictions of {self.label!r}"
            )
        return self.targets.index(target)
