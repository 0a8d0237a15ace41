"""A clock that runs fast or slow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects.parameter import Value, strength
from sim.effects.sensor import ClockEffect


@dataclass(frozen=True, kw_only=True)
class ClockDrift(ClockEffect):
    """The clock reads t + r (t − t₀), t₀ the first instant.

    Attributes:
        rate: r; a fast clock has r > 0.
    """

    rate: Annotated[
        Value,
        strength(
            unit="s/s",
            prior=(-1e-4, 1e-4),
            admissible=(-0.1, 0.1),
            source="quartz: 20 ppm at room temperature, 100 ppm in sun and frost (data sheets of "
            "32 kHz crystals)",
        ),
    ] = 0.0

    def stamps(self, time: Tensor) -> Tensor:
        return time + self.rate * (time - time[:1])
