"""Wave maps to a summary of 32 numbers that a distribution over the parameters rests on.

Beside the paper's strongest power and frequency the network sees a second peak, the power by band,
the spectrum's centre and width, the wave number at the strongest frequency with its coherence, and
what the clip looks like at rest (`models.maps.frontend`). At a quarter of the clip's size a forward
and backward pass takes a sixth of the SDN's time.
"""

from __future__ import annotations

from typing import ClassVar

from models.maps.frontend import WAVE_CHANNELS
from models.networks.maps_network import MapsNetwork


class WaveNetwork(MapsNetwork):
    """Maps (batch, 35, H, W) to a summary (batch, dimension), see `MapsNetwork`."""

    takes: ClassVar[str] = "wave-maps"
    known: ClassVar[tuple[str, ...]] = WAVE_CHANNELS
    reduces: ClassVar[tuple[int, ...]] = (2, 2, 2)
