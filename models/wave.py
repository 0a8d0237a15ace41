"""Our own network: wave maps, a small ResNet, a summary of 32 numbers that a distribution over the parameters rests on.

Beside the paper's strongest power and frequency it sees a second peak, the power by band, the spectrum's centre and
width, the wave number at the strongest frequency with its coherence, and what the clip looks like at rest
(`models.frontend`). At a quarter of the clip's size a forward and backward pass takes a sixth of the SDN's time.
"""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from flagdata.errors import InputError
from models.blocks import BasicBlock, initialise
from models.frontend import WAVE_CHANNELS


class WaveNetwork(nn.Module):
    """Maps (batch, 35, H, W) to a summary (batch, dimension).

    The maps are standardised by batch statistics, pass three residual blocks of stride 2, and are pooled by their mean
    and their maximum over the picture, which tell how much there is and how strong it is at its strongest.

    Args:
        dimension: of the summary.
        widths: channels of the three blocks.
        channels: names of the wave maps that are used, to measure what each adds; all by default.
    """

    takes: ClassVar[str] = "wave-maps"
    recurrent: ClassVar[bool] = False

    def __init__(
        self,
        *,
        dimension: int = 32,
        widths: tuple[int, int, int] = (48, 96, 160),
        channels: tuple[str, ...] = WAVE_CHANNELS,
    ) -> None:
        super().__init__()
        unknown = set(channels) - set(WAVE_CHANNELS)
        if unknown or not channels:
            raise InputError(f"wave maps {sorted(unknown)} are not known", fix="name some of WAVE_CHANNELS")
        self.dimension = dimension
        self.channels = len(WAVE_CHANNELS)
        self._chosen = [WAVE_CHANNELS.index(name) for name in channels]
        self.standardise = nn.BatchNorm2d(len(channels), affine=False)
        ins = (len(channels), *widths[:-1])
        self.blocks = nn.Sequential(
            *(BasicBlock(inputs=inputs, width=width, stride=2) for inputs, width in zip(ins, widths, strict=True))
        )
        initialise(self.blocks)
        self.summary = nn.Sequential(nn.Linear(2 * widths[-1], 128), nn.ReLU(), nn.Linear(128, dimension))

    def forward(self, maps: Tensor) -> Tensor:
        seen = maps if len(self._chosen) == maps.shape[1] else maps[:, self._chosen]
        features = self.blocks(self.standardise(seen))
        return self.summary(torch.cat([features.mean(dim=(2, 3)), features.amax(dim=(2, 3))], dim=1))
