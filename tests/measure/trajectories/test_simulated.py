"""What was simulated here is observed with the scene it was simulated with, without its effects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.lake import Lake
from measure.trajectories import observe
from measure.trajectories.mesh_observations import from_artifact
from sim.run import parse, simulate

RECIPE = """
seed = 3
[scene]
shape = "flag"
columns = 12
start-noise = 0.01
[material]
name = "camel-ponte-roma"
area-weight = 0.2
[wind]
speed = 5.0
toward = 0.3
density = 1.2
[time]
settle = 1.0
frames = 60
[effects.internal-damping]
time = 0.0004
"""


def test_a_simulated_flag_is_observed_with_its_own_scene(tmp_path: Path):
    lake = Lake.create(tmp_path / "lake")
    recipe = parse(RECIPE, name="flag", folder=tmp_path, where="recipe")
    (added,) = simulate(lake, recipe).added
    observed = observe([from_artifact(lake, lake.artifact(added))])
    specimen, (recording,) = observed.experiment.specimen, observed.experiment.recordings
    assert recording.source == added
    assert (specimen.material.area_weight, specimen.air.plain.density) == (0.2, 1.2)
    np.testing.assert_allclose(specimen.mesh.rest[list(specimen.held)], [[0, 0], [0, 1]], atol=1e-6)
    np.testing.assert_allclose(recording.wind.velocity, [[5 * np.cos(0.3), 5 * np.sin(0.3), 0]])
    assert recording.rate == pytest.approx(25.0)
    assert not [f for f in observed.findings if f.severity != "note"]
