"""Integrators: from one state to the next, for any system."""

from __future__ import annotations

from typing import Protocol

from flagdata.registry import Registry
from sim.state import State
from sim.system import System


class Integrator(Protocol):
    """A method and its step."""

    def advance(self, system: System, state: State, duration: float) -> State:
        """The state `duration` seconds later; a whole number of steps is taken."""
        ...


INTEGRATORS = Registry(
    "integrator",
    {
        "symplectic": "sim.integrate.symplectic:Symplectic",
        "implicit": "sim.integrate.implicit:BackwardEuler",
    },
)
