"""Backward Euler with what the base model lacks as impulses between its steps: long steps, noisy states, effects.

A step of h is

    v ← v + h M⁻¹ F_extra(x, v),   a backward Euler step of the base model,

Lie's splitting, of first order in h as the base step is. Air that moves with the cloth takes its share of the step's
change of velocity (see `sim.inertia`); springs beside the handles act implicitly, vertex by vertex. The base step is
the compiled kernel's, so that an effect costs one evaluation a step, not one an iteration of the solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.inertia import effective, mean_normals
from sim.integrate.implicit import BackwardEuler
from sim.state import State
from sim.system import System


@dataclass(frozen=True, kw_only=True)
class SplitEuler:
    """Backward Euler for the base model, impulses for the rest.

    Attributes:
        base: of the base model; its step is the splitting's.
    """

    base: BackwardEuler = field(default_factory=lambda: BackwardEuler(tolerance=1e-4))

    def advance(self, system: System, state: State, duration: float) -> State:
        """The state `duration` seconds later.

        Raises:
            UsageError: ties that pull apart (`slack`), which an impulse cannot follow.
        """
        plain = system.alone
        if not (system.extra or system.loads or system.ties):
            return self.base.advance(plain, state, duration)
        steps = max(1, math.ceil(duration / self.base.step - 1e-9))
        h = duration / steps
        for _ in range(steps):
            state = self._step(system, plain, state, h)
        return state

    def _step(self, system: System, plain: System, state: State, h: float) -> State:
        x, v, time = state.position, state.velocity, state.time
        mass = system.cloth.mass.unsqueeze(1)
        drive = system.drive(time, time + h)
        impulse = h * system.extra_force(drive, 0.0, time, x, v, memory=state.memory)
        stiffness = system.tied(time, x)
        resisting = mass if stiffness is None else mass + h * h * _pulling(stiffness)
        if stiffness is not None:
            pull = torch.stack([tie.force(system.cloth, time, x) for tie in system.ties]).sum(0)
            impulse = impulse + h * pull - h * h * stiffness * v
        begun = v + impulse / resisting
        after = self.base.stepped(plain, State(position=x, velocity=begun, time=time), drive, h)
        if system.loads:
            normals = mean_normals(system.cloth, x)
            added = system.added_mass
            change = effective(mass * (after.velocity - v), mass=system.cloth.mass, added=added, normals=normals) / mass
            after = replace(after, position=x + h * (v + change), velocity=v + change)
        return replace(after, memory=system.remembered(state.memory, after.position))


def _pulling(stiffness: Tensor) -> Tensor:
    if bool((stiffness < 0).any()):
        raise UsageError(
            "ties that loosen handles cannot act as impulses",
            where="integrator split", fix="use the symplectic or the implicit integrator for this effect",
        )  # fmt: skip
    return stiffness
