"""The bending stiffness of hems around the cloth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import torch
from torch import Tensor

from sim.cloth.cloth_batch import Cloth
from sim.effects.cloth_geometry import edge_distances
from sim.effects.effect import ClothEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, shape, strength


@dataclass(frozen=True, kw_only=True)
class HemStiffness(ClothEffect):
    """Within a strip along the boundary the cloth bends r times harder on top.

    A hinge is stiffened by r times the share of its edge that lies within the strip, so that the
    result depends on the hem and not on the mesh, as long as cells are wider than the hem or
    resolve it.

    Attributes:
        ratio: r = (stiffness of the hem − stiffness of the cloth) / stiffness of the cloth.
        width: of the strip.
    """

    double: ClassVar[bool] = True
    effect_class: ClassVar[str] = "bending"
    ratio: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 26.0),
            weighed=(3.0, 60.0),
            step=5.0,
            admissible=NOT_NEGATIVE,
            source="three layers: 3³ − 1 = 26 where they are bonded and bend as one plate, 3 − 1 = "
            "2 where they slide",
        ),
    ] = 0.0
    width: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.005, 0.03),
            admissible=(1e-4, 1.0),
            source="hems of flags and garments: 5–30 mm",
        ),
    ] = 0.015

    def cloth(self, cloth: Cloth) -> Cloth:
        within = self._within(cloth)
        added = (self.ratio * within).expand(len(cloth.hinges), cloth.batch)
        return replace(
            cloth, stiffening=added if cloth.stiffening is None else cloth.stiffening + added
        )

    def _within(self, cloth: Cloth) -> Tensor:
        """Computes the share of the hinges' edges within the strip, (hinge, batch or 1)."""
        distance = edge_distances(cloth.mesh)[cloth.mesh.hinges[:, :2]]
        nearest = torch.as_tensor(distance.min(axis=1), dtype=cloth.dtype, device=cloth.device)[
            :, None
        ]
        span = torch.as_tensor(np.ptp(distance, axis=1), dtype=cloth.dtype, device=cloth.device)[
            :, None
        ]
        reach = torch.as_tensor(self.width, dtype=cloth.dtype, device=cloth.device) - nearest
        level = span <= 0
        sloped = (reach / torch.where(level, 1.0, span)).clamp(0, 1)
        return torch.where(level, (reach > 0).to(cloth.dtype), sloped)
