"""Drops that hit the cloth and give up their momentum: a cloudburst, a sprinkler, spray from
breaking waves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.cloth.air import face_wind
from sim.effects import NOT_NEGATIVE, ForceEffect, Value, shape, strength


@dataclass(frozen=True, kw_only=True)
class Spray(ForceEffect):
    """Drops fly with the wind and fall at V through it. On a face of rest area a with unit normal n
    that they meet at
    a relative velocity c: f = L a |c·n| c. They run off, and weigh nothing.

    Attributes:
        content: L, mass of water in the air.
        fall: V.
    """

    content: Annotated[
        Value,
        strength(
            unit="kg/m³",
            prior=(0.0, 0.05),
            admissible=NOT_NEGATIVE,
            source="rain of 25–300 mm/h over its fall speed: 0.001–0.012; jets of sprinklers and "
            "hoses ten times that",
        ),
    ] = 0.0
    fall: Annotated[
        Value,
        shape(
            unit="m/s",
            prior=(4.0, 9.0),
            admissible=NOT_NEGATIVE,
            source="drops of 1–5 mm: 4–9 m/s (Gunn and Kinzer, J. Meteorology 6:243, 1949)",
        ),
    ] = 7.0

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        seen = face_wind(cloth, position, velocity, wind)
        down = torch.zeros_like(seen.relative).index_fill(
            1, torch.tensor(2, device=position.device), -1.0
        )
        meeting = seen.relative + self.fall * down
        caught = self.content * (meeting * seen.normal).sum(1, keepdim=True).abs()
        return cloth.shared_out((cloth.areas / 3)[:, None, None] * caught * meeting)
