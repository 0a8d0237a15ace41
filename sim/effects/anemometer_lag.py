"""An anemometer that follows the wind late."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.recursion import decaying_sum
from sim.effects.sensor import AnemometerEffect

_TINY = 1e-12


@dataclass(frozen=True, kw_only=True)
class AnemometerLag(AnemometerEffect):
    """First-order response: τ dm/dt = u − m, τ = ℓ/⟨u⟩ with the mean of the series; it starts in
    balance.

    Solved exactly for a speed that is linear between samples. (With u in place of its mean the
    response would be faster
    in gusts than in lulls: that part is `Overspeeding`.)

    Attributes:
        distance: ℓ, the distance constant: the run of wind in which the reading makes 63 % of a
            step.
    """

    distance: Annotated[
        Value,
        strength(
            unit="m",
            prior=(0.3, 8.0),
            admissible=NOT_NEGATIVE,
            source="cups 1.5–5 m, propellers 1–3 m, heavy instruments to 8 m (ISO 17713-1; WMO-No. "
            "8)",
        ),
    ] = 0.0

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        lag = self.distance / speed.mean(0).abs().clamp(min=_TINY)
        step = torch.diff(time)[:, None]
        slope = torch.diff(speed, dim=0) / step
        memory = torch.exp(-step / lag.clamp(min=_TINY))
        # m₁ = u₁ − τ s + (m₀ − u₀ + τ s) e^(−h/τ)
        # for the difference e = m − u: e₁ = e₀ k − τ s (1 − k).
        behind = decaying_sum(memory, -lag * slope * (1 - memory))
        return speed + torch.cat([torch.zeros_like(speed[:1]), behind])
