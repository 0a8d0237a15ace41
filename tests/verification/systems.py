"""Systems for verification: any mesh and material, held or free, at rest or brought to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from sim.cloth import Cloth
from sim.cloth.air import AirForce, QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh
from sim.cloth.scene import upright
from sim.cloth.state import State
from sim.cloth.system import System
from sim.integrate import advance, stable_step
from sim.wind import UniformWind


def build(
    mesh: Mesh,
    materials: Sequence[Material],
    *,
    position: FloatArray | None = None,
    handles: Handles | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    air: AirForce | None = None,
) -> tuple[System, State]:
    """A float64 system: one member a material, at rest at `position` (the y–z plane unless
    given)."""
    batch = len(materials)
    held = handles or Handles(vertices=())
    start = upright(mesh) if position is None else position
    x = torch.tensor(start, dtype=torch.float64).unsqueeze(-1).repeat(1, 1, batch)
    vertices = torch.tensor(held.vertices, dtype=torch.int64)
    system = System(
        cloth=Cloth.build(mesh, materials, dtype=torch.float64),
        gravity=torch.tensor(gravity, dtype=torch.float64)[:, None].repeat(1, batch),
        wind=UniformWind(constant=torch.zeros((3, batch), dtype=torch.float64)),
        air=air or QuadraticNormal(density=0.0),
        handles=held,
        held=vertices,
        anchors=x[vertices].clone(),
    )
    return system, State(position=x, velocity=torch.zeros_like(x))


def settle(
    system: System, state: State, *, block: float = 5e-3, blocks: int = 3000, rest: float = 1e-6
) -> State:
    """Dynamic relaxation: run, and stop all motion whenever a member's kinetic energy has passed
    its peak.

    At rest: each member has had three blocks of 5 ms in a row that end with no vertex faster than
    `rest`, so that its accelerations are below rest/5 ms.

    Raises:
        AssertionError: it did not come to rest.
    """
    steps = int(np.ceil(block / (0.5 * stable_step(system))))
    before = torch.zeros(system.cloth.batch, dtype=torch.float64)
    quiet = torch.zeros(system.cloth.batch)
    for _ in range(blocks):
        state = advance(system, state, block, steps=steps)
        slow = state.velocity.abs().amax((0, 1)) < rest
        quiet = torch.where(quiet < 3, torch.where(slow, quiet + 1, 0.0), quiet)
        if bool((quiet >= 3).all()):
            return state
        kinetic = (system.cloth.mass * (state.velocity**2).sum(1)).sum(0) / 2
        falling = kinetic < before
        state = replace(state, velocity=torch.where(falling, 0.0, state.velocity))
        before = torch.where(falling, 0.0, kinetic)
    raise AssertionError("the cloth did not come to rest")
