"""Training of the network of the cloth's mask on a drawn square."""

from __future__ import annotations

import numpy as np
import torch

from models.conditioning import MaskNetwork, Stills
from tests.studies.masks.films import Example
from tests.studies.masks.training import _moved, scores, train

SIZE = 48


def square(seed: int) -> Example:
    """A bright square that hangs at its left side and changes its length, before a plain
    background."""
    rng = np.random.default_rng(seed)
    left, top = rng.integers(8, 14, 2)
    lengths = rng.integers(10, 24, 12)
    pictures = np.full((12, SIZE, SIZE), 60, np.uint8)
    cloth = np.zeros_like(pictures)
    for k, length in enumerate(lengths):
        pictures[k, top : top + 16, left : left + length] = 160
        cloth[k, top : top + 16, left : left + length] = 255
    ends = np.array([[left, top], [left, top + 16]], np.float32)
    return Example(
        pictures=pictures,
        stills=Stills.of(pictures),
        cloth=cloth,
        hoist=np.repeat(ends[None], 12, axis=0),
    )


def test_cloth_and_hoist_are_moved_together() -> None:
    """Turned, resized, shifted or mirrored, the square's corners at its hoist stay where the ends
    are stated."""
    one = square(0)
    cloth = torch.from_numpy(one.cloth[:1].astype(np.float32) / 255)[:, None]
    x = torch.zeros(1, 4, SIZE, SIZE)
    for seed in range(6):
        _, moved, ends = _moved(
            x, cloth, torch.from_numpy(one.hoist[:1]), np.random.default_rng(seed)
        )
        rows, columns = np.nonzero(moved[0, 0].numpy() > 0.5)
        places = np.stack([columns + 0.5, rows + 0.5], axis=1)
        for end in ends[0].numpy():
            if (end > 2).all() and (end < SIZE - 2).all():
                assert np.hypot(*(places - end).T).min() < 1.8
        outside = places @ (ends[0, 1] - ends[0, 0]).numpy()
        assert np.ptp(outside) < 1.2 * float(((ends[0, 1] - ends[0, 0]) ** 2).sum()) + 60


def test_training_learns_and_repeats() -> None:
    """The square is found in examples that were not learned from, better than by an untrained
    network; and the same seed gives the same weights."""
    examples, judged = [square(k) for k in range(1, 9)], [square(k) for k in range(20, 24)]
    losses: list[float] = []
    found = train(
        examples,
        judged,
        epochs=30,
        seed=3,
        advance=lambda epoch, loss, reached: losses.append(loss),
    )
    assert losses[-1] < 0.85 * losses[0]
    torch.manual_seed(0)
    untrained = MaskNetwork()
    assert scores(found, judged).dice > scores(untrained, judged).dice + 0.2
    again = train(examples[:2], judged[:1], epochs=1, seed=5, advance=lambda *given: None)
    same = train(examples[:2], judged[:1], epochs=1, seed=5, advance=lambda *given: None)
    assert all(
        torch.equal(a, b)
        for a, b in zip(again.state_dict().values(), same.state_dict().values(), strict=True)
    )
