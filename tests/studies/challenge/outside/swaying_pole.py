"""A slender pole, with the camera on it, that sways across the wind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.cloth import Cloth
from sim.effects import NOT_NEGATIVE, ForceEffect, Value, left_of, norm, shape, strength


@dataclass(frozen=True, kw_only=True)
class SwayingPole(ForceEffect):
    """Inertial force m A ω² sin ω t to the left of the wind, ω = 2π f, in the frame of a pole that
    is A sin ω t to the left of where it stands. The wind is that of the swaying frame.

    Attributes:
        amplitude: A.
        frequency: f.
    """

    amplitude: Annotated[
        Value,
        strength(
            unit="m",
            prior=(0.0, 0.1),
            admissible=NOT_NEGATIVE,
            source="masts in lock-in with their vortices sway by 0.1–1 of their diameter of 50–150 "
            "mm, rods held by "
            "hand by more (Blevins, Flow-Induced Vibration, 1990, ch. 3)",
        ),
    ] = 0.0
    frequency: Annotated[
        Value,
        shape(
            unit="Hz",
            prior=(0.8, 3.0),
            admissible=(1e-2, 50.0),
            source="first modes of tapered aluminium and fibreglass poles of 6–12 m",
        ),
    ] = 1.7

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        left = left_of(wind, axis=-2)
        left = left / norm(left, axis=-2).clamp(min=torch.finfo(position.dtype).tiny)
        rate = torch.as_tensor(
            2 * math.pi * self.frequency, dtype=position.dtype, device=position.device
        )
        push = self.amplitude * rate**2 * torch.sin(rate * time)
        return cloth.mass.unsqueeze(1) * push * left
