"""One frame for all recordings: wind along +x, pole base at the origin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.forecasting import align_experiment
from measure.trajectories import Experiment, Specimen, Trajectory, WindTrack


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Counter-clockwise about z."""
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def experiment(specimen: Specimen, angle: float, shift: np.ndarray) -> Experiment:
    rng = np.random.default_rng(1)
    positions = rng.normal(size=(60, len(specimen.mesh.rest), 3))
    recording = Trajectory(
        name="a",
        markers=specimen.mesh.rest,
        positions=turned(positions, angle) + shift,
        rate=25.0,
        wind=WindTrack(times=np.zeros(1), velocity=turned(np.array([[4.0, 0.0, 0.0]]), angle)),
    )
    moved = replace(specimen, anchors=turned(specimen.anchors, angle) + shift)
    return Experiment(specimen=moved, recordings=(recording,))


@pytest.mark.parametrize("angle", [0.3, -2.0, 3.0])
def test_the_frame_does_not_depend_on_where_north_and_the_pole_were(
    specimen: Specimen, angle: float
) -> None:
    plain = align_experiment(experiment(specimen, 0.0, np.zeros(3)))
    moved = align_experiment(experiment(specimen, angle, np.array([5.0, -2.0, 1.5])))
    np.testing.assert_allclose(
        moved.recordings[0].positions, plain.recordings[0].positions, atol=1e-12
    )
    np.testing.assert_allclose(moved.recordings[0].wind.velocity, [[4.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(moved.specimen.anchors, [[0, 0, 0], [0, 0, 0.5]], atol=1e-12)


def test_heights_are_left_as_they_are(specimen: Specimen) -> None:
    given = experiment(specimen, 1.0, np.array([0.0, 0.0, 7.0]))
    np.testing.assert_allclose(
        align_experiment(given).recordings[0].positions[..., 2],
        given.recordings[0].positions[..., 2] - 7.0,
        atol=1e-12,
    )


def test_in_calm_the_flag_says_where_it_hangs(specimen: Specimen) -> None:
    given = experiment(specimen, 0.0, np.zeros(3))
    hanging = np.tile(np.array([0.0, 0.2, 0.1]), (60, len(specimen.mesh.rest), 1))
    calm = replace(given.recordings[0], positions=hanging, wind=WindTrack.constant((0.0, 0.0, 0.0)))
    result = align_experiment(Experiment(specimen=given.specimen, recordings=(calm,)))
    np.testing.assert_allclose(
        result.recordings[0].positions.mean(axis=(0, 1)), [0.2, 0.0, 0.1], atol=1e-12
    )


def test_gravity_that_is_not_down_is_refused(specimen: Specimen) -> None:
    given = experiment(specimen, 0.0, np.zeros(3))
    sideways = replace(given.specimen, gravity=(0.0, 9.81, 0.0))
    with pytest.raises(InputError, match="gravity"):
        align_experiment(Experiment(specimen=sideways, recordings=given.recordings))
