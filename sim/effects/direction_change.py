"""A wind that turns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import torch
from torch import Tensor

from sim.effects.cloth_geometry import horizontal, left_of
from sim.effects.effect import WindEffect
from sim.effects.parameter import Value, shape, strength
from sim.effects.weighing import Copied, Need


@dataclass(frozen=True, kw_only=True)
class DirectionChange(WindEffect):
    """The wind turns about the vertical by an angle, along the smooth ramp 3 s² − 2 s³, and stays
    there.

    Attributes:
        angle: counter-clockwise seen from above: the wind backs.
        start: when it begins to turn, since the start of the run.
        duration: how long it turns.
    """

    unweighed: ClassVar[str] = "the direction of a log is fitted within its own tolerance"
    weighed_shapes: ClassVar[Mapping[str, float]] = {"start": -1.0, "duration": 1e-3}
    effect_class: ClassVar[str] = "turbulence"
    copied: ClassVar[Copied | None] = Copied(
        by="the wind's direction", shown_by=Need.DIRECTION, how="a vane beside the pole"
    )
    angle: Annotated[
        Value,
        strength(
            unit="rad",
            prior=(-0.8, 0.8),
            step=0.05,
            admissible=(-2 * math.pi, 2 * math.pi),
            source="standard deviation of the direction over 10 min: 0.17–0.44 rad (Pasquill "
            "classes D to A)",
        ),
    ] = 0.0
    start: Annotated[
        Value,
        shape(
            unit="s",
            prior=(0.0, 10.0),
            source="anywhere in the first part of a recording; a free choice",
        ),
    ] = 0.0
    duration: Annotated[
        Value,
        shape(
            unit="s",
            prior=(1.0, 30.0),
            admissible=(1e-3, 1e6),
            source="large eddies of 10–100 m passing at 3–10 m/s",
        ),
    ] = 5.0

    def velocity(self, time: float, wind: Tensor) -> Tensor:
        share = torch.as_tensor(
            (time - self.start) / self.duration, dtype=wind.dtype, device=wind.device
        ).clamp(0, 1)
        angle = self.angle * share**2 * (3 - 2 * share)
        level = horizontal(wind, axis=0)
        return wind + (torch.cos(angle) - 1) * level + torch.sin(angle) * left_of(wind, axis=0)
