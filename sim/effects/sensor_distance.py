"""An anemometer upstream or downstream of the flag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects.parameter import Value, strength
from sim.effects.sensor import AnemometerEffect


@dataclass(frozen=True, kw_only=True)
class SensorDistance(AnemometerEffect):
    """Gusts are carried past unchanged (Taylor 1938): the reading at t is u(t − d/⟨u⟩), linear
    between samples.

    Beyond the ends of the series its first or last speed holds. That gusts change on the way is not
    in it. In one wind it looks like a clock's offset; in several the delay falls as 1/⟨u⟩.

    Attributes:
        distance: d, positive where the sensor is downstream of the flag.
    """

    distance: Annotated[
        Value,
        strength(
            unit="m",
            prior=(-20.0, 20.0),
            source="sensors on the same pole to those at the edge of a field",
        ),
    ] = 0.0

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        delay = self.distance / speed.mean(0).abs().clamp(min=1e-12)
        delayed = (time[:, None] - delay).clamp(time[0], time[-1])
        after = torch.searchsorted(time, delayed.detach().contiguous(), right=True).clamp(
            1, len(time) - 1
        )
        share = (delayed - time[after - 1]) / (time[after] - time[after - 1])
        return torch.lerp(speed.gather(0, after - 1), speed.gather(0, after), share)
