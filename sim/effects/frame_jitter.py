"""A camera whose frames come irregularly."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, Self

import numpy as np
import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.sensor import CameraEffect, Sampling


@dataclass(frozen=True, kw_only=True)
class FrameJitter(CameraEffect):
    """Frame i is taken at t_i + σ g_i, stored as at t_i.

    Attributes:
        deviation: σ.
        draws: (frame, batch or 1) g, standard normal.
    """

    deviation: Annotated[
        Value,
        strength(
            unit="s",
            prior=(0.0, 5e-3),
            admissible=NOT_NEGATIVE,
            source="stamps given by a computer at arrival: 1–5 ms; by the camera itself: "
            "microseconds",
        ),
    ] = 0.0
    draws: Tensor = field(default_factory=lambda: torch.zeros(1, 1, dtype=torch.float64))

    def change_instants(self, sampling: Sampling) -> Sampling:
        if len(self.draws) < len(sampling.stamps):
            raise UsageError(
                f"there are {len(self.draws)} draws for {len(sampling.stamps)} frames",
                where="frame jitter",
                fix="draw as many as there are frames",
            )
        shift = self.deviation * self.draws[: len(sampling.stamps)]
        return replace(sampling, instants=sampling.instants + shift[:, None, None, :])

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, batch: int) -> Self:
        """As for all effects, with draws for 10,000 frames of each member."""
        return replace(
            super().drawn(rng, batch=batch),
            draws=torch.from_numpy(rng.standard_normal((10_000, batch))),
        )
