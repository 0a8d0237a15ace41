"""A wall upwind that ends below the top of the flag and shelters what is lower."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects import FlowEffect, Value, shape, strength

CREST = -0.1
"""Height of the wall above the middle of the attachments [m]."""


@dataclass(frozen=True, kw_only=True)
class ShelteringWall(FlowEffect):
    """The wind is multiplied by 1 − q/(1 + e^((z + 0.1 m)/s)), z the height above the middle of the
    attachments.

    Attributes:
        share: q, of the wind that is lost far below the crest.
        thickness: s of the shear layer that leaves the crest.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 0.9),
            admissible=(0.0, 1.0),
            source="mean speeds a few heights behind fences and walls: 0.3–0.7 of the open wind "
            "less for porous ones, "
            "all of it for solid ones (Plate, Agricultural Meteorology 8:203, 1971)",
        ),
    ] = 0.0
    thickness: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.05, 0.3),
            admissible=(1e-3, 10.0),
            source="mixing layers grow by about 0.1–0.2 of the distance: a wall 0.5–3 m upwind",
        ),
    ] = 0.12

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        below = torch.sigmoid((CREST - offset[:, 2:]) / self.thickness)
        return wind * (1.0 - self.share * below)
