"""A camera whose frame rate is not what it says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from sim.effects.parameter import Value, strength
from sim.effects.sensor import CameraEffect, Sampling


@dataclass(frozen=True, kw_only=True)
class FrameRateError(CameraEffect):
    """Frames are taken at f (1 + ε) and stored as at f: every frequency appears divided by 1 + ε.

    Attributes:
        error: ε.
    """

    error: Annotated[
        Value,
        strength(
            unit="1",
            prior=(-0.05, 0.05),
            admissible=(-0.5, 0.5),
            source="25 stored for 24 (4 %), 30 for 29.97 (0.1 %); web cameras in low light more",
        ),
    ] = 0.0

    def change_instants(self, sampling: Sampling) -> Sampling:
        elapsed = (sampling.stamps - sampling.stamps[0])[:, None, None, None]
        # t₀ + (t − t₀)/(1 + ε) as a change, so that it is exactly none at ε = 0.
        return replace(
            sampling, instants=sampling.instants - elapsed * (self.error / (1 + self.error))
        )
