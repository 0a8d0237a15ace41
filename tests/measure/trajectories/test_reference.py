"""ArcSim's own runs, read and checked: in order as they are, refused when something is made
wrong."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest import read_folder
from measure.trajectories import (
    Hold,
    Observation,
    Setup,
    WindTrack,
    from_arrays,
    from_folder,
    observe,
    sample,
)
from measure.trajectories.describing import of_arcsim
from sim.cloth.mesh import grid

pytestmark = pytest.mark.reference


def run(reference_data: Path, name: str, frames: slice = slice(50, 150)) -> Observation:
    with np.load(reference_data / "arcsim" / f"flag_{name}.npz") as stored:
        known, _ = of_arcsim(
            json.loads(str(stored["scene"])), stored["rest"].astype(np.float64), where=name
        )
        return from_arrays(
            name=name,
            positions=stored["positions"][frames],
            rest=stored["rest"],
            faces=stored["faces"],
            rate=25.0,
            description=known,
        )


@pytest.mark.parametrize("name", ["w4_dt5", "w8_dt5", "w4_dt05"])
def test_a_run_in_order_gives_its_scene_and_no_warning(reference_data: Path, name: str):
    observed = observe([run(reference_data, name, slice(0, 100))])
    specimen, (recording,) = observed.experiment.specimen, observed.experiment.recordings
    assert observed.findings == ()
    assert specimen.material.name == "camel-ponte-roma"
    np.testing.assert_allclose(np.ptp(specimen.mesh.rest, axis=0), [1.5, 1.0], atol=1e-6)
    # Held at (0, 0, 0) and (0, 0, 1) by springs of 1 kN/m, which give by millimetres.
    np.testing.assert_allclose(specimen.anchors, [[0, 0, 0], [0, 0, 1]], atol=8e-3)
    assert recording.wind.speed == float(name[1])
    assert (
        recording.noise < 1.5e-3
    )  # none was added: what is left is motion too quick for 25 frames a second


@pytest.mark.parametrize("name", ["w0_dt05", "w4_dt5", "w8_dt5"])
def test_a_millimetre_of_noise_is_found_within_a_third_and_four_within_a_tenth(
    reference_data: Path, name: str
):
    seen = run(reference_data, name)
    setup = Setup(outline=seen.outline)
    for sigma, share in ((1e-3, 0.35), (4e-3, 0.1)):
        noise = sigma * np.random.default_rng(0).standard_normal(seen.positions.shape)
        (recording,) = observe(
            [replace(seen, positions=seen.positions + noise)], setup
        ).experiment.recordings
        assert recording.noise == pytest.approx(sigma, rel=share)


def test_an_output_folder_is_an_experiment(reference_data: Path):
    observed = observe([from_folder(reference_data / "arcsim" / "raw_fixed_mesh")])
    (recording,) = observed.experiment.recordings
    assert recording.positions.shape == (51, 117, 3)
    assert recording.wind.velocity.tolist() == [[5, 0, 0]]
    assert {f.kind for f in observed.findings} == {"simulated-with-numerical-damping"}


def test_half_a_second_of_a_remeshed_run_is_followed_but_too_short(reference_data: Path):
    seen = from_folder(reference_data / "arcsim" / "raw_remeshed")
    assert seen.known.material is not None
    assert seen.known.material.area_weight == pytest.approx(2 * 0.284)
    assert seen.known.pins is not None
    np.testing.assert_allclose(seen.known.pins, [[0, 0], [0, 2]], atol=1e-12)
    with pytest.raises(InputError, match=r"13 frames over 0\.48 s"):
        observe([seen])


def test_points_of_a_remeshed_run_keep_their_distances(reference_data: Path):
    sequence = read_folder(reference_data / "arcsim" / "raw_remeshed")
    mesh = grid(width=3.0, height=2.0, columns=15, rows=10)
    positions = sample(sequence, mesh.rest)
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]]])
    length = np.linalg.norm(np.diff(positions[:, edges], axis=2)[:, :, 0], axis=2)
    rest = np.linalg.norm(np.diff(mesh.rest[edges], axis=1)[:, 0], axis=1)
    # The scene limits strain to ±5 %, wherever its own meshes are fine enough for the limit to hold
    # along an edge.
    assert 0.95 <= np.median(length / rest) <= 1.05
    assert np.quantile(length / rest, 0.99) <= 1.1


@pytest.mark.parametrize("name", ["w4_dt5", "w8_dt5"])
def test_wrong_pins_wind_and_scale_of_real_runs_are_refused(reference_data: Path, name: str):
    seen = run(reference_data, name)
    for pins in (Hold.TOP_CORNERS, Hold.HOIST, ((0.0, 0.0), (0.0, 0.5))):
        with pytest.raises(InputError, match="not held there"):
            observe([seen], Setup(pins=pins))
    with pytest.raises(InputError, match="streams upwind"):
        observe([replace(seen, wind=WindTrack.constant((-5.0, 0.0, 0.0)))])
    with pytest.raises(InputError, match="mm for cm"):
        observe([replace(seen, positions=10.0 * seen.positions)])


def misfits(seen: Observation) -> bool:
    """Whether a recording is refused, or reported as one that inertia does not fit."""
    try:
        observed = observe([seen])
    except InputError:
        return True
    return "inertia-does-not-fit" in {finding.kind for finding in observed.findings}


@pytest.mark.parametrize("name", ["w4_dt5", "w8_dt5", "w4_dt05"])
def test_a_rate_off_by_two_and_a_wind_in_another_unit_do_not_pass(reference_data: Path, name: str):
    seen = run(
        reference_data, name, slice(20, 140)
    )  # twice as fast they are as long as a recording must be
    speed = float(name[1])
    assert not misfits(seen)
    for rate in (2.0, 0.5):
        assert misfits(replace(seen, times=seen.times / rate))
    for factor in (3.6, 1 / 3.6):
        assert misfits(replace(seen, wind=WindTrack.constant((factor * speed, 0.0, 0.0))))


def test_in_calm_air_a_rate_off_by_two_shows_while_the_cloth_swings(reference_data: Path):
    """Released from flat, the reference run swings for its first seconds."""
    seen = run(reference_data, "w0_dt05", slice(0, 110))
    assert not misfits(seen)
    assert misfits(replace(seen, times=seen.times / 2))
    assert misfits(replace(seen, times=seen.times * 2))
