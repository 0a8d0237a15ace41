"""A wind that turns with height, as in the lee of a corner or where two streams slide over each
other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import FlowEffect, Value, horizontal, left_of, strength


@dataclass(frozen=True, kw_only=True)
class Veer(FlowEffect):
    """The wind is turned about the vertical by γ z, z the height above the middle of the
    attachments.

    Attributes:
        rate: γ, counter-clockwise seen from above where it is higher.
    """

    rate: Annotated[
        Value,
        strength(
            unit="rad/m",
            prior=(-1.0, 1.0),
            admissible=(-10.0, 10.0),
            source="Ekman layers and sea breezes turn by up to 0.02 rad/m (Stull, An Introduction "
            "to Boundary Layer "
            "Meteorology, 1988); a shear layer of 1–2 m behind a building's corner by up to a "
            "right angle",
        ),
    ] = 0.0

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        angle = self.rate * offset[:, 2:]
        return (
            wind
            + (torch.cos(angle) - 1) * horizontal(wind, axis=-2)
            + torch.sin(angle) * left_of(wind, axis=-2)
        )
