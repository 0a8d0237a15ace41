"""Wave maps to a summary of 32 numbers that a distribution over the parameters rests on.

Beside the paper's strongest power and frequency the network sees a second peak, the power by band, the spectrum's
centre and width, the wave number at the strongest frequency with its coherence, and what the clip looks like at rest
(`models.frontend`). At a quarter of the clip's size a forward and backward pass takes a sixth of the SDN's time.
"""

from __future__ import annotations

from typing import ClassVar

from models.frontend import WAVE_CHANNELS
from models.maps_network import MapsNetwork


class WaveNetwork(MapsNetwork):
    """Maps (batch, 35, H, W) to a summary (batch, dimension), see `MapsNetwork`.

    Args:
        dimension: of the summary.
        widths: channels of the three blocks, each of which halves height and width.
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
        super().__init__(known=WAVE_CHANNELS, chosen=channels, dimension=dimension, widths=widths, strides=(2, 2, 2))
