"""Something small and heavy on the cloth: a button, a clip, a badge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import torch

from sim.cloth import Cloth
from sim.effects import NOT_NEGATIVE, ClothEffect, Value, strength
from tests.studies.challenge.outside import places

PLACE = (0.72, 0.3)
"""Place of the button: from the hoist as a share of the width, from below as a share of the
height."""


@dataclass(frozen=True, kw_only=True)
class Button(ClothEffect):
    """A mass m at one point.

    Attributes:
        mass: m.
    """

    mass: Annotated[
        Value,
        strength(
            unit="kg",
            prior=(0.0, 0.08),
            admissible=NOT_NEGATIVE,
            source="buttons of 1–10 g, carabiners and clips of 20–80 g",
        ),
    ] = 0.0

    def cloth(self, cloth: Cloth) -> Cloth:
        share = places.shares(cloth.mesh, places.inside(cloth.mesh, *PLACE)[None])[0]
        return replace(
            cloth,
            mass=cloth.mass
            + torch.as_tensor(share, dtype=cloth.dtype, device=cloth.device)[:, None] * self.mass,
        )
