"""The Spectral Decomposition Network: what moves where and how fast, to an embedding of 512
numbers.

Runia et al., Cloth in the Wind, CVPR 2020, section 5: spectral power and frequency maps, three
standard ResNet blocks and a linear layer; one frequency peak, 512 numbers, 2.6 M parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import Tensor, nn

from flagdata.errors import InputError
from models.networks.blocks import BasicBlock, initialise


class SpectralNetwork(nn.Module):
    """Spectral maps (batch, channels, height, width) → embedding (batch, dimension).

    With the default widths it has 2,626,384 parameters: the paper states 2.6 M and neither the
    blocks' widths, nor their strides, nor what comes between the last block and the linear layer.
    Here each block halves the map, and the average over a grid of 3×3 fields goes to the linear
    layer, so that where in the image the motion is stays known, and maps of 112×112 and 56×56 serve
    alike.

    Scaling. A power is the square of an amplitude and its density over the pixels has a heavy tail:
    an edge that sweeps past a pixel leaves 10³ to 10⁴ times the power of camera noise, and batch
    normalisation of such maps would be that of a few pixels. So powers enter as log(1 + P/floor):
    logarithmic where something moves, and linear, thus small, below the floor, where a bare
    logarithm would spread out noise. Frequencies enter over the Nyquist frequency, from 0 to 1.
    Both are fixed, not learned, so that one clip alone is treated as in a batch.

    Args:
        channels: of the maps, 2kC: powers first, then as many frequencies [Hz]
            (`models.maps.spectral_layer`).
        widths: channels of the three blocks.
        grid: fields along each side over which the last map is averaged.
        dimension: of the embedding.
        floor: power below which the scale is linear, in squares of the standardised gray level's
            gradient [1/px²].
        nyquist: half of the frame rate [Hz].

    Raises:
        InputError: channels that are not pairs, not three widths, or a number that is not positive.
    """

    takes: ClassVar[str] = "spectral-maps"
    recurrent: ClassVar[bool] = False

    def __init__(
        self,
        *,
        channels: int = 4,
        widths: Sequence[int] = (64, 128, 280),
        grid: int = 3,
        dimension: int = 512,
        floor: float = 1e-3,
        nyquist: float = 12.5,
    ) -> None:
        super().__init__()
        if channels < 2 or channels % 2:
            raise InputError(
                f"{channels} channels are not powers and as many frequencies",
                fix="give an even number",
            )
        if len(widths) != 3:
            raise InputError(
                f"{len(widths)} widths do not fit three blocks",
                fix="give three, such as [64, 128, 280]",
            )
        if min(*widths, grid, dimension, floor, nyquist) <= 0:
            raise InputError(
                f"the widths are {tuple(widths)}, grid {grid}, dimension {dimension}, floor "
                f"{floor}, nyquist {nyquist}",
                fix="give positive numbers",
            )
        self.channels = channels
        self.dimension = dimension
        self.floor = floor
        self.nyquist = nyquist
        inputs = (channels, *widths[:2])
        self.blocks = nn.Sequential(
            *(BasicBlock(inputs=i, width=w, stride=2) for i, w in zip(inputs, widths, strict=True))
        )
        self.pool = nn.AdaptiveAvgPool2d(grid)
        self.linear = nn.Linear(widths[2] * grid**2, dimension)
        initialise(self)

    def scaled(self, maps: Tensor) -> Tensor:
        """Returns the maps as the first block sees them: log(1 + P/floor) and f/f_Nyquist, of the
        same shape."""
        power, frequency = maps.chunk(2, dim=1)
        return torch.cat([(power / self.floor).log1p(), frequency / self.nyquist], dim=1)

    def forward(self, x: Tensor) -> Tensor:
        """Embeds spectral maps: (batch, dimension).

        Raises:
            InputError: maps of another number of channels or dimensions.
        """
        if x.ndim != 4 or x.shape[1] != self.channels:
            raise InputError(
                f"the maps have the shape {tuple(x.shape)}",
                fix=f"give (batch, {self.channels}, height, width) to this network",
            )
        return self.linear(self.pool(self.blocks(self.scaled(x))).flatten(1))
