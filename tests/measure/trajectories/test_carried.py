"""Cloths whose attachments move: what is read of them, and predictions from one frame to the
next."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from measure.forecasting import Calibration, Forecaster, Segments, align_experiment, columns
from measure.trajectories import (
    Experiment,
    Hold,
    Observation,
    Setup,
    WindTrack,
    from_arrays,
    observe,
    parse,
    sheet,
)
from sim.cloth import handles
from sim.cloth.anchors import AnchorTracks
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import Diagonals, grid
from sim.cloth.scene import Scene, assemble, upright
from sim.integrate import BackwardEuler, SplitEuler

SIZE, RATE, SECONDS = 0.4, 25.0, 4.0
SETUP = Setup(
    outline=sheet(SIZE, SIZE),
    material=named_material("camel-ponte-roma"),
    pins=Hold.TOP_CORNERS,
    carried=True,
    vertices=64,
)


@pytest.fixture(scope="module")
def swung() -> Observation:
    """A cloth whose corners go to and fro by 0.1 m, by another mesh and shorter steps than the
    fit's."""
    mesh = grid(width=SIZE, height=SIZE, columns=12, rows=12, diagonals=Diagonals.FORWARD)
    held = Handles(vertices=handles.top_corners(mesh.rest), stiffness=float("inf"))
    material = replace(named_material("camel-ponte-roma"), damping=2.5e-3)
    system, state = assemble(
        [Scene(mesh=mesh, position=upright(mesh), material=material, handles=held)]
    )
    times = np.arange(round(SECONDS * RATE) + 1) / RATE
    away = np.zeros((len(times), 2, 3, 1))
    away[:, :, 1, 0] = 0.1 * np.sin(2 * np.pi * 0.8 * times)[:, None]
    away[:, 1, 0, 0] = 0.01 * np.sin(2 * np.pi * 1.3 * times)
    tracks = AnchorTracks(
        start=0.0, period=1 / RATE, samples=torch.as_tensor(away, dtype=state.position.dtype)
    )
    system, frames = replace(system, motion=tracks), []
    for _ in times[:-1]:
        frames.append(state.position[..., 0].double().numpy())
        state = BackwardEuler(step=2e-3, tolerance=1e-5).advance(system, state, 1 / RATE)
    wind = WindTrack.constant((0.0, 0.0, 0.0))
    seen = np.flatnonzero((np.rint(mesh.rest / SIZE * 12) % 2 == 0).all(axis=1))
    return from_arrays(
        name="swung",
        positions=np.array(frames)[:, seen],
        rest=mesh.rest[seen],
        rate=RATE,
        wind=wind,
        noise=1e-4,
    )


def _errors(experiment: Experiment) -> float:
    """Root mean square distance of predictions one frame ahead [m]."""
    segments = Segments.of(experiment.recordings)
    forecaster = Forecaster(
        specimen=experiment.specimen, markers=segments.markers, integrator=SplitEuler()
    )
    found = forecaster.errors(
        *forecaster.system(segments, [Calibration()] * len(segments)), segments
    )
    return float((found**2).sum(dim=2).mean().sqrt())


def test_attachments_that_are_carried_go_where_the_markers_at_the_pins_go(
    swung: Observation,
) -> None:
    experiment = observe([swung], SETUP).experiment
    recording = experiment.recordings[0]
    left, right = handles.top_corners(swung.markers)
    assert recording.attachments is not None
    np.testing.assert_allclose(recording.attachments, swung.positions[:, [left, right]], atol=1e-9)
    assert np.isinf(experiment.specimen.stiffness)


def test_predictions_follow_attachments_that_move(swung: Observation) -> None:
    experiment = observe([swung], SETUP).experiment
    still = replace(
        experiment, recordings=tuple(replace(r, attachments=None) for r in experiment.recordings)
    )
    # With the tracks what is left is numerics; without them the corners are pulled back by up to
    # 0.1 m.
    assert _errors(experiment) < 0.25 * _errors(still)
    assert _errors(align_experiment(experiment)) == pytest.approx(_errors(experiment), rel=0.02)


def test_pins_that_move_without_being_declared_are_refused(swung: Observation) -> None:
    with pytest.raises(InputError, match="not held there"):
        observe([swung], replace(SETUP, carried=False))


def test_what_a_carried_cloth_cannot_have_moves_no_prediction(swung: Observation) -> None:
    """Ties to anchors that the ways do not take along, and a pole that there is none of."""
    experiment = observe([swung], SETUP).experiment
    segments = Segments.of(experiment.recordings)
    forecaster = Forecaster(
        specimen=experiment.specimen, markers=segments.markers, integrator=SplitEuler()
    )
    starts = [Calibration()] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, starts), segments)
    sought = ("full-hoist.stiffness", "tilted-pole.lean", "tilted-pole.sway", "air-density.change")
    chosen = [one for one in columns() if one.name in sought]
    moved = [bool(forecaster.sensitivity(one, segments, starts, base).any()) for one in chosen]
    assert dict(zip((one.name for one in chosen), moved, strict=True)) == {
        "air-density.change": True,
        "full-hoist.stiffness": False,
        "tilted-pole.lean": False,
        "tilted-pole.sway": False,
    }


def test_recordings_agree_on_whether_the_cloth_is_carried(swung: Observation) -> None:
    experiment = observe([swung], SETUP).experiment
    other = replace(experiment.recordings[0], name="still", attachments=None)
    with pytest.raises(InputError, match="some recordings have attachments"):
        replace(experiment, recordings=(*experiment.recordings, other))
    with pytest.raises(InputError, match="attachments have the shape"):
        replace(experiment.recordings[0], attachments=np.zeros((3, 2, 3)))


def test_a_recipe_says_that_pins_are_carried(tmp_path: Path) -> None:
    path = tmp_path / "cloth.toml"
    path.write_text('[attachment]\nat = "top-corners"\ncarried = true\n', encoding="utf-8")
    assert parse(path).setup.carried
    path.write_text("[attachment]\ncarried = true\nstiffness = 100\n", encoding="utf-8")
    with pytest.raises(UsageError, match="hold rigidly"):
        parse(path)
