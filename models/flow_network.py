"""Our own network: maps of optical flow to a summary of 32 numbers that a distribution over the parameters rests on.

It sees how fast, in which rhythm and which way the picture moves at each place, on two scales, and what the clip looks
like at rest (`models.flow`).
"""

from __future__ import annotations

from typing import ClassVar

from models.flow import CHANNELS
from models.maps_network import MapsNetwork


class FlowNetwork(MapsNetwork):
    """Maps (batch, 59, H, W) to a summary (batch, dimension), see `MapsNetwork`.

    Args:
        dimension: of the summary.
        widths: channels of the blocks.
        strides: by which each block makes height and width smaller.
        channels: names of the flow maps that are used, to measure what each adds; all by default.
    """

    takes: ClassVar[str] = "flow-maps"
    recurrent: ClassVar[bool] = False

    def __init__(
        self,
        *,
        dimension: int = 32,
        widths: tuple[int, ...] = (48, 96, 160),
        strides: tuple[int, ...] = (1, 2, 2),
        channels: tuple[str, ...] = CHANNELS,
    ) -> None:
        super().__init__(known=CHANNELS, chosen=channels, dimension=dimension, widths=widths, strides=strides)
