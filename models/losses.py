"""Losses: physical similarity by contrast, regression of wind and material, likelihood of a mixture."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import pdist

from flagdata.errors import InputError
from models.mixture import Mixture


@dataclass(frozen=True, kw_only=True, eq=False)
class Standardisation:
    """Means and standard deviations of targets over the training set, which make their losses comparable.

    Attributes:
        mean: (targets,), in the targets' own units.
        deviation: (targets,), likewise, above 0.
    """

    mean: Tensor
    deviation: Tensor

    def __post_init__(self) -> None:
        if self.mean.ndim != 1 or self.mean.shape != self.deviation.shape:
            raise InputError(
                f"means of shape {tuple(self.mean.shape)} and deviations of {tuple(self.deviation.shape)}",
                fix="give one of each for every target",
            )
        if not bool((self.deviation > 0).all()) or not bool(torch.isfinite(self.mean).all()):
            raise InputError(
                "a target that is constant or not finite in the training set cannot be learned",
                where=f"means {self.mean.tolist()}, deviations {self.deviation.tolist()}",
                fix="leave that target out, or widen its range in the data set",
            )

    @classmethod
    def of(cls, targets: Tensor) -> Standardisation:
        """Measure targets (n, targets) of the training set."""
        return cls(mean=targets.mean(dim=0), deviation=targets.std(dim=0, correction=0))

    def standardised(self, targets: Tensor) -> Tensor:
        """Return targets (…, targets) less their mean, over their deviation."""
        return (targets - self.mean) / self.deviation

    def restored(self, standardised: Tensor) -> Tensor:
        """Return standardised targets (…, targets) in their own units."""
        return standardised * self.deviation + self.mean


def contrastive_loss(
    embedding: Tensor, seed: Tensor, *, margin: float = 1.0, positive_share: float | None = None
) -> Tensor:
    """Pull clips of one simulation together and push others apart to the margin, over all pairs of the batch.

    The mean over all n(n − 1)/2 pairs (BatchAll) of y D² + (1 − y) max(0, m − D)², with D the Euclidean distance of the
    two embeddings and y = 1 where both clips are renders of one simulation (Hadsell, Chopra and LeCun, CVPR 2006,
    equation 4 without its factor 1/2; Runia et al., section 3.1). Coincident embeddings of a negative pair have no
    direction to part in, and get gradient 0.

    Args:
        embedding: (n, dimension).
        seed: (n,) integers, the simulation's seed of each clip.
        margin: m.
        positive_share: None to count every pair alike, as the paper does. A batch of 16 simulations with two clips each
            has 16 positive pairs and 480 negative ones; a share of 0.5 weighs the mean over the positive pairs as much
            as that over the negative ones.

    Raises:
        InputError: a batch without positive or without negative pairs, sizes that differ, or a number out of range.
    """
    if embedding.ndim != 2 or seed.shape != embedding.shape[:1]:
        raise InputError(
            f"embeddings of shape {tuple(embedding.shape)} with seeds of shape {tuple(seed.shape)}",
            fix="give (n, dimension) and (n,)",
        )
    if margin <= 0 or (positive_share is not None and not 0 < positive_share < 1):
        raise InputError(
            f"margin {margin}, share of positive pairs {positive_share}",
            fix="give a margin above 0 and a share between 0 and 1",
        )
    first, second = torch.triu_indices(len(seed), len(seed), offset=1, device=seed.device)
    positive = seed[first] == seed[second]
    found = int(positive.sum())
    if found == 0:
        raise InputError(
            f"none of the {len(seed)} clips of this batch are of one simulation",
            fix="draw batches by simulation, at least two clips of each",
        )
    if found == len(positive):
        raise InputError(
            f"all {len(seed)} clips of this batch are of one simulation", fix="draw at least two simulations a batch"
        )
    distance = pdist(embedding)
    pulled = distance[positive].square()
    pushed = (margin - distance[~positive]).relu().square()
    if positive_share is None:
        return (pulled.sum() + pushed.sum()) / len(positive)
    return positive_share * pulled.mean() + (1 - positive_share) * pushed.mean()


def regression_loss(
    prediction: Tensor, target: Tensor, *, standardisation: Standardisation, weights: Tensor | None = None
) -> Tensor:
    """Mean squared error of standardised targets: of the wind speed, of material parameters, or of both together.

    Wind speed [m/s] is linear in its range. Material parameters that are positive and span a decade (bending) are to be
    given as logarithms. Each target counts alike: an error of one standard deviation of the training set costs 1.

    Args:
        prediction: (n, targets), standardised, as a linear head gives it.
        target: (n, targets), in the targets' own units.
        standardisation: of the training set.
        weights: (targets,), not negative, of which only the ratios matter; None for equal ones.

    Raises:
        InputError: sizes that differ, or weights that are negative or all zero.
    """
    targets = len(standardisation.mean)
    if prediction.shape != target.shape or target.shape[-1] != targets or target.ndim != 2:
        raise InputError(
            f"predictions of shape {tuple(prediction.shape)} for targets of shape {tuple(target.shape)}",
            fix=f"give (n, {targets}) of both",
        )
    error = (prediction - standardisation.standardised(target)).square().mean(dim=0)
    if weights is None:
        return error.mean()
    if weights.shape != (targets,) or bool((weights < 0).any()) or not bool(weights.sum() > 0):
        raise InputError(f"weights {weights.tolist()}", fix=f"give {targets} numbers, none negative, not all zero")
    return (weights * error).sum() / weights.sum()


def negative_log_likelihood(mixture: Mixture, target: Tensor, *, standardisation: Standardisation) -> Tensor:
    """Mean of −log p(standardised target) under the mixtures of a batch [nats].

    Args:
        mixture: of n clips, of standardised targets.
        target: (n, targets), in the targets' own units.
        standardisation: of the training set.
    """
    return -mixture.log_prob(standardisation.standardised(target)).mean()
