"""Cusick's drape test: a disc of cloth clamped between a pedestal and a plate, its border hanging
freely.

The cloth on the pedestal does not move. What hangs over comes to rest by dynamic relaxation (Day
1965; Otter, Cassell and Hobbs 1966): steps of backward Euler without air, in which every member's
velocities are set to zero whenever its kinetic energy falls. The pedestal is a solid cylinder:
after every step what hangs below its top is moved out to its side. Layers of cloth do not touch
each other.

Rest depends on stiffness over weight alone. Which of several resting shapes is found depends on the
start, so that a drape has a random start, as a specimen laid on by hand has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh
from sim.cloth.scene import Scene, roughen_start
from sim.cloth.state import State
from sim.cloth.system import System
from sim.integrate.implicit import BackwardEuler

PEDESTAL = 0.09
"""Radius of the pedestal [m] (BS 5058, ISO 9073-9)."""
_STEP = 0.01
"""Of backward Euler [s]."""
DISC = 0.15
"""Radius of the cloth [m], the medium one of the three that the standards have."""


def disc(
    rng: np.random.Generator, *, radius: float = DISC, pedestal: float = PEDESTAL, rows: int = 7
) -> Mesh:
    """Makes a disc of nearly equilateral triangles, in rings turned against each other at random,
    so that no direction is preferred.

    The pedestal's edge lies midway between two rings. What lies inside is held, and a hinge between
    held and free triangles bends half of its width alone, so that this is where the cloth is
    clamped, to second order in the width.

    Args:
        rng: of the rings' turns.
        radius, pedestal: [m].
        rows: of triangles from the edge outwards, beside half of one; vertices on the pedestal are
            farther apart.

    Raises:
        InputError: no border that could hang over, or less than three rows.
    """
    if not 0 < pedestal < radius:
        raise InputError(
            f"a pedestal of {pedestal} m is under a cloth of {radius} m",
            where="drape",
            fix="give a pedestal smaller than the cloth",
        )
    if rows < 3:
        raise InputError(
            f"a border of {rows} rows of triangles", where="drape", fix="give at least 3"
        )
    from scipy.spatial import Delaunay

    height = (radius - pedestal) / (rows + 0.5)
    side = 2 * height / math.sqrt(3)
    radii = pedestal + height * (np.arange(rows + 2) - 0.5)
    widths = [3 * side, *[side] * (rows + 2)]
    points = [np.zeros((1, 2))]
    for ring, width in zip([radii[0] / 2, *radii], widths, strict=True):
        count = round(2 * math.pi * ring / width)
        angle = rng.uniform(0, 2 * math.pi) + 2 * math.pi * np.arange(count) / count
        points.append(ring * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    rest = np.concatenate(points)
    return Mesh(
        rest=rest, faces=Delaunay(rest).simplices.astype(np.int64)
    )  # in two dimensions counter-clockwise


def on_pedestal(mesh: Mesh, pedestal: float = PEDESTAL) -> tuple[int, ...]:
    """Lists the vertices that are clamped: those on the pedestal, and the ring half a row outside
    of it."""
    radius = np.hypot(mesh.rest[:, 0], mesh.rest[:, 1])
    rings = np.unique(radius[radius > pedestal].round(9))
    return tuple(np.flatnonzero(radius <= rings[0] + 1e-8).tolist())


def drape_scene(
    mesh: Mesh,
    material: Material,
    rng: np.random.Generator,
    *,
    pedestal: float = PEDESTAL,
    sigma: float = 1e-3,
) -> Scene:
    """Makes the scene of one drape: the cloth flat on its pedestal, with normal noise of `sigma`
    [m] on its border."""
    handles = Handles(vertices=on_pedestal(mesh, pedestal), stiffness=math.inf)
    flat = np.concatenate([mesh.rest, np.zeros((mesh.vertex_count, 1))], axis=1)
    return Scene(
        mesh=mesh,
        position=roughen_start(flat, handles, rng, sigma),
        material=material,
        handles=handles,
        air=QuadraticNormal(density=0.0),
    )


def at_rest(
    system: System,
    state: State,
    *,
    pedestal: float = PEDESTAL,
    limit: float = 1.2,
    advance: Callable[[int], object] | None = None,
) -> State:
    """Lets a batch come to rest on its pedestal.

    Args:
        pedestal: its radius [m].
        limit: time that is simulated [s]. Within 0.8 s drapes of 0.06 m over the edge have come to
            rest.
        advance: called with 1 after each step.

    Returns:
        The last state, with the velocities of it: what still moves shows in them.
    """
    integrator = BackwardEuler(step=_STEP, tolerance=1e-2)
    energy = torch.zeros_like(system.cloth.damping)
    with torch.no_grad():
        for _ in range(round(limit / _STEP)):
            state = _beside(integrator.advance(system, state, _STEP), pedestal, system.free)
            last, energy = energy, (system.cloth.mass.unsqueeze(1) * state.velocity**2).sum((0, 1))
            falls = energy < last
            state = replace(state, velocity=torch.where(falls, 0.0, state.velocity))
            energy = torch.where(falls, 0.0, energy)
            if advance is not None:
                advance(1)
    return state


def _beside(state: State, pedestal: float, free: Tensor) -> State:
    """Moves what is below the pedestal's top and within its radius out to its side, and stops its
    approach."""
    across = state.position[:, :2]
    radius = across.norm(dim=1, keepdim=True)
    inside = (free > 0) & (state.position[:, 2:] < 0) & (radius < pedestal)
    if not bool(inside.any()):
        return state
    outward = across / radius.clamp(min=1e-9)
    approach = (state.velocity[:, :2] * outward).sum(1, keepdim=True).clamp(max=0.0)
    position, velocity = state.position.clone(), state.velocity.clone()
    position[:, :2] = torch.where(inside, pedestal * outward, across)
    velocity[:, :2] -= torch.where(inside, approach * outward, 0.0)
    return replace(state, position=position, velocity=velocity)
