"""Winds: the velocity of the undisturbed air at the cloth, for every member of a batch, as a function of time."""

from __future__ import annotations

from typing import Protocol

from torch import Tensor

from flagdata.registry import Registry


class Wind(Protocol):
    """Air velocity in the frame of the scene: where the air goes to, +z up."""

    def velocity(self, time: float) -> Tensor:
        """(3, batch) [m/s] at a time since the start of the run [s]."""
        ...


WINDS = Registry(
    "wind",
    {
        "uniform": "sim.wind.uniform:UniformWind",
    },
)
