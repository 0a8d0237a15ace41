"""The cloth's mask in every picture of a film that was made fit, and where its hoist is.

Both are found by a small network that sees each picture beside what the film shows all the time
(`models.conditioning.mask_network`). It was trained on films of simulated flags, whose silhouettes
are known (`python -m tests.studies masks`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from models.conditioning.mask_network import MaskNetwork, inputs_of, load_shipped_mask
from models.conditioning.stills import SAMPLE, Stills

_CLOTH = 0.45
"""Probability from which on a place is cloth: on films that were not learned from, the masks' area
is then right."""
FEWEST = 10
"""Pictures below which a film shows nothing all the time."""
_LOOKED_AT = 40
"""Pictures at most in which the hoist is sought."""
_TOGETHER = 16
"""Pictures that the network takes at once; bounds the memory."""
_NEAR = 4
"""Reach about its most likely place over which the place of an end is averaged [px]."""
CERTAIN = 0.5
"""Least probability that an end is within `_NEAR` of its most likely place."""
_BESIDE = (0.05, 0.3)
"""Part of the cloth, in lengths of the hoist from it, whose upper edge is extended to the hoist."""
_APART = 0.1
"""Greatest distance of where that edge leads from the network's place, in lengths of the hoist."""
_OFF = 6
"""Distance from the hoist at which cloth is beside it [px]: nearer, the pole hides it."""
_LEAST = 0.1
"""Least area of the cloth over the square of its hoist."""
_MOVES = 5.0
"""Gray levels over which the twentieth part of the cloth that changes most changes at least."""
UPRIGHT = math.atan(0.35)
"""Greatest lean of an upright hoist [rad]."""

Masks = BoolArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Hoist:
    """The edge that cloth is attached to, as the network places it in pictures of one film.

    Attributes:
        stills: what the pictures show all the time.
        logits: (n, 3, rows, columns) of cloth, of the hoist's upper end and of its lower end.
        ends: (2, 2) upper and lower end: column and row in the halved picture, the first pixel's
            middle at 0.5 [px].
        certainty: probability that an end is within `_NEAR` of where it is placed; of the less
            certain one.
    """

    stills: Stills
    logits: Tensor
    ends: FloatArray
    certainty: float

    @property
    def lean(self) -> float:
        """The angle between the hoist, from its upper to its lower end, and the downright [rad], 0
        to π."""
        across, down = self.ends[1] - self.ends[0]
        return float(np.arctan2(abs(across), down))

    @property
    def length(self) -> float:
        """The distance of its ends down the picture [px]."""
        return float(self.ends[1, 1] - self.ends[0, 1])

    @cached_property
    def cloth(self) -> Masks:
        """(n, rows, columns) where cloth is."""
        return (self.logits[:, 0].sigmoid() > _CLOTH).numpy()

    @property
    def side(self) -> float:
        """1 where the cloth is to the right of it, −1 where it is to the left."""
        return _side(self.cloth.mean(axis=0), self.ends)

    @property
    def held(self) -> float:
        """The share of it, over the pictures, that has cloth beside it; 0 where it is less than a
        pixel long."""
        (x, y), (across, down) = self.ends[0], self.ends[1] - self.ends[0]
        rows = np.arange(math.ceil(y), math.floor(y + down))
        if not len(rows):
            return 0.0
        columns = np.floor(x + (rows + 0.5 - y) * across / down + self.side * _OFF).astype(int)
        inside = (
            (rows >= 0)
            & (rows < self.cloth.shape[1])
            & (columns >= 0)
            & (columns < self.cloth.shape[2])
        )
        return float(self.cloth[:, rows[inside], columns[inside]].mean(axis=0).sum() / len(rows))


def hoist_of(pictures: UInt8Array) -> Hoist | None:
    """Places the hoist in pictures (n, size / 2, size / 2) as `Conditioning.show` gives them,
    `halved`, spread over the film; None where they are fewer than ten."""
    if len(pictures) < FEWEST:
        return None
    small = pictures[:: -(-len(pictures) // SAMPLE)]
    stills = Stills.of(small)
    logits = torch.cat(
        list(_maps(load_shipped_mask(), small[:: -(-len(small) // _LOOKED_AT)], stills))
    )
    ends, certainties = zip(
        *(_end(of_end) for of_end in logits[:, 1:].mean(dim=0).double()), strict=True
    )
    return Hoist(stills=stills, logits=logits, ends=np.stack(ends), certainty=min(certainties))


@dataclass(frozen=True, kw_only=True, eq=False)
class Outliner:
    """Finds the cloth in pictures of one film, or of a part of it in one light.

    Attributes:
        stills: what is shown all the time.
        hoist: (2, 2) upper and lower end of the hoist: column and row in the halved picture, the
            first pixel's middle at 0.5 [px].
        side: 1 where the cloth is to the right of its hoist, −1 where it is to the left.
        network: that finds it.
    """

    stills: Stills
    hoist: FloatArray
    side: float
    network: MaskNetwork

    @classmethod
    def of(cls, pictures: UInt8Array) -> Outliner | None:
        """Finds the hoist in pictures (n, size / 2, size / 2) as `Conditioning.show` gives them,
        `halved`, spread over the film. Returns None where they are fewer than ten or show no
        upright hoist with cloth beside it.
        """
        hoist = hoist_of(pictures)
        if hoist is None or hoist.certainty < CERTAIN or hoist.lean > UPRIGHT:
            return None
        stills, places = hoist.stills, hoist.ends
        cloth = np.stack([_largest_filled(mask) for mask in hoist.cloth])
        if cloth.sum(axis=(1, 2)).mean() < _LEAST * (places[1, 1] - places[0, 1]) ** 2:
            return None
        usual = cloth.mean(axis=0)
        if (
            np.quantile(stills.greatest[usual > 0].astype(int) - stills.least[usual > 0], 0.95)
            < _MOVES
        ):
            return None
        side = _side(usual, places)
        return cls(
            stills=stills,
            hoist=_lower_hoist_end(usual > 0.5, places, side),
            side=side,
            network=load_shipped_mask(),
        )

    def masks(self, pictures: UInt8Array) -> tuple[Masks, FloatArray]:
        """Segments the cloth in pictures (n, size / 2, size / 2), `halved`, that follow one another
        in the film: the largest part that is cloth, on its side of the hoist's line, with its holes
        filled. Also returns Dice's coefficient (n,) with the truth, as the network expects it.

        A picture's probabilities count a half and its neighbours' a quarter each, so that an
        outline does not tremble from picture to picture.
        """
        probability = np.concatenate(
            [maps[:, 0].sigmoid().numpy() for maps in _maps(self.network, pictures, self.stills)]
        )
        ends = np.concatenate([probability[:1], probability, probability[-1:]])
        probability = (ends[:-2] + 2 * ends[1:-1] + ends[2:]) / 4
        probability *= _side_of_hoist(self.hoist, self.side, self.stills.usual.shape)
        cloth = np.stack([_largest_filled(picture > _CLOTH) for picture in probability])
        intersection = 2 * (probability * cloth).sum(axis=(1, 2))
        return cloth, (
            intersection / np.maximum(probability.sum(axis=(1, 2)) + cloth.sum(axis=(1, 2)), 1.0)
        ).astype(np.float64)


def _maps(network: MaskNetwork, small: UInt8Array, stills: Stills) -> Iterator[Tensor]:
    """Yields (n, 3, rows, columns) logits, a few pictures at a time."""
    for k in range(0, len(small), _TOGETHER):
        inputs = inputs_of(small[k : k + _TOGETHER], stills).contiguous(
            memory_format=torch.channels_last
        )
        with torch.inference_mode():
            maps = network(inputs)
        yield maps


def _end(logits: Tensor) -> tuple[FloatArray, float]:
    """Locates an end of the hoist: (2,) column and row, and the probability that it is near
    there."""
    shares = logits.flatten().softmax(dim=0).reshape(logits.shape).numpy()
    row, column = np.unravel_index(int(shares.argmax()), shares.shape)
    rows, columns = (
        np.arange(max(0, at - _NEAR), min(length, at + _NEAR + 1))
        for at, length in zip((int(row), int(column)), shares.shape, strict=True)
    )
    neighbourhood = shares[np.ix_(rows, columns)]
    total = float(neighbourhood.sum())
    place = (
        np.array([neighbourhood.sum(axis=0) @ columns, neighbourhood.sum(axis=1) @ rows]) / total
        + 0.5
    )
    return place, total


def _side(usual: FloatArray, ends: FloatArray) -> float:
    """Returns 1 where cloth (rows, columns), a share of the time, is to the right of a hoist, −1
    where to the left."""
    return (
        1.0
        if usual.sum(axis=0) @ (np.arange(usual.shape[1]) + 0.5 - ends[:, 0].mean()) >= 0
        else -1.0
    )


def _lower_hoist_end(usual: Masks, places: FloatArray, side: float) -> FloatArray:
    """Moves the hoist's upper end (2, 2) to where the cloth's upper edge beside it meets the
    hoist's line: a pole's top is not the cloth's corner. The network's point is unchanged where the
    cloth does not show the edge, or shows one that does not lead there.

    Args:
        usual: (rows, columns) where cloth is most of the time.
        places: (2, 2) of the ends, as the network finds them.
        side: at which the cloth is.
    """
    length = float(places[1, 1] - places[0, 1])
    columns = np.unique(
        np.floor(places[:, 0].mean() + side * np.linspace(*_BESIDE, 16) * length).astype(int)
    )
    columns = columns[(columns >= 0) & (columns < usual.shape[1])]
    strip = usual[:, columns]
    if len(columns) < 3 or not strip.any(axis=0).all():
        return places
    row = float(np.polyval(np.polyfit(columns + 0.5, strip.argmax(axis=0), 1), places[0, 0]))
    if abs(row - places[0, 1]) > _APART * length:
        return places
    return np.stack([np.array([places[0, 0], row]), places[1]])


def _side_of_hoist(hoist: FloatArray, side: float, shape: tuple[int, ...]) -> Masks:
    """Masks the cloth's side of the line through the hoist: a pole before the cloth is not
    cloth."""
    (x, y), (across, down) = hoist[0], hoist[1] - hoist[0]
    rows, columns = np.indices(shape) + 0.5
    return side * (columns - x - (rows - y) * across / down) > 0


def _largest_filled(cloth: Masks) -> Masks:
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(cloth.astype(np.uint8))
    if count < 2:
        return np.zeros(cloth.shape, bool)
    largest = (labels == 1 + int(statistics[1:, cv2.CC_STAT_AREA].argmax())).astype(np.uint8)
    contours, _ = cv2.findContours(largest, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(largest, contours, -1, 1, thickness=cv2.FILLED)
    return largest > 0
