"""A camera that reads one row after the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from sim.effects.parameter import Value, strength
from sim.effects.sensor import CameraEffect, Sampling


@dataclass(frozen=True, kw_only=True)
class RollingShutter(CameraEffect):
    """Row r, from 0 at the top to 1 at the bottom, is exposed at t + T (r − ½).

    Attributes:
        readout: T from the top row to the bottom row; negative for a camera held upside down.
    """

    readout: Annotated[
        Value,
        strength(
            unit="s",
            prior=(0.0, 0.033),
            admissible=(-1.0, 1.0),
            source="CMOS sensors of telephones and web cameras: 10–33 ms; global shutters 0",
        ),
    ] = 0.0

    def change_instants(self, sampling: Sampling) -> Sampling:
        return replace(
            sampling,
            instants=sampling.instants + (sampling.rows[:, None, None] - 0.5) * self.readout,
        )
