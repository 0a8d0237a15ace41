"""Small explicit steps with declared damping: leapfrog (kick–drift–kick), with the forces the base
model lacks at every step, or as impulses on an outer step.

For conservative forces it is symplectic and of second order; the base model's forces that depend on
velocity (damping, air) see the velocity half a step back, which is of first order in the step for
those terms. Effects see it carried on over that half step by the last acceleration: of second
order, since some of them (reactive loading) give energy at the first.

What the base model lacks (`System.extra_force`) is slow beside the vibrations of the membrane that
bound the step, and many times dearer. With an outer step H it acts as impulses between stretches of
the base model's motion,

    v ← v + H/2 M⁻¹ F_extra,   n steps of H/n of the base model,   v ← v + H/2 M⁻¹ F_extra,

the impulse method (Verlet-I: Grubmüller, Heller, Windemuth, Schulten 1991; r-RESPA: Tuckerman,
Berne, Martyna, J. Chem. Phys. 97:1990, 1992), of second order in H.
`sim.integrate.stability.outer_limit` says how long H may be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.state import State
from sim.cloth.system import Drive, System
from sim.integrate.backend import Backend, extra_force, kernel_for, warp_kernel_for
from sim.integrate.stability import outer_limit, stable_step
from sim.kernel.fused import Kernel

SAFETY = 0.7
"""Share of the linear stability limit that is used: large deformation stiffens faces beyond the
estimate. Higher takes fewer steps and leaves less room for such faces; lower costs steps in
proportion."""
# Wind and cloth so much faster together call for another estimate of the longest outer step.
_RISEN = 1.3

_OUTER: WeakKeyDictionary[System, tuple[float, float]] = WeakKeyDictionary()


@dataclass(frozen=True, kw_only=True)
class Symplectic:
    """Leapfrog.

    Attributes:
        step: upper bound of the step [s]; None for a share of the stability limit of the system.
        safety: that share.
        outer: upper bound of the outer step of what the base model lacks [s]; None for every step.
        backend: what computes the forces.

    Raises:
        UsageError: an outer step that is not positive, or a share that is not between 0 and 1.
    """

    step: float | None = None
    safety: float = SAFETY
    outer: float | None = None
    backend: Backend = Backend.AUTO

    def __post_init__(self) -> None:
        if self.outer is not None and not (math.isfinite(self.outer) and self.outer > 0):
            raise UsageError(
                f"the outer step is {self.outer!r} s",
                where="integrator symplectic",
                fix="give a positive one, or none",
            )
        if not 0 < self.safety < 1:
            raise UsageError(
                f"the safety {self.safety!r} is no share of the stability limit",
                where="integrator symplectic",
                fix="give a share below 1",
            )

    def steps(self, system: System, duration: float) -> int:
        """Counts the steps that a duration [s] takes.

        Raises:
            UsageError: a forced step beyond the stability limit.
            InputError: see `stable_step`.
        """
        limit = stable_step(system)
        if self.step is None:
            return max(1, math.ceil(duration / (self.safety * limit) - 1e-9))
        if not (0 < self.step < limit):
            raise UsageError(
                f"a step of {self.step:g} s is unstable: the limit of this mesh and material is "
                f"{limit:.3g} s",
                where="integrator symplectic",
                fix="leave the step out, or use the implicit integrator",
            )
        return max(1, math.ceil(duration / self.step - 1e-9))

    def advance(self, system: System, state: State, duration: float) -> State:
        """Computes the state `duration` seconds later.

        Raises:
            UsageError: see `steps` and `advance`.
        """
        steps = self.steps(system, duration)
        if self.outer is None or not system.extra:
            return advance(system, state, duration, steps=steps, backend=self.backend)
        outer = max(1, math.ceil(duration / self.outer - 1e-9))
        inner = max(1, math.ceil(steps / outer))
        return advance(
            system, state, duration, steps=inner * outer, outer=outer, backend=self.backend
        )


def advance(
    system: System,
    state: State,
    duration: float,
    *,
    steps: int,
    outer: int | None = None,
    backend: Backend = Backend.AUTO,
) -> State:
    """Takes `steps` equal leapfrog steps over `duration` seconds; wind and handles are linear in
    between.

    Args:
        outer: equal outer steps, each of the same number of steps; None for as many as there are
            steps.

    Raises:
        UsageError: a kernel was asked for and cannot run this system, or gradients are wanted from
            it; steps that do not divide into the outer ones; an outer step beyond its limit.
    """
    drive = system.drive(state.time, state.time + duration)
    x, v = state.position, state.velocity
    if system.is_clamped:
        v = v.index_copy(0, system.held, drive.rate)
    start = State(position=x, velocity=v, time=state.time, memory=state.memory)
    if backend is Backend.WARP:
        x, v = warp_kernel_for(system, start).advance(drive, x, v, duration / steps, steps)
        return State(position=x, velocity=v, time=state.time + duration)
    if not system.extra:
        x, v = _base(
            system,
            drive,
            state.time,
            x,
            v,
            duration / steps,
            steps,
            kernel_for(system, start, backend),
        )
        return State(position=x, velocity=v, time=state.time + duration)
    if outer is None:
        kernel = kernel_for(system, start, backend)
        if kernel is None or kernel.beside is None:
            return _each_step(system, drive, start, duration, steps=steps, kernel=kernel)
        x, v, memory = kernel.advance(
            drive, x, v, duration / steps, steps, memory=system.checked(state.memory)
        )
        return State(position=x, velocity=v, time=state.time + duration, memory=memory)
    if steps % outer:
        raise UsageError(
            f"{steps} steps do not divide into {outer} outer ones",
            where="integrator symplectic",
            fix="give a multiple",
        )
    return _impulses(
        system, drive, start, duration, inner=steps // outer, outer=outer, backend=backend
    )


def _base(
    system: System,
    drive: Drive,
    start: float,
    x: Tensor,
    v: Tensor,
    h: float,
    steps: int,
    kernel: Kernel | None,
) -> tuple[Tensor, Tensor]:
    """Positions and velocities after steps of h [s] from a time, of a system that is its own
    base."""
    if kernel is not None:
        x, v, _ = kernel.advance(drive, x, v, h, steps)
        return x, v
    inverse_mass = _inverse_mass(system)
    for index in range(steps + 1):
        share = index / steps
        force = system.force(drive, share, start + share * h * steps, x, v)
        acceleration = inverse_mass * system.effective(x, force)
        v = v + (h / 2 if index in (0, steps) else h) * acceleration
        if index < steps:
            x, v = system.limit_strains(x + h * v, v, h)
    return x, v


def _each_step(
    system: System,
    drive: Drive,
    state: State,
    duration: float,
    *,
    steps: int,
    kernel: Kernel | None,
) -> State:
    """Takes the steps with what acts beside the base model by torch."""
    h = duration / steps
    x, v, memory = state.position, state.velocity, state.memory
    inverse_mass, acceleration = _inverse_mass(system), 0.0 * v
    for index in range(steps + 1):
        share = index / steps
        time = state.time + share * duration
        level = v + h / 2 * acceleration
        if index > 0:
            memory = system.remember_step(
                memory, torch.lerp(*drive.wind, share), time, x, level, elapsed=h
            )
        if kernel is None:
            force = system.force(drive, share, time, x, v, memory=memory, effect_velocity=level)
        else:
            extra = system.extra_force(
                drive, share, time, x, v, memory=memory, effect_velocity=level
            )
            force = kernel.forces(drive, share, x, v) + extra
        acceleration = inverse_mass * system.effective(x, force)
        v = v + (h / 2 if index in (0, steps) else h) * acceleration
        if index < steps:
            x, v = system.limit_strains(x + h * v, v, h)
    return State(position=x, velocity=v, time=state.time + duration, memory=memory)


def _impulses(
    system: System,
    drive: Drive,
    state: State,
    duration: float,
    *,
    inner: int,
    outer: int,
    backend: Backend,
) -> State:
    base, length = system.base, duration / outer
    _check_outer(system, state, drive, length)
    x, v, memory = state.position, state.velocity, state.memory
    complete = kernel_for(system, state, backend)
    kernel = None if complete is None else Kernel.of(base)
    inverse_mass, acceleration = _inverse_mass(system), 0.0 * v
    for index in range(outer + 1):
        share = index / outer
        level = v + length / 2 * acceleration
        time = state.time + share * duration
        if index > 0:
            memory = system.remember_step(
                memory, torch.lerp(*drive.wind, share), time, x, level, elapsed=length
            )
        force = extra_force(complete, system, drive, share, time, x, level, memory=memory)
        acceleration = inverse_mass * system.effective(x, force)
        v = v + (length / 2 if index in (0, outer) else length) * acceleration
        if index < outer:
            part = drive.part(share, (index + 1) / outer)
            x, v = _base(base, part, time, x, v, length / inner, inner, kernel)
    return State(position=x, velocity=v, time=state.time + duration, memory=memory)


def _check_outer(system: System, state: State, drive: Drive, length: float) -> None:
    """Refuses an outer step [s] beyond the limit, which is estimated anew where wind and cloth have
    become faster."""
    moving = (state.velocity**2).sum(1).mean(0).sqrt()
    healthy = moving[state.healthy()]
    speed = max(float(wind.norm(dim=0).max()) for wind in drive.wind) + float(
        healthy.max() if len(healthy) else 0
    )
    estimated = _OUTER.get(system)
    if estimated is None or speed > _RISEN * estimated[0]:
        estimated = _OUTER[system] = (speed, outer_limit(system, state, drive))
    if length > estimated[1]:
        raise UsageError(
            f"an outer step of {length:.3g} s is too long: what acts beside the base model changes "
            "within "
            f"{estimated[1]:.3g} s, the longest that is stable",
            where="integrator symplectic",
            fix="give a shorter outer step, or none",
        )


def _inverse_mass(system: System) -> Tensor:
    """Computes inverse masses (vertex, 1, batch) [1/kg]: 0 where held rigidly."""
    inverse = 1 / system.cloth.mass.unsqueeze(1)
    return inverse.index_fill(0, system.held, 0.0) if system.is_clamped else inverse
