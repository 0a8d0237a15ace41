"""Backward Euler with what the base model lacks as impulses between its steps: long steps, noisy
states, effects.

A step of h is

    v ← v + h M⁻¹ F_extra(x, v),   a backward Euler step of the base model,

Lie's splitting, of first order in h as the base step is. Air that moves with the cloth takes its
share of the step's change of velocity (see `sim.cloth.inertia`); springs beside the handles act
implicitly, vertex by vertex. What loosens the handles is part of the base model's solve, since no
impulse can take back what they pull. The base step is the compiled kernel's, so that an effect
costs one evaluation a step, not one an iteration of the solver.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate

import torch
from torch import Tensor

from sim.cloth.inertia import effective, mean_normals
from sim.cloth.state import State
from sim.cloth.system import Drive, System
from sim.integrate.backend import extra_force, kernel_for
from sim.integrate.implicit import AirShape, BackwardEuler
from sim.integrate.joint_batch import JointBatch
from sim.kernel.fused import Kernel


@dataclass(frozen=True, kw_only=True)
class SplitEuler:
    """Backward Euler for the base model, impulses for the rest.

    Attributes:
        base: of the base model; its step is the splitting's.
    """

    base: BackwardEuler = field(default_factory=lambda: BackwardEuler(tolerance=1e-4))

    def advance(self, system: System, state: State, duration: float) -> State:
        """Computes the state `duration` seconds later."""
        plain, system = system.alone, system.beside
        if not (system.extra or system.loads or system.ties):
            return self.base.advance(plain, state, duration)
        steps, h = self._steps(duration)
        if (kernels := self._kernels(plain, [system], state)) is not None:
            return self._at_once(plain, *kernels, state, h, steps)
        for drive in system.drives(_times(state.time, h, steps)):
            begun = replace(
                state, velocity=self._pushed_velocity(system, state, drive, h), memory=()
            )
            state = _carried_state(
                system, state, self.base.take_step(plain, begun, drive, h), drive, h
            )
        return state

    def advance_jointly(self, batches: JointBatch, state: State, duration: float) -> State:
        """Advances several batches jointly: their members move as they do in batches of their own.

        Raises:
            UsageError: batches that cannot be joined.
        """
        plain = batches.plain
        steps, h = self._steps(duration)
        if (kernels := self._kernels(plain, batches.beside, state)) is not None:
            return self._at_once(plain, *kernels, state, h, steps)
        for drive in plain.drives(_times(state.time, h, steps)):
            parts = list(batches.parts(state))
            velocity = state.velocity.clone()
            for system, members, part_state in parts:
                if system.extra or system.ties:
                    velocity[..., members] = self._pushed_velocity(
                        system, part_state, drive.select(members), h
                    )
            after = self.base.take_step(
                plain, replace(state, velocity=velocity, memory=()), drive, h
            )
            memory: list[Tensor] = []
            for system, members, part_state in parts:
                if system.loads or system.remembering:
                    carried = _carried_state(
                        system, part_state, after.select(members), drive.select(members), h
                    )
                    after.position[..., members] = carried.position
                    after.velocity[..., members] = carried.velocity
                    memory += carried.memory
            state = replace(after, memory=tuple(memory))
        return state

    def _kernels(
        self, plain: System, systems: Sequence[System], state: State
    ) -> tuple[Kernel, tuple[Kernel, ...]] | None:
        """Chooses the kernels of the base model of all and of the batches; None where one of them
        cannot take the steps."""
        kernel = kernel_for(plain, state, self.base.backend)
        if kernel is None or plain.contact is not None or plain.limits is not None:
            return None
        if self.base.air_shape is not AirShape.CURRENT:
            return None
        parts: list[Kernel] = []
        for system in systems:
            of_system = kernel_for(system, state, self.base.backend, kind=kernel.kind)
            if of_system is None or of_system.beside is None:
                return None
            parts.append(of_system)
        return kernel, tuple(parts)

    def _at_once(
        self,
        plain: System,
        kernel: Kernel,
        parts: Sequence[Kernel],
        state: State,
        h: float,
        steps: int,
    ) -> State:
        """Steps of `h` [s] in one call of the kernel."""
        times = _times(state.time, h, steps)
        x, v, memory = kernel.split(
            parts,
            [plain.wind.velocity(time) for time in times[:-1]],
            [plain.targets(time) for time in times[1:]],
            state.position,
            state.velocity,
            h,
            tolerance=self.base.tolerance,
            iterations=self.base.iterations,
            offsets=[plain.offset(time) for time in times[:-1]],
            memory=state.memory,
        )
        return State(position=x, velocity=v, time=times[-1], memory=memory)

    def _steps(self, duration: float) -> tuple[int, float]:
        """Returns how many steps are taken, and how long each is [s]."""
        steps = max(1, math.ceil(duration / self.base.step - 1e-9))
        return steps, duration / steps

    def _pushed_velocity(self, system: System, state: State, drive: Drive, h: float) -> Tensor:
        """Computes the velocity (vertex, 3, batch) [m/s] that the base model's step begins with."""
        x, v, time = state.position, state.velocity, state.time
        mass = system.cloth.mass.unsqueeze(1)
        kernel = kernel_for(system, state, self.base.backend)
        impulse = h * extra_force(kernel, system, drive, 0.0, time, x, v, memory=state.memory)
        stiffness = system.tied(time, x)
        if stiffness is None:
            return v + impulse / mass
        pull = torch.stack([tie.force(system.cloth, time, x) for tie in system.ties]).sum(0)
        return v + (impulse + h * pull - h * h * stiffness * v) / (mass + h * h * stiffness)


def _times(start: float, h: float, steps: int) -> list[float]:
    """Returns start and end of steps [s], added up as states are."""
    return list(accumulate([h] * steps, initial=start))


def _carried_state(system: System, before: State, after: State, drive: Drive, h: float) -> State:
    """Computes the end of a step, after the base model's: with air that moves along, and what
    forces remember of it in the wind of its start."""
    if system.loads:
        x, v = before.position, before.velocity
        mass, normals = system.cloth.mass.unsqueeze(1), mean_normals(system.cloth, x)
        change = mass * (after.velocity - v)
        change = (
            effective(change, mass=system.cloth.mass, added=system.added_mass, normals=normals)
            / mass
        )
        after = replace(after, position=x + h * (v + change), velocity=v + change)
    memory = system.remember_step(
        before.memory, drive.wind[0], before.time, after.position, after.velocity, elapsed=h
    )
    return replace(after, memory=memory)
