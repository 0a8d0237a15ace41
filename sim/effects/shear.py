"""Wind that grows with height."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from torch import Tensor

from sim.effects.effect import FlowEffect
from sim.effects.parameter import Value, shape, strength

_LOWEST = 0.05
"""Share of the reference height below which the profile is taken as constant."""


@dataclass(frozen=True, kw_only=True)
class Shear(FlowEffect):
    """The wind is multiplied by (z/H)^α, z the height above ground; it is as given at the
    attachments' middle, z = H.

    Attributes:
        exponent: α.
        height: H of the attachments' middle above ground.
    """

    exponent: Annotated[
        Value,
        strength(
            unit="1",
            prior=(-0.1, 0.5),
            weighed=(-0.3, 0.8),
            step=0.15,
            admissible=(-2.0, 2.0),
            source="0.1 over water, 0.14 open land, 0.2 by IEC 61400-1, 0.3–0.4 in towns; stable "
            "nights more",
        ),
    ] = 0.0
    height: Annotated[
        Value,
        shape(
            unit="m",
            prior=(1.5, 15.0),
            admissible=(0.1, 1e3),
            source="flag poles of 2–15 m; a wind tunnel has none",
        ),
    ] = 6.0

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        relative = (1 + offset[:, 2:] / self.height).clamp(min=_LOWEST)
        return wind * relative**self.exponent
