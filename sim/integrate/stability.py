"""The largest stable step of an explicit method, from the stiffest vibration of the cloth."""

from __future__ import annotations

import math
from dataclasses import replace
from weakref import WeakKeyDictionary

import torch
from torch import Tensor

from sim import bending, membrane
from sim.cloth import gather_sum
from sim.system import System

_ITERATIONS = 80
# Power iteration approaches from below; after 80 steps the deficit on such meshes is under 5 %.
_DEFICIT = 1.05
# Strain the stiffness is taken at: faces rarely exceed it where strain is not limited.
_STRETCH = 1.15

_LIMITS: WeakKeyDictionary[System, float] = WeakKeyDictionary()


def stiffest(system: System) -> Tensor:
    """An upper estimate of the largest eigenvalue ω² of M⁻¹K: (batch,) [1/s²].

    Taken at the rest shape stretched by 15 %, with the largest entries of every table, handle springs and contact
    included.
    """
    cloth = system.cloth
    flat = torch.as_tensor(cloth.mesh.rest * _STRETCH, dtype=cloth.dtype, device=cloth.device)
    position = torch.nn.functional.pad(flat, (0, 1)).unsqueeze(-1).repeat(1, 1, cloth.batch)
    at = membrane.Linearised.at(cloth, position)
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
    folds = bending.Linearised.at(cloth, position)
    bend = torch.tensor([float(m.bending.max()) for m in cloth.materials], dtype=cloth.dtype, device=cloth.device)
    bend = bend if cloth.stiffening is None else bend * (1 + cloth.stiffening)
    folds = replace(folds, k=(cloth.hinge_shape[:, None] / 2 * bend).expand_as(folds.k))
    free = _free(system)

    def apply(field: Tensor) -> Tensor:
        product = gather_sum(at.corner_products(field), cloth.face_slots)
        if len(cloth.hinges):
            product = product + gather_sum(folds.corner_products(field), cloth.hinge_slots)
        if system.sprung:
            product = product.index_add(0, system.held, system.handles.stiffness * field[system.held])
        for tie in system.ties:
            product = product + tie.stiffest(cloth).unsqueeze(1) * field
        return product / cloth.mass.unsqueeze(1) * free

    # A fixed start that has a part along every mode: no generator is needed, and results repeat.
    index = torch.arange(position[..., 0].numel(), dtype=cloth.dtype, device=cloth.device)
    field = torch.sin(index * index).reshape(-1, 3, 1).expand_as(position) * free
    value = torch.zeros_like(cloth.damping)
    for _ in range(_ITERATIONS):
        field = field / (field**2).sum((0, 1)).sqrt()
        field = apply(field)
        value = (field**2).sum((0, 1)).sqrt()
    value = value * _DEFICIT
    if system.contact is not None:
        # The repulsion's stiffness k a v/h at a violation of half the thickness, on a vertex of mass ρ a. Layers at
        # rest on one another stay further apart; the step's safety covers the rest.
        value = value + system.contact.stiffness / 2 * torch.tensor([1 / m.density for m in cloth.materials]).to(value)
    return value


def stable_step(system: System) -> float:
    """The largest step [s] at which leapfrog with lagged Kelvin–Voigt damping d is stable for the whole batch.

    The amplification matrix of one mode has determinant 1 − d ω² h and trace 2 − d ω² h − ω² h²; the Jury criterion
    gives ω² h² + 2 d ω² h < 4, that is h < −d + √(d² + 4/ω²).
    """
    if system not in _LIMITS:
        with torch.no_grad():
            worst = float(stiffest(system).max())
        damping = float(system.cloth.damping.max())
        _LIMITS[system] = -damping + math.sqrt(damping**2 + 4 / worst)
    return _LIMITS[system]


def _free(system: System) -> Tensor:
    """(vertex, 1, 1): 0 for rigidly held vertices, 1 for all others."""
    cloth = system.cloth
    free = torch.ones((cloth.mesh.vertex_count, 1, 1), dtype=cloth.dtype, device=cloth.device)
    if system.clamped:
        free[system.held] = 0
    return free
