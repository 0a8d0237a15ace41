"""Markers that were not tracked are masked and never compared; rates and gaps are of seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.arrays import BoolArray
from flagdata.errors import InputError
from measure.trajectories import Known, Observation, Trajectory, observe
from measure.trajectories.common import at_same_rate
from measure.trajectories.gaps import LONGEST, fill_positions, frames_of
from tests.measure.trajectories.flags import SETUP, WIND, flutter, markers

FEW = replace(SETUP, vertices=40)
REST = markers(12, 8)


def recording(
    name: str, *, rate: float = 25.0, seconds: float = 4.2, share: float = 0.0, seed: int = 0
) -> Observation:
    times = np.arange(round(seconds * rate)) / rate
    positions = flutter(REST, times)
    positions[lost(positions.shape[:2], share, seed)] = np.nan
    return Observation(
        name=name,
        markers=REST,
        positions=positions,
        times=times,
        known=Known(wind=WIND),
        noise=1e-3,
    )


def lost(shape: tuple[int, ...], share: float, seed: int) -> BoolArray:
    return np.random.default_rng(seed).random(shape) < share


@pytest.mark.parametrize("share", [0.01, 0.05, 0.2])
def test_markers_missing_at_random_are_used_in_all_recordings(share: float) -> None:
    observed = observe(
        [recording("one", share=share, seed=1), recording("two", share=share, seed=2)], FEW
    )
    for own in observed.experiment.recordings:
        assert len(own.markers) == len(REST)
        assert own.seen is not None
        assert 1 - own.seen.mean() == pytest.approx(share, rel=0.3)


def test_what_is_filled_in_is_near_where_the_marker_was() -> None:
    times = np.arange(105) / 25.0
    truth = flutter(REST, times)
    positions, gone = truth.copy(), np.zeros(truth.shape[:2], dtype=bool)
    for marker, begin, length in ((40, 30, 3), (55, 20, 25), (70, 0, 12), (80, 90, 15)):
        gone[begin : begin + length, marker] = True
    positions[gone] = np.nan
    filled = fill_positions(positions, REST, period=0.04, where="here")
    assert filled.seen is not None
    np.testing.assert_array_equal(filled.seen, ~gone)
    np.testing.assert_array_equal(filled.positions[~gone], truth[~gone])
    # Markers 0.13 m apart on waves of a metre: a quadratic map of its neighbours is off by
    # centimetres at most.
    assert np.linalg.norm(filled.positions[gone] - truth[gone], axis=1).max() < 0.03


def test_a_marker_that_hardly_moves_is_held_through_a_long_gap() -> None:
    times = np.arange(105) / 25.0
    truth = flutter(REST, times)
    still = 55  # held amid others that swing
    truth[:, still] = truth[0, still] + 1e-3 * np.random.default_rng(3).standard_normal(
        (len(times), 3)
    )
    positions = truth.copy()
    positions[20:35, still] = np.nan
    positions[95:, still] = np.nan
    filled = fill_positions(positions, REST, period=0.04, where="here")
    assert np.ptp(truth[:, [54, 56]], axis=0).max() > 0.1
    assert np.linalg.norm(filled.positions[:, still] - truth[:, still], axis=1).max() < 8e-3


def test_a_long_gap_that_ends_among_hardly_a_marker_is_filled_all_the_same() -> None:
    times = np.arange(105) / 25.0
    truth = flutter(REST, times)
    positions = truth.copy()
    positions[20:35, 40] = np.nan
    positions[[19, 35], 8:40] = np.nan
    positions[[19, 35], 41:] = np.nan
    filled = fill_positions(positions, REST, period=0.04, where="here")
    assert np.isfinite(filled.positions).all()
    np.testing.assert_array_equal(
        filled.positions[np.isfinite(positions)], truth[np.isfinite(positions)]
    )


@pytest.mark.parametrize(("rate", "frames"), [(10.0, 1), (25.0, 3), (100.0, 12), (500.0, 60)])
def test_the_longest_gap_that_a_markers_own_motion_fills_is_of_seconds(
    rate: float, frames: int
) -> None:
    assert frames_of(LONGEST, 1 / rate) == frames


def test_a_marker_that_is_mostly_missing_is_left_out_of_all_recordings() -> None:
    one, two = recording("one"), recording("two")
    positions = two.positions.copy()
    positions[:70, 33] = np.nan
    observed = observe([one, replace(two, positions=positions)], FEW)
    assert {len(own.markers) for own in observed.experiment.recordings} == {len(REST) - 1}
    assert "markers-shared" in {f.kind for f in observed.findings}


def test_recordings_of_different_rates_are_followed_at_the_lowest() -> None:
    slow, fast = recording("slow", rate=30.0), recording("fast", rate=100.0, share=0.05)
    first, second = observe([slow, fast], FEW).experiment.recordings
    assert first.rate == second.rate == pytest.approx(30.0)
    # Splines over a few lost positions beside white gaps: a tenth of a millimetre on waves of a
    # metre, some at gaps.
    assert second.seen is not None
    error = np.linalg.norm(second.positions - flutter(second.markers, second.times), axis=2)
    assert error[second.seen].max() < 2e-3


def test_a_recording_of_the_lowest_rate_is_left_as_it_is() -> None:
    own = Trajectory(
        name="own", markers=REST, positions=flutter(REST, np.arange(60) / 25), rate=25.0, wind=WIND
    )
    (same,), found = at_same_rate([own])
    assert same is own
    assert not found


@pytest.mark.parametrize("rate", [5.0, 900.0])
def test_rates_beyond_those_that_can_be_predicted_are_refused(rate: float) -> None:
    with pytest.raises(InputError, match="frames a second"):
        observe([recording("odd", rate=rate, seconds=10.0 if rate < 10 else 2.2)], FEW)


def test_a_marker_left_out_is_named_by_its_place_on_the_cloth() -> None:
    positions = flutter(REST, np.arange(50) / 25.0)
    positions[:, 9] = np.nan
    (finding,) = fill_positions(positions, REST, period=0.04, where="here").findings
    u, v = REST[9]
    assert finding.where == f"here, marker at (u, v) = ({u:.4g}, {v:.4g}) m"
