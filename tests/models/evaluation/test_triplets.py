"""Triplet accuracy by enumeration."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from flagdata.errors import InputError
from models.evaluation import Resamples
from models.evaluation.triplets import accuracy_values, draw, possible
from tests.models.evaluation.made import generator

GROUP = np.array([4, 7, 4, 7, 7, 1, 4])


def enumerated(embedding: np.ndarray, weight: dict[int, float]) -> float:
    """Over every triplet, each weighted by its two groups; ties half."""
    hits = total = 0.0
    for a, p, n in product(range(len(GROUP)), repeat=3):
        if a != p and GROUP[a] == GROUP[p] and GROUP[a] != GROUP[n]:
            near, far = (
                (embedding[a] - embedding[i]) @ (embedding[a] - embedding[i]) for i in (p, n)
            )
            own = weight[GROUP[a]] * weight[GROUP[n]]
            hits += own * (1.0 if near < far else 0.5 if near == far else 0.0)
            total += own
    return hits / total


def test_every_triplet_once_gives_the_accuracy_of_the_enumeration_for_every_draw_of_groups() -> (
    None
):
    embedding = (
        generator(1).integers(0, 3, size=(7, 2)).astype(float)
    )  # whole numbers, so that there are ties
    resamples = Resamples.of(GROUP, generator=generator(2), draws=8)
    every = [
        (a, p, n)
        for a, p, n in product(range(len(GROUP)), repeat=3)
        if a != p and GROUP[a] == GROUP[p] and GROUP[a] != GROUP[n]
    ]
    values = accuracy_values(embedding, np.array(every), resamples)
    for count, value in zip(resamples.counts, values, strict=True):
        weight = dict(zip((1, 4, 7), count, strict=True))
        if weight[4] * (weight[1] + weight[7]) + weight[7] * weight[1] > 0:
            assert value == pytest.approx(enumerated(embedding, weight))
        else:
            assert np.isnan(value)


def test_a_tie_counts_half_and_a_perfect_embedding_has_one() -> None:
    group = np.array([1, 1, 2, 2])
    resamples = Resamples.of(group, generator=generator(1), draws=2)
    triplets = draw(group, seed=3, count=50)
    crossed = [[0, 0], [1, 1], [0, 1], [1, 0]]
    for points, expected in (
        ([[0], [0], [0], [0]], 0.5),
        ([[0], [1], [5], [6]], 1.0),
        (crossed, 0.0),
    ):
        embedding = np.array(points, dtype=np.float32)
        assert accuracy_values(embedding, triplets, resamples)[0] == expected


def test_drawn_triplets_are_triplets_and_reach_every_one_there_is() -> None:
    anchor, positive, negative = draw(GROUP, seed=5, count=4000).T
    assert (anchor != positive).all()
    assert (GROUP[anchor] == GROUP[positive]).all()
    assert (GROUP[anchor] != GROUP[negative]).all()
    # 3 anchors × 2 positives × 4 negatives of each of two groups
    assert len(set(zip(anchor.tolist(), positive.tolist(), negative.tolist(), strict=True))) == 48
    counts = np.unique(anchor, return_counts=True)[1] / 4000
    np.testing.assert_allclose(counts, 1 / 6, atol=4 * np.sqrt(1 / 6 / 4000))


def test_triplets_follow_the_seed_alone() -> None:
    np.testing.assert_array_equal(draw(GROUP, seed=5), draw(GROUP, seed=5))
    assert (draw(GROUP, seed=5) != draw(GROUP, seed=6)).any()


@pytest.mark.parametrize("group", [[1, 1, 1], [1, 2, 3], [1]])
def test_clips_without_a_triplet_are_refused(group: list[int]) -> None:
    assert not possible(np.array(group))
    with pytest.raises(InputError, match="no triplet"):
        draw(np.array(group), seed=1)
