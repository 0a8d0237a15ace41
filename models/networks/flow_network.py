"""Our own network: maps of optical flow to a summary of 32 numbers that a distribution over the
parameters rests on.

It sees how fast, in which rhythm and which way the picture moves at each place, on two scales or
three, and what the clip looks like at rest (`models.maps.flow`).
"""

from __future__ import annotations

from typing import ClassVar

from models.maps.flow import CHANNELS, CHANNELS_OF_THREE
from models.networks.maps_network import MapsNetwork


class FlowNetwork(MapsNetwork):
    """Maps (batch, 59, H, W) to a summary (batch, dimension), see `MapsNetwork`."""

    takes: ClassVar[str] = "flow-maps"
    known: ClassVar[tuple[str, ...]] = CHANNELS
    reduces: ClassVar[tuple[int, ...]] = (1, 2, 2)


class ThreeScaleFlowNetwork(FlowNetwork):
    """Maps (batch, 87, H, W) to a summary (batch, dimension), see `MapsNetwork`."""

    takes: ClassVar[str] = "flow-maps-3"
    known: ClassVar[tuple[str, ...]] = CHANNELS_OF_THREE
