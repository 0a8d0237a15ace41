"""A heavy seam across the cloth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import torch

from sim.cloth import Cloth
from sim.effects import NOT_NEGATIVE, ClothEffect, Value, strength
from tests.studies.challenge.outside import places

PLACE = 0.6
"""Place of the seam from the hoist, as a share of the width."""
_PIECES = 200


@dataclass(frozen=True, kw_only=True)
class Seam(ClothEffect):
    """A line of mass λ per length along v at 0.6 of the width: a tape between two panels.

    Attributes:
        line_density: λ.
    """

    line_density: Annotated[
        Value,
        strength(
            unit="kg/m",
            prior=(0.0, 0.1),
            admissible=NOT_NEGATIVE,
            source="four layers over 20 mm of cloth of 0.3 kg/m² with thread and webbing: 0.02–0.1 "
            "kg/m",
        ),
    ] = 0.0

    def cloth(self, cloth: Cloth) -> Cloth:
        low, high = (places.inside(cloth.mesh, PLACE, end) for end in (0.0, 1.0))
        middle = (np.arange(_PIECES) + 0.5) / _PIECES
        points = low + middle[:, None] * (high - low)
        lengths = places.shares(cloth.mesh, points).mean(axis=0) * float(np.linalg.norm(high - low))
        added = torch.as_tensor(lengths, dtype=cloth.dtype, device=cloth.device)[:, None]
        return replace(cloth, mass=cloth.mass + added * self.line_density)
