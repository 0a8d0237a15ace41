"""A small residual network on maps: what `models.networks.wave` and `models.networks.flow_network`
have in common."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from flagdata.errors import InputError
from models.networks.blocks import BasicBlock, initialise


class MapsNetwork(nn.Module):
    """Maps (batch, channel, h, w) to a summary (batch, dimension).

    The maps are standardised by batch statistics, pass residual blocks, and are pooled by their
    mean and their maximum
    over the picture: how much there is, and how strong it is at its strongest.

    Attributes:
        known: names of the maps that come in.
        reduces: by which each block makes height and width smaller, where `strides` are not given.

    Args:
        dimension: of the summary.
        widths: channels of the blocks.
        strides: by which each block makes height and width smaller.
        channels: names of the maps that are used, to measure what each adds; all by default.

    Raises:
        InputError: no map, or one that is not known; as many strides as there are widths are
            needed.
    """

    recurrent: ClassVar[bool] = False
    known: ClassVar[tuple[str, ...]]
    reduces: ClassVar[tuple[int, ...]]

    def __init__(
        self,
        *,
        dimension: int = 32,
        widths: tuple[int, ...] = (48, 96, 160),
        strides: tuple[int, ...] | None = None,
        channels: tuple[str, ...] | None = None,
    ) -> None:
        super().__init__()
        names, chosen = self.known, self.known if channels is None else channels
        strides = self.reduces if strides is None else strides
        unknown = set(chosen) - set(names)
        if unknown or not chosen:
            raise InputError(
                f"maps {sorted(unknown)} are not known", fix=f"name some of {', '.join(names)}"
            )
        if len(widths) != len(strides) or not widths:
            raise InputError(
                f"there are {len(widths)} widths and {len(strides)} strides",
                fix="give one of each for every block",
            )
        self.dimension = dimension
        self.channels = len(names)
        self._chosen = [names.index(name) for name in chosen]
        self.standardise = nn.BatchNorm2d(len(chosen), affine=False)
        ins = (len(chosen), *widths[:-1])
        self.blocks = nn.Sequential(
            *(
                BasicBlock(inputs=inputs, width=width, stride=stride)
                for inputs, width, stride in zip(ins, widths, strides, strict=True)
            )
        )
        initialise(self.blocks)
        self.summary = nn.Sequential(
            nn.Linear(2 * widths[-1], 128), nn.ReLU(), nn.Linear(128, dimension)
        )

    def forward(self, maps: Tensor) -> Tensor:
        """Computes the summary (batch, dimension)."""
        used = maps if len(self._chosen) == maps.shape[1] else maps[:, self._chosen]
        features = self.blocks(self.standardise(used))
        return self.summary(
            torch.cat([features.mean(dim=(2, 3)), features.amax(dim=(2, 3))], dim=1)
        )
