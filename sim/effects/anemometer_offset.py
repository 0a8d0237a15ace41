"""An anemometer with a wrong zero."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects.parameter import Value, strength
from sim.effects.sensor import AnemometerEffect


@dataclass(frozen=True, kw_only=True)
class AnemometerOffset(AnemometerEffect):
    """The reading is u + b. It may be negative, as that of a pressure or hot-wire sensor.

    Attributes:
        offset: b.
    """

    offset: Annotated[
        Value,
        strength(
            unit="m/s",
            prior=(-0.5, 0.5),
            source="zero drift of thermal and pressure sensors 0.1–0.5 m/s; calibration intercepts "
            "of cups 0.2",
        ),
    ] = 0.0

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        return speed + self.offset
