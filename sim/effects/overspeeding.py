"""A cup anemometer that reads too high in gusty wind, because it speeds up faster than it slows
down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects.parameter import NOT_NEGATIVE, Value, shape, strength
from sim.effects.recursion import decaying_sum
from sim.effects.sensor import AnemometerEffect


@dataclass(frozen=True, kw_only=True)
class Overspeeding(AnemometerEffect):
    """The reading is u (1 + c I²), with I² the variance over the squared mean of the speed about
    that time.

    Mean and variance have exponential weights, exp(−|t − t′|/T). For a rotor that obeys dm/dt = (u
    − m) u/ℓ and is too slow for the gusts, stationarity ⟨u (u − m)⟩ = 0 gives m = ⟨u²⟩/⟨u⟩ = ⟨u⟩ (1
    + I²): c = 1.

    Attributes:
        coefficient: c.
        window: T.
    """

    coefficient: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.1, 1.2),
            admissible=NOT_NEGATIVE,
            source="0 where the rotor follows the gusts, 1 where it does not (Kristensen, J. "
            "Atmos. Oceanic Technol. "
            "15:5, 1998)",
        ),
    ] = 0.0
    window: Annotated[
        Value,
        shape(
            unit="s",
            prior=(10.0, 120.0),
            admissible=(1e-2, 1e5),
            source="times of large eddies; 10-min statistics",
        ),
    ] = 30.0

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        memory = torch.exp(-torch.diff(time)[:, None] / self.window).expand(-1, speed.shape[1])
        weight = self._smooth_values(torch.ones_like(speed), memory)
        mean = self._smooth_values(speed, memory) / weight
        # About the mean of all, so that the difference of squares loses no digits.
        middle = speed.mean(0)
        square = self._smooth_values((speed - middle) ** 2, memory) / weight
        variance = (square - (mean - middle) ** 2).clamp(min=0)
        return speed * (1 + self.coefficient * variance / (mean**2).clamp(min=1e-12))

    @staticmethod
    def _smooth_values(values: Tensor, memory: Tensor) -> Tensor:
        """Sums values (n, batch) with weights that decay on both sides, by `memory` (n − 1, batch)
        a step."""
        none = torch.zeros_like(values[:1])
        before = decaying_sum(torch.cat([none, memory]), values)
        after = decaying_sum(torch.cat([none, memory.flip(0)]), values.flip(0)).flip(0)
        return before + after - values
