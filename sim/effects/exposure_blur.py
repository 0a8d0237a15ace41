"""A camera that averages over its exposure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.sensor import CameraEffect, Sampling

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, kw_only=True)
class ExposureBlur(CameraEffect):
    """The mean over an exposure of length e about the instant, by Gauss–Legendre with five nodes.

    A motion of frequency f keeps the share sin(π f e)/(π f e) of its amplitude; five nodes give it
    to 1e-6 for f e < 1.

    Attributes:
        exposure: e.
    """

    exposure: Annotated[
        Value,
        strength(
            unit="s",
            prior=(1e-3, 0.04),
            admissible=NOT_NEGATIVE,
            source="1/1000 s in sun to the full frame time of 1/25 s at dusk",
        ),
    ] = 0.0

    def change_instants(self, sampling: Sampling) -> Sampling:
        nodes = sampling.instants.new_tensor(_NODES)[:, None] / 2
        weights = sampling.instants.new_tensor(_WEIGHTS) / 2
        moved = sampling.instants.unsqueeze(3) + nodes * self.exposure
        return replace(
            sampling,
            instants=moved.flatten(2, 3),
            weights=(sampling.weights[:, None] * weights).flatten(),
        )
