"""Backward Euler, one linearised solve a step, by batched preconditioned conjugate gradients.

With K the positive semi-definite stiffness at the start of the step (see `membrane.Linearised`) and
d the damping,

    (M + h (h + d) K) Δv = h (F(x) + F_ext(v)) − h (h + d) K v,   v ← v + Δv,   x ← x + h v

(Baraff and Witkin 1998; ArcSim 0.2.1 takes the same step, with a sparse Cholesky factorisation).
Air, gravity, effects are those of the start of the step. Vibrations much faster than 1/h are damped
away by the method itself: it acts like declared damping d = h on the slow ones (|amplification|
1/√(1 + ω² h²) against exp(−d ω² h/2)).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from itertools import accumulate

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth import bending, contact, membrane
from sim.cloth.cloth_batch import gather_sum
from sim.cloth.inertia import mean_normals
from sim.cloth.state import State
from sim.cloth.system import Drive, System
from sim.integrate.backend import Backend, kernel_for
from sim.kernel.fused import Kernel


class AirShape(StrEnum):
    """Which shape of the cloth the air acts on."""

    CURRENT = "current"
    """That of the start of the step."""
    PREVIOUS = "previous"
    """That of the start of the step before, as in ArcSim 0.2.1, whose normals lag by one step.
    Measured: with it the reference's 5 ms runs are followed to a micrometre at 8 m/s, without it to
    5 mm after five frames."""


@dataclass(frozen=True, kw_only=True)
class BackwardEuler:
    """Backward Euler.

    Attributes:
        step: upper bound of the step [s]; the paper's simulations take 5 ms.
        air_shape: the shape the wind's force is taken at; CURRENT unless ArcSim is to be
            reproduced.
        tolerance: relative residual at which a member's solve stops.
        iterations: bound on conjugate-gradient steps. A member that has not converged by then gets
            NaN, which `State.healthy` reports; the others go on.
        backend: what computes the step; the kernel has all but contact, and but effects without
            C++.
    """

    step: float = 5e-3
    air_shape: AirShape = AirShape.CURRENT
    tolerance: float = 1e-6
    iterations: int = 20_000
    backend: Backend = Backend.AUTO

    def __post_init__(self) -> None:
        if not (math.isfinite(self.step) and self.step > 0):
            raise UsageError(
                f"the step is {self.step!r} s",
                where="integrator implicit",
                fix="give a positive step",
            )
        if not (0 < self.tolerance < 1):
            raise UsageError(
                f"the tolerance is {self.tolerance!r}",
                where="integrator implicit",
                fix="give one between 0 and 1",
            )

    def advance(self, system: System, state: State, duration: float) -> State:
        """Computes the state `duration` seconds later."""
        steps = max(1, math.ceil(duration / self.step - 1e-9))
        h = duration / steps
        kernel = self._kernel(system, state)
        if kernel is not None and system.limits is None and not system.remembering:
            return self._at_once(kernel, system, state, h, steps)
        for _ in range(steps):
            state = self.take_step(system, state, system.drive(state.time, state.time + h), h)
        return state

    def _kernel(self, system: System, state: State) -> Kernel | None:
        """Returns the kernel where it can take the step."""
        kernel = kernel_for(system, state, self.backend)
        lacking = (
            kernel is None or (system.extra and kernel.beside is None) or system.contact is not None
        )
        return None if lacking else kernel

    def _at_once(self, kernel: Kernel, system: System, state: State, h: float, steps: int) -> State:
        """Steps of `h` [s] in one call of the kernel."""
        times = list(accumulate([h] * steps, initial=state.time))
        x, v = kernel.implicit(
            [system.wind.velocity(time) for time in times[:-1]],
            [system.targets(time) for time in times[1:]],
            state.position,
            state.velocity,
            h,
            lag=self._lag(h),
            tolerance=self.tolerance,
            iterations=self.iterations,
            offsets=[system.offset(time) for time in times[:-1]],
        )
        return State(position=x, velocity=v, time=times[-1])

    def _lag(self, h: float) -> float:
        return h if self.air_shape is AirShape.PREVIOUS else 0.0

    def take_step(self, system: System, state: State, drive: Drive, h: float) -> State:
        """Computes the state one step of `h` [s] later, whatever `step` is, with what moves the
        cloth from outside meanwhile."""
        cloth = system.cloth
        x, v, time = state.position, state.velocity, state.time
        if (kernel := self._kernel(system, state)) is not None:
            x, v = kernel.implicit(
                drive.wind[:1],
                drive.targets[1:],
                x,
                v,
                h,
                lag=self._lag(h),
                tolerance=self.tolerance,
                iterations=self.iterations,
                offsets=drive.offset[:1],
                memory=system.checked(state.memory),
            )
            return self._end_of_step(system, state, drive, *system.limit_strains(x, v, h), h)
        if system.is_clamped:
            v = v.index_copy(0, system.held, (drive.targets[1] - x[system.held]) / h)
        mass = cloth.mass.unsqueeze(1)
        faces = membrane.LinearisedMembrane.at(cloth, x)
        folds = bending.LinearisedBending.at(cloth, x) if len(cloth.hinges) else None
        factor = h * (h + cloth.damping)
        tied = system.tied(time, x)
        normals = mean_normals(cloth, x) if system.loads else None
        contacts = _contacts(system, x, v)
        added = system.added_mass.unsqueeze(1)

        def stiffness(field: Tensor) -> Tensor:
            product = gather_sum(faces.corner_products(field), cloth.face_slots)
            if folds is not None:
                product = product + gather_sum(folds.corner_products(field), cloth.hinge_slots)
            if system.sprung:
                product = product.index_add(
                    0, system.held, system.handles.stiffness * field[system.held]
                )
            if tied is not None:
                product = product + tied * field
            if contacts is not None:
                product = product + contacts.product(field)
            return product

        def inertia(field: Tensor) -> Tensor:
            product = mass * field
            if normals is not None:
                product = product + added * (normals * field).sum(1, keepdim=True) * normals
            return product

        # The method's own update makes x − h v the positions one step ago.
        air_position = x - h * v if self.air_shape is AirShape.PREVIOUS else x
        external = system.external(
            drive.wind[0], time, x, v, memory=state.memory, air_position=air_position
        )
        force = faces.force() + external
        diagonal = gather_sum(faces.diagonal(), cloth.face_slots)
        if folds is not None:
            force = force + folds.force()
            diagonal = diagonal + gather_sum(folds.diagonal(), cloth.hinge_slots)
        if system.sprung:
            # The springs' own end is where the handles are at the end of the step.
            pull = -system.handles.stiffness * (x[system.held] - drive.targets[1])
            force = force.index_add(0, system.held, pull)
            hold = torch.full_like(x[system.held], system.handles.stiffness)
            diagonal = diagonal.index_add(0, system.held, hold)

        free = torch.ones_like(x[:, :1])
        if system.is_clamped:
            free[system.held] = 0

        def operator(field: Tensor) -> Tensor:
            product = inertia(field) + factor * stiffness(field)
            if contacts is not None:
                product = product + h * contacts.drag(field)
            return free * product

        weight = mass
        if tied is not None:
            diagonal = diagonal + tied
        if normals is not None:
            weight = weight + added * normals**2
        if contacts is not None:
            force = force + contacts.force(x) - contacts.drag(v)
        right = free * (h * force - factor * stiffness(v))
        change = conjugate_gradients(
            operator,
            right,
            weight + factor * diagonal,
            tolerance=self.tolerance,
            iterations=self.iterations,
        )
        v = v + change
        return self._end_of_step(system, state, drive, *system.limit_strains(x + h * v, v, h), h)

    def _end_of_step(
        self, system: System, state: State, drive: Drive, x: Tensor, v: Tensor, h: float
    ) -> State:
        """Computes the end of a step from a state, with what forces remember of it in the wind of
        its start."""
        memory = system.remember_step(state.memory, drive.wind[0], state.time, x, v, elapsed=h)
        return State(position=x, velocity=v, time=state.time + h, memory=memory)


def _contacts(
    system: System, position: Tensor, velocity: Tensor
) -> contact.LinearisedContact | None:
    if system.contact is None:
        return None
    pairs = contact.candidates(system.cloth, system.contact, position, system.neighbours)
    return contact.LinearisedContact.at(system.cloth, system.contact, position, velocity, pairs)


def conjugate_gradients(
    operator: Callable[[Tensor], Tensor],
    right: Tensor,
    diagonal: Tensor,
    *,
    tolerance: float,
    iterations: int,
) -> Tensor:
    """Solves operator(y) = right for every member of the batch by itself.

    A member stops changing once its residual, in the norm of the diagonal preconditioner's inverse,
    has fallen by
    `tolerance`: what it gets does not depend on the others.

    Args:
        operator: symmetric positive definite, on (vertex, 3, batch).
        right: (vertex, 3, batch).
        diagonal: positive, the same shape: the Jacobi preconditioner.

    Returns:
        The same shape; NaN for members that did not converge.
    """
    solution = torch.zeros_like(right)
    residual = right
    scaled = residual / diagonal
    direction = scaled
    product = (residual * scaled).sum((0, 1))
    goal = tolerance**2 * product
    active = product > 0
    for _ in range(iterations):
        if not bool(active.any()):
            break
        image = operator(direction)
        length = torch.where(active, product / (direction * image).sum((0, 1)), 0.0)
        solution = solution + length * direction
        residual = residual - length * image
        scaled = residual / diagonal
        following = (residual * scaled).sum((0, 1))
        direction = torch.where(active, scaled + following / product * direction, direction)
        product = torch.where(active, following, product)
        active = active & ~(product <= goal) & torch.isfinite(product)
    failed = ~(product <= goal)
    return torch.where(failed, torch.nan, solution)
