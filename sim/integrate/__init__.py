"""Integrators: from one state to the next, for any system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from flagdata.packages.lazy import lazy_exports
from flagdata.recipes.registry import Registry
from sim.cloth.state import State
from sim.cloth.system import System

if TYPE_CHECKING:
    from sim.integrate.backend import Backend
    from sim.integrate.implicit import AirShape, BackwardEuler
    from sim.integrate.joint_batch import JointBatch
    from sim.integrate.split import SplitEuler
    from sim.integrate.stability import stable_step
    from sim.integrate.symplectic import Symplectic, advance


class Integrator(Protocol):
    """A method and its step."""

    def advance(self, system: System, state: State, duration: float) -> State:
        """Computes the state `duration` seconds later; a whole number of steps is taken."""
        ...


INTEGRATORS = Registry(
    "integrator",
    {
        "symplectic": "sim.integrate.symplectic:Symplectic",
        "implicit": "sim.integrate.implicit:BackwardEuler",
    },
)

__getattr__ = lazy_exports(__name__, __file__)
