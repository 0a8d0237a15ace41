"""Winds: the velocity of the undisturbed air at the cloth, for every member of a batch, as a
function of time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from torch import Tensor

from flagdata.packages.lazy import lazy_exports
from flagdata.recipes.registry import Registry

if TYPE_CHECKING:
    from sim.wind.sampled import Beyond, Even, SampledWind
    from sim.wind.spectral_wind import VonKarman
    from sim.wind.uniform import UniformWind


class Wind(Protocol):
    """Air velocity in the frame of the scene: where the air goes to, +z up."""

    def velocity(self, time: float) -> Tensor:
        """Returns the velocity (3, batch) [m/s] at a time since the start of the run [s]."""
        ...


WINDS = Registry(
    "wind",
    {
        "uniform": "sim.wind.uniform:UniformWind",
    },
)

__getattr__ = lazy_exports(__name__, __file__)
