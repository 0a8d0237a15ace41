"""The contrastive loss, which learns physical similarity; what a head's own loss is, `models.learner` says."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import pdist

from flagdata.errors import InputError


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
