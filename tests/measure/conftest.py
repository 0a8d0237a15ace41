"""A small flag and its recordings, cheap enough for every test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from measure.forecasting import Calibration, Forecaster, Segments
from measure.trajectories import Specimen, Trajectory, WindTrack
from sim.cloth import handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.integrate import SplitEuler

RATE = 25.0


@pytest.fixture(scope="session")
def specimen() -> Specimen:
    """0.75 m × 0.5 m of a knit on 9 × 7 vertices, held at the corners of its hoist."""
    mesh = grid(width=0.75, height=0.5, columns=8, rows=6)
    return Specimen(
        mesh=mesh,
        material=named_material("camel-ponte-roma"),
        held=handles.corners(mesh.rest),
        anchors=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]),
    )


@pytest.fixture(scope="session")
def forecaster(specimen: Specimen) -> Forecaster:
    return Forecaster(
        specimen=specimen, markers=specimen.mesh.rest, integrator=SplitEuler(), dtype=torch.float64
    )


@pytest.fixture(scope="session")
def own_recording(specimen: Specimen, forecaster: Forecaster) -> Trajectory:
    """2.6 s at 4 m/s of the fit's own model, mesh and steps, after 2 s."""
    still = Trajectory(
        name="still",
        markers=specimen.mesh.rest,
        positions=np.zeros((60, specimen.mesh.vertex_count, 3)),
        rate=RATE,
        wind=WindTrack.constant((4.0, 0.0, 0.0)),
    )
    system, state = forecaster.system(Segments.of([still]).select([0]), [Calibration()])
    bulge = 0.02 * np.sin(7 * specimen.mesh.rest[:, 0]) * np.cos(5 * specimen.mesh.rest[:, 1])
    bent = state.position.clone()
    bent[:, 1, 0] += torch.as_tensor(bulge)
    state, frames = replace(state, position=bent), []
    for frame in range(115):
        # The wind is the same all the time, so that the time of the segment does not matter.
        state = replace(forecaster.integrator.advance(system, replace(state, time=0.0), 1 / RATE))
        if frame >= 50:
            frames.append(state.position[..., 0].numpy().copy())
    return replace(still, name="own", positions=np.stack(frames))
