"""Plates and sheets for which effects have closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sim.cloth.mesh import Mesh, grid
from sim.cloth.system import System
from sim.effects import Effect, apply


@pytest.fixture
def square() -> Mesh:
    """One square metre, six cells a side."""
    return grid(width=1.0, height=1.0, columns=6, rows=6)


@pytest.fixture
def inclined():
    """Positions of a flat mesh whose plane makes an angle with the x axis: (vertex, 3, 1)."""

    def make(mesh: Mesh, angle: float) -> torch.Tensor:
        u, v = mesh.rest.T
        return torch.tensor(np.stack([u * np.cos(angle), v, u * np.sin(angle)], axis=1))[..., None]

    return make


@pytest.fixture
def total_force():
    """The force on all the cloth in a wind, effects included: (3, batch) [N]."""

    def total(
        system: System, state, *effects: Effect, wind: tuple[float, float, float]
    ) -> torch.Tensor:
        system, state = apply(effects, system, state)
        air = torch.tensor(wind, dtype=torch.float64)[:, None]
        return system.external(air, 0.0, state.position, state.velocity, memory=state.memory).sum(0)

    return total
