"""Small explicit steps with declared damping: leapfrog (kick–drift–kick).

For conservative forces it is symplectic and of second order; the base model's forces that depend on velocity (damping,
air) see the velocity half a step back, which is of first order in the step for those terms. Effects see it carried on
over that half step by the last acceleration: of second order, since some of them (reactive loading) give energy at the
first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flagdata.errors import UsageError
from sim.integrate.backend import Backend, kernel_for
from sim.integrate.stability import stable_step
from sim.state import State
from sim.system import System

# Share of the linear stability limit that is used: large deformation stiffens faces beyond the estimate.
_SAFETY = 0.7


@dataclass(frozen=True, kw_only=True)
class Symplectic:
    """Leapfrog.

    Attributes:
        step: upper bound of the step [s]; None for 0.7 of the stability limit of the system.
        backend: what computes the forces.
    """

    step: float | None = None
    backend: Backend = Backend.AUTO

    def steps(self, system: System, duration: float) -> int:
        """How many steps a duration [s] takes.

        Raises:
            UsageError: a forced step beyond the stability limit.
        """
        limit = stable_step(system)
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
        return advance(system, state, duration, steps=self.steps(system, duration), backend=self.backend)


def advance(system: System, state: State, duration: float, *, steps: int, backend: Backend = Backend.AUTO) -> State:
    """`steps` equal leapfrog steps over `duration` seconds; wind and handles are linear in between.

    Raises:
        UsageError: the kernel was asked for and cannot run this system, or gradients are wanted from it.
    """
    h = duration / steps
    drive = system.drive(state.time, state.time + duration)
    x, v = state.position, state.velocity
    if system.clamped:
        v = v.index_copy(0, system.held, drive.rate)
    kernel = kernel_for(system, state, backend)
    if kernel is not None and not system.extra:
        x, v = kernel.advance(drive, x, v, h, steps)
        return State(position=x, velocity=v, time=state.time + duration)
    inverse_mass = 1 / system.cloth.mass.unsqueeze(1)
    if system.clamped:
        inverse_mass = inverse_mass.index_fill(0, system.held, 0.0)
    memory, acceleration = state.memory, 0.0 * v
    for index in range(steps + 1):
        share = index / steps
        time = state.time + share * duration
        level = v + h / 2 * acceleration
        if kernel is None:
            force = system.force(drive, share, time, x, v, memory=memory, effect_velocity=level)
        else:
            extra = system.extra_force(drive, share, time, x, v, memory=memory, effect_velocity=level)
            force = kernel.forces(drive, share, x, v) + extra
        acceleration = inverse_mass * system.effective(x, force)
        v = v + (h / 2 if index in (0, steps) else h) * acceleration
        if index < steps:
            x = x + h * v
            x, v = system.limited(x, v, h)
            memory = system.remembered(memory, x)
    return State(position=x, velocity=v, time=state.time + duration, memory=memory)
