"""Small explicit steps with declared damping: leapfrog (kick–drift–kick).

For conservative forces it is symplectic and of second order; forces that depend on velocity (damping, air) see the
velocity half a step back, which is of first order in the step for those terms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flagdata.errors import UsageError
from sim.integrate.stability import stable_step
from sim.state import State
from sim.system import System

# Share of the linear stability limit that is used: large deformation stiffens faces beyond the estimate.
_SAFETY = 0.7


@dataclass(frozen=True, kw_only=True)
class Symplectic:
    """Leapfrog.

    Attributes:
        step: upper bound of the step [s]; None for 0.7 of the stability limit of the system's start.
    """

    step: float | None = None

    def steps(self, system: System, state: State, duration: float) -> int:
        """How many steps a duration [s] takes.

        Raises:
            UsageError: a forced step beyond the stability limit.
        """
        limit = stable_step(system, state)
        if self.step is None:
            return max(1, math.ceil(duration / (_SAFETY * limit) - 1e-9))
        if not (0 < self.step < limit):
            raise UsageError(
                f"a step of {self.step:g} s is unstable: the limit of this mesh and material is {limit:.3g} s",
                where="integrator symplectic", fix="leave the step out, or use the implicit integrator",
            )  # fmt: skip
        return max(1, math.ceil(duration / self.step - 1e-9))

    def advance(self, system: System, state: State, duration: float) -> State:
        """The state `duration` seconds later."""
        return advance(system, state, duration, steps=self.steps(system, state, duration))


def advance(system: System, state: State, duration: float, *, steps: int) -> State:
    """`steps` equal leapfrog steps over `duration` seconds; wind and handles are linear in between."""
    h = duration / steps
    drive = system.drive(state.time, state.time + duration)
    inverse_mass = 1 / system.cloth.mass.unsqueeze(1)
    if system.clamped:
        inverse_mass = inverse_mass.index_fill(0, system.held, 0.0)
    x, v = state.position, state.velocity
    if system.clamped:
        v = v.index_copy(0, system.held, drive.rate)
    for index in range(steps + 1):
        share = index / steps
        weight = h / 2 if index in (0, steps) else h
        force = system.force(drive, share, state.time + share * duration, x, v)
        v = v + weight * inverse_mass * force
        if index < steps:
            x = x + h * v
    return State(position=x, velocity=v, time=state.time + duration)
