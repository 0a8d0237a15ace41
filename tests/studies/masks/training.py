"""From examples to weights: pictures are turned, resized, shifted and inverted, then learned from
with Adam."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from models.conditioning import MaskNetwork, inputs_of
from tests.studies.masks.films import Example

_BATCH = 32
_PICTURES = 4
"""Of each film in an epoch."""
_RATE = 3e-3
"""Greatest learning rate; it rises over a tenth of the steps and falls with a cosine (Smith and
Topin 2019)."""
_DICE, _ENDS = 0.5, 0.15
"""Weights of one less Dice's coefficient and of the hoist's ends beside the cross entropy of the
cloth."""
_BLUR = 1.5
"""Deviation of the place of an end that is learned [px]."""
_SMALLER, _LARGER, _SHIFT, _TURN = 0.75, 1.25, 10.0, 0.09
"""Ranges of the size, the place [px] and the angle [rad] in which pictures are shown."""
_INVERTED = 0.3
"""Share of pictures that are shown as negatives."""


@dataclass(frozen=True, kw_only=True)
class Scores:
    """On examples that were not learned from.

    Attributes:
        dice: mean of Dice's coefficient of cloth over the pictures.
        poor: share of films whose mean is below 0.9.
        ends: median distance of the hoist's ends [px].
    """

    dice: float
    poor: float
    ends: float


def train(
    examples: Sequence[Example],
    judged: Sequence[Example],
    *,
    epochs: int,
    seed: int,
    advance: Callable[[int, float, Scores], object],
) -> MaskNetwork:
    """Weights after some epochs.

    Args:
        judged: examples of other flags, on which each epoch is scored; nothing is chosen by them.
        advance: called with the epoch, its loss and its scores.
    """
    rng = stream(seed, "masks", "training")
    torch.manual_seed(int(rng.integers(2**31)))
    network = MaskNetwork()
    optimiser = torch.optim.AdamW(network.parameters(), lr=_RATE, weight_decay=1e-4)
    steps = epochs * -(-len(examples) * _PICTURES // _BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, _RATE, total_steps=steps, pct_start=0.1
    )
    for epoch in range(epochs):
        network.train()
        order = np.repeat(rng.permutation(len(examples)), _PICTURES)
        order = order[rng.permutation(len(order))]
        total = 0.0
        for first in range(0, len(order), _BATCH):
            some = [_drawn(examples[k], rng) for k in order[first : first + _BATCH]]
            x, cloth, ends = (torch.cat(parts) for parts in zip(*some, strict=True))
            loss = _loss(network, x, cloth, ends, rng)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            total += loss.item() * len(some)
        advance(epoch, total / len(order), scores(network, judged))
    return network.eval()


def scores(network: MaskNetwork, examples: Sequence[Example]) -> Scores:
    """How well the cloth and the hoist of films are found."""
    network.eval()
    each: list[float] = []
    apart: list[FloatArray] = []
    with torch.inference_mode():
        for one in examples:
            maps = network(
                inputs_of(one.pictures, one.stills).contiguous(memory_format=torch.channels_last)
            ).numpy()
            found, true = maps[:, 0] > 0, one.cloth > 127
            both = (
                2
                * (found & true).sum(axis=(1, 2))
                / np.maximum(found.sum(axis=(1, 2)) + true.sum(axis=(1, 2)), 1)
            )
            each.append(float(both.mean()))
            peaks = maps[:, 1:].mean(axis=0).reshape(2, -1).argmax(axis=1)
            places = np.stack([peaks % maps.shape[-1], peaks // maps.shape[-1]], axis=1) + 0.5
            apart.append(np.hypot(*(places - np.median(one.hoist, axis=0)).T))
    return Scores(
        dice=float(np.mean(each)),
        poor=float(np.mean(np.array(each) < 0.9)),
        ends=float(np.median(np.stack(apart))),
    )


def _drawn(one: Example, rng: np.random.Generator) -> tuple[Tensor, Tensor, Tensor]:
    """Inputs (1, 4, …), cloth (1, 1, …) and ends (1, 2, 2) of a picture of a film."""
    k = int(rng.integers(len(one.pictures)))
    x = inputs_of(one.pictures[k : k + 1], one.stills)
    if rng.random() < _INVERTED:
        x = -x[:, [0, 1, 3, 2]]
    return (
        x,
        torch.from_numpy(one.cloth[k].astype(np.float32) / 255)[None, None],
        torch.from_numpy(one.hoist[k])[None],
    )


def _loss(
    network: MaskNetwork, x: Tensor, cloth: Tensor, ends: Tensor, rng: np.random.Generator
) -> Tensor:
    x, cloth, ends = _moved(x, cloth, ends, rng)
    maps = network(x.contiguous(memory_format=torch.channels_last))
    wrong = functional.binary_cross_entropy_with_logits(maps[:, :1], cloth)
    shown = maps[:, :1].sigmoid()
    both = (2 * (shown * cloth).sum(dim=(1, 2, 3)) + 1) / (
        shown.sum(dim=(1, 2, 3)) + cloth.sum(dim=(1, 2, 3)) + 1
    )
    size = x.shape[-1]
    at = torch.arange(size) + 0.5
    near = -((at - ends[..., :1]) ** 2)[:, :, None, :] - ((at - ends[..., 1:]) ** 2)[:, :, :, None]
    wanted = (near / (2 * _BLUR**2)).flatten(2).softmax(dim=2)
    inside = ((ends > 0) & (ends < size)).all(dim=2)
    ahead = -(wanted * maps[:, 1:].flatten(2).log_softmax(dim=2)).sum(dim=2)
    placed = (ahead * inside).sum() / inside.sum().clamp_min(1)
    return wrong + _DICE * (1 - both.mean()) + _ENDS * placed


def _moved(
    x: Tensor, cloth: Tensor, ends: Tensor, rng: np.random.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """The same pictures, mirrored, turned, resized and shifted, with a little noise."""
    n, size = len(x), x.shape[-1]
    scale = np.exp(rng.uniform(math.log(_SMALLER), math.log(_LARGER), n))
    angle, mirror = rng.uniform(-_TURN, _TURN, n), rng.choice((-1.0, 1.0), n)
    shift = rng.uniform(-_SHIFT, _SHIFT, (n, 2))
    turn = np.stack(
        [np.cos(angle) * mirror, -np.sin(angle), np.sin(angle) * mirror, np.cos(angle)], axis=1
    )
    matrix = (
        turn.reshape(n, 2, 2) * scale[:, None, None]
    )  # places about the middle [px] to new ones
    back = np.linalg.inv(matrix)
    offset = -(back @ shift[:, :, None])[:, :, 0] * 2 / size
    theta = torch.from_numpy(np.concatenate([back, offset[:, :, None]], axis=2).astype(np.float32))
    grid = functional.affine_grid(theta, list(cloth.shape), align_corners=False)
    x = functional.grid_sample(x, grid, mode="bilinear", padding_mode="border", align_corners=False)
    cloth = functional.grid_sample(
        cloth, grid, mode="bilinear", padding_mode="zeros", align_corners=False
    )
    middle = size / 2
    moved = torch.from_numpy(matrix.astype(np.float32)) @ (ends - middle).transpose(1, 2)
    ends = moved.transpose(1, 2) + middle + torch.from_numpy(shift.astype(np.float32))[:, None]
    noise = torch.from_numpy(rng.standard_normal(x[:, :1].shape).astype(np.float32)) * 0.02
    return torch.cat([x[:, :1] + noise, x[:, 1:]], dim=1), cloth, ends
