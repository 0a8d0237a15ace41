"""An anemometer higher or lower than the flag."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects.parameter import Value, shape, strength
from sim.effects.sensor import AnemometerEffect


@dataclass(frozen=True, kw_only=True)
class SensorHeight(AnemometerEffect):
    """The reading is u r^α, of a wind u at the flag that grows with height as a power. It looks
    like a gain.

    Attributes:
        ratio: r, height of the sensor over height of the flag's middle.
        exponent: α of the power law.
    """

    ratio: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.3, 1.5),
            admissible=(1e-3, 1e3),
            source="hand-held or tripod sensors at 1.5–3 m beside flags at 2–10 m; weather masts "
            "at 10 m",
        ),
    ] = 1.0
    exponent: Annotated[
        Value,
        shape(
            unit="1",
            prior=(0.05, 0.4),
            admissible=(-math.inf, math.inf),
            source="0.1 over water, 0.14 open land, 0.2 by IEC 61400-1, 0.3–0.4 in towns",
        ),
    ] = 0.14

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        return speed * self.ratio**self.exponent
