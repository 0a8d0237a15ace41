"""An anemometer that reads too much or too little in proportion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects.parameter import Value, strength
from sim.effects.sensor import AnemometerEffect


@dataclass(frozen=True, kw_only=True)
class AnemometerGain(AnemometerEffect):
    """The reading is g u.

    Attributes:
        gain: g.
    """

    gain: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.85, 1.15),
            admissible=(0.0, 10.0),
            source="1–3 % calibrated (IEC 61400-12-1), 5–10 % hand-held and worn bearings; the "
            "site adds as much",
        ),
    ] = 1.0

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        return self.gain * speed
