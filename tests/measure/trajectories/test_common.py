"""Recordings of one cloth on different meshes are followed at the same points, or refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.forecasting import Segments
from measure.trajectories import Known, Observation, observe
from tests.measure.trajectories.flags import RATE, SETUP, WIND, flutter, markers

FEW = replace(SETUP, vertices=40)


def on_mesh(columns: int, rows: int, name: str, noise: float = 0.0) -> Observation:
    rest, times = markers(columns, rows), np.arange(round(4 * RATE)) / RATE
    positions = flutter(rest, times)
    positions = positions + noise * np.random.default_rng(len(rest)).standard_normal(
        positions.shape
    )
    return Observation(
        name=name,
        markers=rest,
        positions=positions,
        times=times,
        known=Known(wind=WIND),
        noise=noise,
    )


def test_meshes_that_differ_are_followed_at_the_same_points() -> None:
    observed = observe([on_mesh(15, 10, "coarse"), on_mesh(24, 16, "fine")], FEW)
    first, second = observed.experiment.recordings
    np.testing.assert_array_equal(first.markers, second.markers)
    assert len(first.markers) == observed.experiment.specimen.mesh.vertex_count
    for recording in (first, second):
        # The truth at those points; between markers 80 mm apart a spline misses a wave of 1.1 m by
        # less than 1 mm.
        np.testing.assert_allclose(
            recording.positions, flutter(recording.markers, recording.times), atol=1e-3
        )
    assert [f.kind for f in observed.findings].count("markers-resampled") == 2
    assert len(Segments.of([first, second])) > 2


def test_the_noise_of_points_is_that_of_weighted_markers() -> None:
    observed = observe([on_mesh(15, 10, "coarse", 1e-3), on_mesh(24, 16, "fine", 1e-3)], FEW)
    for recording in observed.experiment.recordings:
        error = recording.positions - flutter(recording.markers, recording.times)
        assert recording.noise == pytest.approx(float(error.std()), rel=0.1)


def test_meshes_that_differ_by_rounding_are_the_same() -> None:
    one, two = on_mesh(15, 10, "one"), on_mesh(15, 10, "two")
    rounded = replace(two, markers=two.markers.astype(np.float32).astype(np.float64))
    observed = observe([one, rounded], FEW)
    assert not [f for f in observed.findings if f.kind == "markers-resampled"]
    first, second = observed.experiment.recordings
    np.testing.assert_array_equal(first.markers, second.markers)
    assert len(first.markers) == len(one.markers)


def test_too_few_markers_for_other_points_are_refused() -> None:
    with pytest.raises(InputError, match="54 markers are not those of the other recordings"):
        observe([on_mesh(24, 16, "fine"), on_mesh(8, 5, "sparse")], FEW)
