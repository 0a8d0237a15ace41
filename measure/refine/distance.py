"""How far a simulated clip is from the target, in the embedding: squared, plain or in the replicates' covariance.

Two clips of one θ differ. A fit that is nearer to the target than they are to each other fits noise: their distance is
the *noise floor*, where a refinement has nothing left to do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from models.outliers import shrunk_covariance


def squared(embedding: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared Euclidean distance of embeddings (…, d) to one (d,): (…), infinite where a simulation failed.

    Runia et al. 2020, section 3.1.
    """
    found = np.square(embedding - target).sum(axis=-1)
    return np.where(np.isfinite(found), found, np.inf)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReplicateMetric:
    """Mahalanobis's distance in the covariance of replicates.

    Attributes:
        whitening: (d, d), W with WᵀW = Σ*⁻¹.
        shrinkage: by how much Σ* was drawn towards a multiple of the unit matrix, 0 to 1 (Ledoit and Wolf, Journal of
            Multivariate Analysis 88, 2004).
        floor: median squared distance of two replicates of one θ.
        pairs: of replicates that it was found from.
    """

    whitening: NDArray[np.float64]
    shrinkage: float
    floor: float
    pairs: int

    @classmethod
    def of(cls, groups: list[NDArray[np.float64]]) -> ReplicateMetric:
        """Measure it on the embeddings (replicate, d) of some θ; failed ones are left out.

        Deviations from their θ's mean are enlarged by √(R/(R − 1)), so that their covariance is that of replicates.

        Raises:
            InputError: fewer than two θ with two replicates, or replicates that do not differ.
        """
        finite = [group[np.isfinite(group).all(axis=1)] for group in groups]
        several = [group for group in finite if len(group) > 1]
        if len(several) < 2:
            raise InputError(
                f"{len(several)} points with two replicates", fix="evaluate at least two points, each twice or more"
            )
        deviations = [(g - g.mean(axis=0)) * np.sqrt(len(g) / (len(g) - 1)) for g in several]
        rows = np.concatenate(deviations)
        covariance, shrinkage = shrunk_covariance(np.concatenate([rows, -rows]))  # so that their mean is nought
        values, vectors = np.linalg.eigh(covariance)
        if values[0] <= 0:
            raise InputError("replicates do not differ", fix="let their starts or cameras differ")
        whitening = np.diag(values**-0.5) @ vectors.T
        between = [
            float(np.square(whitening @ (group[i] - group[j])).sum())
            for group in several
            for i in range(len(group))
            for j in range(i)
        ]
        return cls(whitening=whitening, shrinkage=shrinkage, floor=float(np.median(between)), pairs=len(between))

    def squared(self, embedding: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
        """Squared distance of embeddings (…, d) to one (d,): (…), infinite where a simulation failed."""
        return squared(embedding @ self.whitening.T, self.whitening @ target)
