"""A cloth small enough for every test."""

from __future__ import annotations

import numpy as np
import pytest

from measure.observe.trajectory import Specimen
from sim import handles
from sim.material import named
from sim.mesh import grid


@pytest.fixture(scope="session")
def specimen() -> Specimen:
    """0.75 m × 0.5 m of a knit on 9 × 7 vertices, held at the corners of its hoist."""
    mesh = grid(width=0.75, height=0.5, columns=8, rows=6)
    return Specimen(
        mesh=mesh, material=named("camel-ponte-roma"), held=handles.corners(mesh.rest),
        anchors=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]),
    )  # fmt: skip
