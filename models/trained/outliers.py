"""Whether a clip lies outside what a model was trained on: the distance of its summary, at a stated
false-alarm rate.

The distance is Mahalanobis's with the covariance of Ledoit and Wolf (Journal of Multivariate
Analysis 88, 2004). Its threshold is conformal (Vovk, Gammerman and Shafer, Algorithmic Learning in
a Random World, 2005; Laxhammar and Falkman, 2010): no distribution is assumed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.errors import InputError


def shrunk_covariance(points: NDArray[np.floating]) -> tuple[FloatArray, float]:
    """Returns the covariance (d, d) of points (n, d), drawn towards m·1, and by how much, from 0 to
    1.

    Σ* = ρ m 1 + (1 − ρ) S with S = XᵀX/n, m = tr S/d, ρ = b²/d², d² = ‖S − m 1‖²/d and b² = min(d²,
    Σ ‖x xᵀ − S‖²/(d n²)): Ledoit and Wolf 2004, lemmas 3.2 to 3.4 and equation 14.

    Raises:
        InputError: fewer than two points, or numbers that are not finite.
    """
    x = np.asarray(points, dtype=np.float64)
    if x.ndim != 2 or len(x) < 2 or not np.isfinite(x).all():
        raise InputError(
            f"the summaries have the shape {x.shape}, or are not finite",
            fix="give (n, d) with at least 2 clips",
        )
    x = x - x.mean(axis=0)
    n, d = x.shape
    sample = x.T @ x / n
    level = np.trace(sample) / d
    spread = np.square(sample - level * np.eye(d)).sum() / d
    fourth = np.square(np.square(x).sum(axis=1)).sum()
    noise = (fourth - n * np.square(sample).sum()) / (d * n**2)
    shrinkage = float(min(noise, spread) / spread) if spread > 0 else 1.0
    return shrinkage * level * np.eye(d) + (1 - shrinkage) * sample, shrinkage


def whitening(covariance: NDArray[np.floating], *, least: float) -> FloatArray:
    """Returns W (d, d) with WᵀW the inverse of a covariance whose eigenvalues are raised to
    `least`."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors.T / np.sqrt(np.maximum(values, least))[:, None])


def conformal_p(
    reference: NDArray[np.floating], scores: NDArray[np.floating] | float
) -> FloatArray:
    """Returns p of scores (…): (1 + reference scores that are at least as large)/(their number +
    1).

    Exact for a score that is exchangeable with the reference ones, whatever their distribution.

    Args:
        reference: (n,) ascending, of clips that shaped nothing of what scores them.
    """
    smaller = np.searchsorted(reference, scores, side="left")
    return np.asarray((1 + len(reference) - smaller) / (len(reference) + 1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Familiarity:
    """How usual summaries are among those of the training and validation clips.

    Attributes:
        centre: (d,), mean of the training summaries.
        whitening: (d, d), W with WᵀW = Σ*⁻¹ of the training summaries.
        reference: (n,), ascending distances of validation clips, which were not trained on.
    """

    centre: FloatArray
    whitening: FloatArray
    reference: FloatArray

    @classmethod
    def of(cls, training: NDArray[np.floating], validation: NDArray[np.floating]) -> Familiarity:
        """Measures it on summaries (n, d) of training clips and of validation clips.

        The stated rate holds for a clip that is exchangeable with the validation clips, so take one
        clip of each
        sequence for these: clips of one sequence are alike.

        Raises:
            InputError: summaries of different lengths, too few, or not finite; all training
                summaries equal.
        """
        covariance, _ = shrunk_covariance(training)
        values, vectors = np.linalg.eigh(covariance)
        if values[0] <= 0:
            raise InputError(
                "all training summaries are equal", fix="train the network, or give more clips"
            )
        deviations: FloatArray = np.sqrt(values)
        cloud = cls(
            centre=np.asarray(training, dtype=np.float64).mean(axis=0),
            whitening=np.diag(1 / deviations) @ vectors.T,
            reference=np.zeros(0),
        )
        reference = np.sort(cloud.distance(validation))
        if len(reference) == 0 or not np.isfinite(reference).all():
            raise InputError(
                "there are no validation summaries, or some are not finite",
                fix="give at least one, finite",
            )
        return cls(centre=cloud.centre, whitening=cloud.whitening, reference=reference)

    def distance(self, summaries: NDArray[np.floating]) -> FloatArray:
        """Mahalanobis distance of summaries (n, d) from the training clips: (n,), infinite where
        not finite."""
        x = np.asarray(summaries, dtype=np.float64)
        if x.ndim != 2 or x.shape[1] != len(self.centre):
            raise InputError(
                f"the summaries have the shape {x.shape}", fix=f"give (n, {len(self.centre)})"
            )
        finite = np.asarray(np.isfinite(x).all(axis=1))
        offset = np.where(finite[:, None], x, self.centre) - self.centre
        return np.where(finite, np.linalg.norm(offset @ self.whitening.T, axis=1), np.inf)

    def p_value(self, summaries: NDArray[np.floating]) -> FloatArray:
        """Computes the conformal p of summaries (n, d): (1 + validation clips at least as
        far)/(validation clips + 1), (n,).
        """
        return conformal_p(self.reference, self.distance(summaries))

    def threshold(self, false_alarm: float) -> float:
        """Returns the distance beyond which a clip is called unfamiliar, such that this happens to
        familiar ones at most so often.

        Args:
            false_alarm: share of familiar clips, above 0.

        Raises:
            InputError: a share that is out of range or finer than the number of validation clips
                allows.
        """
        n = len(self.reference)
        if not 0 < false_alarm < 1:
            raise InputError(
                f"the false-alarm rate is {false_alarm}", fix="give a share between 0 and 1"
            )
        exceeded = int(np.floor(false_alarm * (n + 1) + 1e-9))
        if exceeded < 1:
            raise InputError(
                f"{n} validation clips are too few for a false-alarm rate of {false_alarm:g}",
                fix=f"give a rate of {1 / (n + 1):.2g} or more, or at least "
                f"{int(np.ceil(1 / false_alarm)) - 1} clips",
            )
        return float(self.reference[n - exceeded])

    def unfamiliar(self, summaries: NDArray[np.floating], *, false_alarm: float) -> BoolArray:
        """Masks the summaries (n, d) that lie outside: beyond `threshold`, which is p ≤
        false_alarm: (n,)."""
        return self.distance(summaries) > self.threshold(false_alarm)

    def arrays(self) -> dict[str, FloatArray]:
        """Returns all of its state by name, as it can be stored."""
        return {"centre": self.centre, "whitening": self.whitening, "reference": self.reference}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, FloatArray]) -> Familiarity:
        """Rebuilds it from what `arrays` gave.

        Raises:
            KeyError, InputError: arrays that `arrays` does not give.
        """
        centre, whitening, reference = (
            arrays[name] for name in ("centre", "whitening", "reference")
        )
        if (
            centre.ndim != 1
            or whitening.shape != (len(centre), len(centre))
            or reference.ndim != 1
            or not len(reference)
        ):
            raise InputError(
                f"the cloud has the shapes {centre.shape}, {whitening.shape} and {reference.shape}",
                fix="give (d,), (d, d) and (clips,)",
            )
        return cls(centre=centre, whitening=whitening, reference=reference)
