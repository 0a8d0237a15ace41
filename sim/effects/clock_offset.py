"""A clock that is set wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects.parameter import Value, strength
from sim.effects.sensor import ClockEffect


@dataclass(frozen=True, kw_only=True)
class ClockOffset(ClockEffect):
    """The clock reads t + b; what aligns it with the true one is −b.

    Attributes:
        offset: b.
    """

    offset: Annotated[
        Value,
        strength(
            unit="s",
            prior=(-5.0, 5.0),
            source="clocks set by hand: seconds to minutes; by network: 1–100 ms",
        ),
    ] = 0.0

    def stamps(self, time: Tensor) -> Tensor:
        return time + self.offset
