"""Small systems for the simulator's tests, and workers of a scheduler."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
import torch

from sim.cloth import Cloth
from sim.cloth.air import AirForce, QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import Material, isotropic
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import upright
from sim.cloth.state import State
from sim.cloth.stiffness_tables import Evaluation
from sim.cloth.system import System
from sim.wind import UniformWind
from tests.clusters import Cluster

PLAIN = isotropic(name="plain", area_weight=0.2, stretching=50.0, shear=40.0, bending=1e-4)
"""Constant stiffness, no damping: its forces derive from an energy."""


@pytest.fixture
def distorted() -> Mesh:
    """A grid whose inner vertices are moved by up to a fifth of a cell."""
    mesh = grid(width=0.6, height=0.4, columns=6, rows=4)
    rest = mesh.rest.copy()
    inner = np.setdiff1d(np.arange(len(rest)), mesh.boundary)
    rest[inner] += 0.02 * np.sin(np.arange(2 * len(inner)).reshape(-1, 2) * 7.0)
    return Mesh(rest=rest, faces=mesh.faces)


def make_system(
    mesh: Mesh,
    materials: Sequence[Material],
    *,
    handles: Handles | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    air: AirForce | None = None,
    evaluation: Evaluation = Evaluation.ARCSIM,
    dtype: torch.dtype = torch.float64,
) -> tuple[System, State]:
    """A float64 system of any mesh and materials, held or free, without gravity and wind unless
    given."""
    batch = len(materials)
    cloth = Cloth.build(mesh, materials, evaluation=evaluation, dtype=dtype)
    held = handles or Handles(vertices=())
    position = torch.tensor(upright(mesh), dtype=dtype).unsqueeze(-1).repeat(1, 1, batch)
    vertices = torch.tensor(held.vertices, dtype=torch.int64)
    system = System(
        cloth=cloth,
        gravity=torch.tensor(gravity, dtype=dtype)[:, None].repeat(1, batch),
        wind=UniformWind(constant=torch.tensor(wind, dtype=dtype)[:, None].repeat(1, batch)),
        air=air or QuadraticNormal(),
        handles=held,
        held=vertices,
        anchors=position[vertices].clone(),
    )
    return system, State(position=position, velocity=torch.zeros_like(position))


@pytest.fixture
def doomed(tmp_path: Path) -> Iterator[Cluster]:
    """A cluster of one worker, to be killed."""
    (tmp_path / "dask").mkdir()
    running = Cluster(tmp_path / "dask", workers=1)
    try:
        yield running
    finally:
        running.close()
