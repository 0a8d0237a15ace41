"""Triplet accuracy of an embedding: how often a clip is nearer to one of its own simulation than to
one of another.

Veit, Belongie and Karaletsos, Conditional similarity networks, CVPR 2017; Runia et al., Cloth in
the Wind, CVPR 2020, section 6. Distances are Euclidean; ties count half.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.core import rng
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from models.evaluation.bootstrap import Resamples

COUNT = 3500
"""Triplets the paper drew from its test set."""


def possible(group: IntArray) -> bool:
    """Returns whether clips (n,) of these groups have any triplet: two groups, one of them with two
    clips."""
    size = np.unique(group, return_counts=True)[1]
    return len(size) > 1 and bool((size > 1).any())


def draw(group: IntArray, *, seed: int, count: int = COUNT) -> IntArray:
    """Draws triplets (count, 3) of clips: anchor, positive, negative; the same for one seed.

    The anchor is uniform among clips that share their group with another, the positive among those
    others, the negative among clips of other groups.

    Raises:
        InputError: there is no triplet, or a count below 1.
    """
    _check(group)
    if count < 1:
        raise InputError(f"{count} triplets are too few", where="count", fix="give at least 1")
    generator = rng.stream(seed, "evaluation", "triplets")
    order = np.argsort(group, kind="stable")
    _, start, size = np.unique(group[order], return_index=True, return_counts=True)
    of = np.repeat(np.arange(len(size)), size)
    anchor = generator.choice(np.flatnonzero(size[of] > 1), size=count)
    first, members = start[of[anchor]], size[of[anchor]]
    positive = first + (anchor - first + 1 + generator.integers(0, members - 1)) % members
    negative = generator.integers(0, len(group) - members)
    negative = np.where(negative < first, negative, negative + members)
    return order[np.column_stack([anchor, positive, negative])]


def accuracy_values(
    embedding: NDArray[np.floating], triplets: IntArray, resamples: Resamples
) -> FloatArray:
    """Computes (1 + draws,) triplet accuracies in the data and in each draw of groups.

    A triplet rests on two sequences; in a draw it counts as often as the product of their
    occurrences.

    Args:
        embedding: (n, d).
        triplets: (t, 3).
        resamples: of the clips' groups.
    """
    points = embedding.astype(np.float64)
    anchor, positive, negative = triplets.T
    to_positive = ((points[anchor] - points[positive]) ** 2).sum(axis=1)
    to_negative = ((points[anchor] - points[negative]) ** 2).sum(axis=1)
    hits, of = (np.zeros((resamples.groups, resamples.groups)) for _ in range(2))
    groups = (resamples.index[anchor], resamples.index[negative])
    np.add.at(hits, groups, (to_positive < to_negative) + 0.5 * (to_positive == to_negative))
    np.add.at(of, groups, 1.0)
    return resamples.pair_ratio(hits, of)


def _check(group: IntArray) -> None:
    if not possible(group):
        raise InputError(
            "there is no triplet among the clips: two of one simulation and one of another",
            where="the groups of clips",
            fix="give clips of at least two simulations, two or more of one of them",
        )
