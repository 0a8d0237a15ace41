"""The network that finds the cloth in a picture of a film: a small U-Net.

Ronneberger, Fischer and Brox, U-Net, MICCAI 2015, with fewer channels, batch normalisation, its
first layer on pixels of 2×2 and its last one on the picture itself. It sees a picture beside what
the film shows all the time (`models.conditioning.stills`), so that it need not know what cloth
looks like: cloth is what changes, and what is joined to that and to the hoist where nothing
changes.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from flagdata.core.arrays import BoolArray
from flagdata.errors import CorruptError
from models.conditioning.stills import Stills
from models.trained.model_folder import WEIGHTS, check_model, read_card, read_tensors

FOLDER = Path(__file__).parent / "cloth_mask"
"""The network that comes with the package: card, weights and checksums."""
_AGAIN = "install flagdata again"

CHANNELS = 4
"""The picture; the usual, the least and the greatest value of each place."""
OUTPUTS = 3
"""Logits of cloth, of the hoist's upper end and of its lower end."""
_WIDTHS = (16, 24, 40, 64)
_MULTIPLE = 2 ** len(_WIDTHS)
_BLACK = 16
"""Gray level up to which a place is black, in full-range and in video levels."""
_SCALE = 8.0
"""Gray levels that are added to the deviation of the still picture, so that noise in a plain one
stays small."""


class MaskNetwork(nn.Module):
    """(n, 4, rows, columns) → (n, 3, rows, columns): see `CHANNELS` and `OUTPUTS`."""

    def __init__(self) -> None:
        super().__init__()
        widths, inputs = _WIDTHS, 4 * CHANNELS
        self.down = nn.ModuleList(
            _twice(a, b) for a, b in zip((inputs, *widths[:-1]), widths, strict=True)
        )
        self.up = nn.ModuleList(
            _twice(below + width, width)
            for below, width in zip(widths[:0:-1], widths[-2::-1], strict=True)
        )
        self.fine = nn.Sequential(
            nn.Conv2d(widths[0] // 4 + CHANNELS, 8, 3, padding=1),
            nn.ReLU(inplace=True),
            nn.Conv2d(8, OUTPUTS, 1),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Computes logits. The picture is continued at its edges to a multiple of 16 pixels."""
        rows, columns = x.shape[-2:]
        padded = functional.pad(
            x, (0, -columns % _MULTIPLE, 0, -rows % _MULTIPLE), mode="replicate"
        )
        levels: list[Tensor] = []
        y = functional.pixel_unshuffle(padded, 2)
        for block in self.down:
            y = block(functional.max_pool2d(y, 2) if levels else y)
            levels.append(y)
        for block, skip in zip(self.up, levels[-2::-1], strict=True):
            y = block(
                torch.cat(
                    [functional.interpolate(y, scale_factor=2.0, mode="nearest"), skip], dim=1
                )
            )
        y = torch.cat([functional.pixel_shuffle(y, 2), padded], dim=1)
        return self.fine(y)[..., :rows, :columns]


def _twice(inputs: int, width: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for before in (inputs, width):
        layers += [
            nn.Conv2d(before, width, 3, padding=1, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
        ]
    return nn.Sequential(*layers)


def inputs_of(pictures: NDArray[np.generic], stills: Stills) -> Tensor:
    """Stacks the network's inputs (n, 4, rows, columns) for pictures (n, rows, columns) of one
    film: its gray levels less the mean of the usual picture, over its deviation. Black bars at the
    edges, as an ingested film may have them, do not count and are 0."""
    lit = _lit(stills)
    usual = stills.usual[lit]
    middle, spread = float(usual.mean()), float(usual.std()) + _SCALE
    same = (
        np.stack([stills.usual, stills.least, stills.greatest])
        .astype(np.float32)[None]
        .repeat(len(pictures), axis=0)
    )
    channels = np.concatenate([np.asarray(pictures, np.float32)[:, None], same], axis=1)
    return torch.from_numpy((channels - middle) / spread * lit)


def _lit(stills: Stills) -> BoolArray:
    """Masks (rows, columns) that are black all the time; keeps everything where all of it is."""
    brightest = stills.greatest
    lit = np.logical_and.outer(brightest.max(axis=1) > _BLACK, brightest.max(axis=0) > _BLACK)
    return lit if lit.any() else ~lit


@cache
def load_shipped_mask() -> MaskNetwork:
    """Loads the mask network that comes with the package.

    Raises:
        CorruptError: its files are not as they were written, or do not fit this code.
    """
    check_model(FOLDER)
    read_card(FOLDER)
    network = MaskNetwork()
    try:
        network.load_state_dict(
            {name: tensor.float() for name, tensor in read_tensors(FOLDER / WEIGHTS).items()}
        )
    except RuntimeError as error:
        raise CorruptError(
            f"the weights do not fit this code: {error}", where=str(FOLDER), fix=_AGAIN
        ) from error
    return network.eval()
