"""An anemometer that does not start in a light wind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.sensor import AnemometerEffect


@dataclass(frozen=True, kw_only=True)
class AnemometerDeadZone(AnemometerEffect):
    """The reading is 0 below a threshold in size and u from it on: a jump, so that the threshold
    has no gradient.

    Attributes:
        threshold: the starting speed.
    """

    threshold: Annotated[
        Value,
        strength(
            unit="m/s",
            prior=(0.1, 1.5),
            admissible=NOT_NEGATIVE,
            source="starting thresholds of cups and vanes 0.2–1 m/s (WMO-No. 8, part I, ch. 5), "
            "worn bearings more",
        ),
    ] = 0.0

    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        return torch.where(speed.abs() < self.threshold, 0.0, speed)
