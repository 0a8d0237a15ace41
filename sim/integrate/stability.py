"""The largest stable step of an explicit method, from the stiffest vibration of the cloth, and how
long what the base model lacks may act as impulses, from how fast it changes with shape and
velocity."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from weakref import WeakKeyDictionary

import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.cloth import bending, membrane
from sim.cloth.cloth_batch import gather_sum
from sim.cloth.state import State
from sim.cloth.system import Drive, System

_ITERATIONS = 80
# Power iteration approaches from below; after 80 steps the deficit on such meshes is under 5 %.
_DEFICIT = 1.05
# Strain the stiffness is taken at: faces rarely exceed it where strain is not limited.
_STRETCH = 1.15

# Of the outer step: how far a slow force may be damped or turned in one impulse. Damping beyond
# twice the inverse rate overshoots; a stiffness ω² beyond about d π³/H³ feeds the vibrations of
# period 2 H faster than the damping d takes from them, which is ω H = 1.2 at d = 0.25 ms and H = 5
# ms.
_DAMPED, _TURNED = 0.5, 1.0
_OUTER_ITERATIONS = 12

_LONGEST = 1e100  # s; the square of a longer damping overflows
_LIMITS: WeakKeyDictionary[System, float] = WeakKeyDictionary()


def stiffest(system: System) -> Tensor:
    """Estimates from above the largest eigenvalue ω² of M⁻¹K: (batch,) [1/s²].

    Taken at the rest shape stretched by 15 %, with the largest entries of every table and handle
    springs; and, where there is contact, at the rest shape with the repulsion on top, if that is
    more: layers that lie on one another are not what is stretched most.
    """
    value = _stiffest_stretched(system, _STRETCH)
    if system.contact is None:
        return value
    # The repulsion's stiffness k a v/h at a violation of half the thickness, on a vertex of mass ρ
    # a. Layers at rest on one another stay further apart; the step's safety covers the rest.
    repulsion = (
        system.contact.stiffness
        / 2
        * torch.tensor([1 / m.area_weight for m in system.cloth.materials]).to(value)
    )
    return torch.maximum(value, _stiffest_stretched(system, 1.0) + repulsion)


def _stiffest_stretched(system: System, stretch: float) -> Tensor:
    """Estimates the largest eigenvalue at the rest shape stretched by a factor, without contact:
    (batch,) [1/s²]."""
    cloth = system.cloth
    flat = torch.as_tensor(cloth.mesh.rest * stretch, dtype=cloth.dtype, device=cloth.device)
    position = torch.nn.functional.pad(flat, (0, 1)).unsqueeze(-1).repeat(1, 1, cloth.batch)
    at = membrane.LinearisedMembrane.at(cloth, position)
    largest = cloth.samples.reshape(len(cloth.samples), -1, 4).amax(1)[cloth.table_of]
    k0, k1, k2, k3 = (largest[:, i].expand_as(k) for i, k in enumerate(at.k))
    area = cloth.areas[:, None]
    g00, g11 = at.e.g00.clamp(min=0), at.e.g11.clamp(min=0)
    at = replace(
        at,
        k=(k0, k1, k2, k3),
        tension_u=(area * (k0 * g00 + k1 * g11)).unsqueeze(1),
        tension_v=(area * (k2 * g11 + k1 * g00)).unsqueeze(1),
    )
    folds = bending.LinearisedBending.at(cloth, position)
    bend = torch.tensor(
        [float(m.bending.max()) for m in cloth.materials], dtype=cloth.dtype, device=cloth.device
    )
    bend = bend if cloth.stiffening is None else bend * (1 + cloth.stiffening)
    folds = replace(folds, k=(cloth.hinge_shape[:, None] / 2 * bend).expand_as(folds.k))
    free = system.free

    def apply(field: Tensor) -> Tensor:
        product = gather_sum(at.corner_products(field), cloth.face_slots)
        if len(cloth.hinges):
            product = product + gather_sum(folds.corner_products(field), cloth.hinge_slots)
        if system.sprung:
            product = product.index_add(
                0, system.held, system.handles.stiffness * field[system.held]
            )
        for tie in system.ties:
            product = product + tie.stiffest(cloth).unsqueeze(1) * field
        return product / cloth.mass.unsqueeze(1) * free

    field = _start(position) * free
    value = torch.zeros_like(cloth.damping)
    for _ in range(_ITERATIONS):
        field = field / (field**2).sum((0, 1)).sqrt()
        field = apply(field)
        value = (field**2).sum((0, 1)).sqrt()
    return value * _DEFICIT


def stable_step(system: System) -> float:
    """Computes the largest step [s] at which leapfrog with lagged Kelvin–Voigt damping d is stable
    for the whole batch.

    The amplification matrix of one mode has determinant 1 − d ω² h and trace 2 − d ω² h − ω² h²;
    the Jury criterion gives ω² h² + 2 d ω² h < 4, that is h < −d + √(d² + 4/ω²).

    Raises:
        InputError: no positive, finite number is.
    """
    if system not in _LIMITS:
        with torch.no_grad():
            worst = float(stiffest(system).max())
        damping = float(system.cloth.damping.max())
        sound = 0 < worst < math.inf and damping < _LONGEST
        limit = -damping + math.sqrt(damping**2 + 4 / worst) if sound else math.nan
        if not 0 < limit < math.inf:
            raise InputError(
                f"no step is stable: the largest eigenvalue is {worst:.3g} 1/s², the damping "
                f"{damping:.3g} s",
                where="material",
                fix="give an area weight, stiffnesses and a damping that a cloth can have",
            )
        _LIMITS[system] = limit
    return _LIMITS[system]


def outer_limit(system: System, state: State, drive: Drive) -> float:
    """Estimates the longest outer step [s] of what the base model lacks, for the whole batch, at a
    state.

    With r and ω² the largest changes of its acceleration with velocity and with position, by power
    iteration on differences, it is the smaller of 0.5/r and 1/ω. Air's damping 2 ρ w/σ is included
    as far as it is not the base's. Members that have diverged do not count.
    """
    x, v = state.position, state.velocity
    inverse = system.free / system.cloth.mass.unsqueeze(1)

    def acceleration(position: Tensor, velocity: Tensor) -> Tensor:
        memory = system.remember_step(
            state.memory, drive.wind[0], state.time, position, velocity, elapsed=0.0
        )
        force = system.extra_force(drive, 0.0, state.time, position, velocity, memory=memory)
        return inverse * system.effective(position, force)

    # Small beside what moves, large beside rounding: differences are taken of forces that are
    # smooth on these scales.
    size = 1e-3 * float(system.cloth.areas.mean()) ** 0.5
    speed = 1e-2 * max(1.0, float(drive.wind[0].norm(dim=0).max()))
    with torch.no_grad():
        damped = _largest(
            lambda field: acceleration(x, v + field) - acceleration(x, v - field), x, speed
        )
        turned = _largest(
            lambda field: acceleration(x + field, v) - acceleration(x - field, v), x, size
        )
    return min(
        _DAMPED / damped if damped > 0 else math.inf,
        _TURNED / math.sqrt(turned) if turned > 0 else math.inf,
    )


def _largest(difference: Callable[[Tensor], Tensor], like: Tensor, size: float) -> float:
    """Estimates the largest factor of an operator, half of whose differences over ± a field of some
    size are given."""
    field = _start(like)
    value = torch.zeros_like(like[0, 0])
    for _ in range(_OUTER_ITERATIONS):
        field = (
            size * field / (field**2).amax((0, 1)).sqrt().clamp(min=torch.finfo(like.dtype).tiny)
        )
        before = (field**2).sum((0, 1)).sqrt()
        field = difference(field) / 2
        value = (field**2).sum((0, 1)).sqrt() / before.clamp(min=torch.finfo(like.dtype).tiny)
    return float(torch.where(torch.isfinite(value), value, 0.0).max())


def _start(like: Tensor) -> Tensor:
    """Makes a fixed field that has a part along every mode: no generator is needed, and results
    repeat."""
    index = torch.arange(like[..., 0].numel(), dtype=like.dtype, device=like.device)
    return torch.sin(index * index).reshape(-1, 3, 1).expand_as(like)
