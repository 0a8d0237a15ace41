"""What is wrong with a recording is refused or reported with its reason; one in order gives no
finding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.trajectories import (
    Hold,
    Observation,
    Setup,
    Up,
    WindTrack,
    hoist_stands_still,
    observe,
    sheet,
)
from tests.measure.trajectories.flags import HEIGHT, RATE, SETUP, WIDTH, flag
from tests.refusals import unrefused

NOISE = 1e-3


@pytest.fixture(scope="module")
def seen() -> Observation:
    return replace(flag(noise=NOISE), noise=NOISE)


def kinds(seen: Observation, setup: Setup = SETUP) -> set[str]:
    return {finding.kind for finding in observe([seen], setup).findings}


def moved(seen: Observation, change: Callable[[np.ndarray], None]) -> Observation:
    positions = np.array(seen.positions)
    change(positions)
    return replace(seen, positions=positions)


def test_nothing_is_found_in_a_recording_that_is_in_order(seen: Observation):
    assert kinds(seen) == set()
    assert kinds(replace(seen, noise=None)) == set()


def test_what_nothing_can_be_concluded_from_is_refused_with_its_reason(seen: Observation):
    draws, still = (
        np.random.default_rng(1).standard_normal(seen.positions.shape),
        seen.positions[:1],
    )
    jitter = 0.3 / RATE * np.random.default_rng(2).uniform(-1, 1, len(seen.times))

    def up(axis: Up) -> Observation:
        return replace(seen.turned(axis), wind=seen.known.wind)

    def first(count: int) -> Observation:
        return replace(seen, positions=seen.positions[:count], times=seen.times[:count])

    def placed(positions: np.ndarray) -> Observation:
        return replace(seen, positions=positions)

    def ends(width: float) -> Setup:
        return replace(SETUP, outline=sheet(width, HEIGHT))

    def pins(first: tuple[float, float], second: tuple[float, float]) -> Setup:
        return replace(SETUP, pins=(first, second))

    cases = [
        (placed(seen.positions * 1000.0), SETUP, "mm for m"),
        (placed(seen.positions * 100.0), SETUP, "cm for m"),
        (placed(seen.positions * 39.37), SETUP, "inches for m"),
        (placed(seen.positions * 0.85), SETUP, "rest shape does not fit"),
        (
            replace(seen, markers=seen.markers * [0.85, 1.0]),
            ends(0.85 * WIDTH),
            "rest shape does not fit",
        ),
        (seen, ends(0.9 * WIDTH), "not on the cloth"),
        (seen, pins((WIDTH, 0.0), (WIDTH, HEIGHT)), r"not held there.*\(0, "),
        (replace(seen, markers=[WIDTH, 0.0] + seen.markers * [-1.0, 1.0]), SETUP, "not held there"),
        (seen, pins((-0.5, 0.0), (0.0, HEIGHT)), "not on the cloth"),
        (first(60), SETUP, "60 frames"),
        (first(30), SETUP, "30 frames"),
        (
            replace(seen, markers=seen.markers[::3], positions=seen.positions[:, ::3]),
            SETUP,
            "24 markers",
        ),
        (placed(np.full_like(seen.positions, np.nan)), SETUP, "no marker was tracked"),
        (placed(still + NOISE * draws), SETUP, "no motion is found"),
        (placed(np.repeat(still, len(seen.times), axis=0)), SETUP, "no motion is found"),
        (replace(seen, times=seen.times + jitter), SETUP, "not evenly spaced"),
        (replace(seen, times=seen.times * 5.0), SETUP, "slow motion"),
        (up(Up.MINUS_Z), SETUP, "above its pins"),
        (up(Up.Y), SETUP, "z must point up"),
        (up(Up.MINUS_Y), SETUP, "z must point up"),
        (seen, replace(SETUP, material=None), "material is not known"),
        (seen, replace(SETUP, pins=None), "where the cloth is held is not known"),
        (replace(seen, known=replace(seen.known, wind=None)), SETUP, "no wind is known"),
    ]
    assert unrefused(lambda changed, setup: observe([changed], setup), cases, InputError) == []


def test_a_cloth_that_is_still_elsewhere_too_is_reported(seen: Observation):
    assert kinds(seen, replace(SETUP, pins=Hold.HOIST_CORNERS)) == {"still-away-from-pins"}


def test_a_hoist_that_stands_still_between_its_declared_pins_is_attached(seen: Observation):
    attached = replace(SETUP, pins=Hold.HOIST_CORNERS)
    assert hoist_stands_still(observe([seen], attached).experiment)
    assert not hoist_stands_still(observe([seen], replace(SETUP, pins=Hold.HOIST)).experiment)
    moved = seen.positions.copy()
    middle = np.flatnonzero(
        (seen.markers[:, 0] == 0) & (np.abs(seen.markers[:, 1] - HEIGHT / 2) < 0.3 * HEIGHT)
    )[0]
    moved[:, middle, 1] += 0.05 * np.sin(7 * seen.times)
    assert not hoist_stands_still(observe([replace(seen, positions=moved)], attached).experiment)


def test_lost_markers_are_reported_and_left_out(seen: Observation):
    def lose(positions: np.ndarray) -> None:
        positions[20:, [5, 6]] = np.nan

    observed = observe([moved(seen, lose)], SETUP)
    assert {f.kind for f in observed.findings} == {"markers-left-out"}
    assert len(observed.experiment.recordings[0].markers) == len(seen.markers) - 2


def test_zeros_and_stuck_positions_are_not_taken_for_tracks(seen: Observation):
    def spoil(positions: np.ndarray) -> None:
        positions[30:32, 40] = 0.0
        positions[70:73, 45] = positions[69, 45]

    observed = observe([moved(seen, spoil)], SETUP)
    assert {f.kind for f in observed.findings} == {"positions-stuck", "markers-missing"}
    error = np.abs(observed.experiment.recordings[0].positions - seen.positions).max()
    assert error < 10e-3  # cubic over 60 to 80 ms of a 1.5 Hz wave; unrepaired 0.9 m and 30 mm


def test_exchanged_markers_are_reported(seen: Observation):
    def exchange(positions: np.ndarray) -> None:
        positions[50:52, [20, 60]] = positions[50:52, [60, 20]]

    assert kinds(moved(seen, exchange)) == {"markers-astray", "markers-missing"}


def test_repeated_frames_are_reported_and_many_are_refused(seen: Observation):
    def few(positions: np.ndarray) -> None:
        positions[[40, 90, 91]] = positions[[39, 89, 89]]

    def every_second(positions: np.ndarray) -> None:
        positions[1::2] = positions[::2]

    assert kinds(moved(seen, few)) == {"repeated-frames", "markers-missing"}
    with pytest.raises(InputError, match="about 25"):
        observe([moved(seen, every_second)], SETUP)


def test_frames_that_the_times_say_are_missing_are_interpolated(seen: Observation):
    keep = np.ones(len(seen.times), dtype=bool)
    keep[[50, 51, 120]] = False
    cut = replace(seen, positions=seen.positions[keep], times=seen.times[keep])
    observed = observe([cut], SETUP)
    assert {f.kind for f in observed.findings} == {"frames-missing", "markers-missing"}
    assert observed.experiment.recordings[0].positions.shape == seen.positions.shape
    keep[50:70] = False
    with pytest.raises(InputError, match="20 frames on end are missing"):
        observe([replace(seen, positions=seen.positions[keep], times=seen.times[keep])], SETUP)


def test_frames_lost_silently_are_reported(seen: Observation):
    keep = np.ones(len(seen.times), dtype=bool)
    keep[[50, 120]] = False
    cut = replace(seen, positions=seen.positions[keep], times=np.arange(keep.sum()) / RATE)
    assert kinds(cut) == {"frames-lost"}


def test_times_rounded_to_a_millisecond_are_even(seen: Observation):
    shifted = np.round(
        seen.times * (29.97 / RATE) ** -1, 3
    )  # 29.97 frames a second, in whole milliseconds
    observed = observe([replace(seen, times=shifted)], SETUP)
    assert observed.experiment.recordings[0].rate == pytest.approx(29.97, rel=1e-4)


def test_a_wind_it_streams_against_is_refused_and_one_across_reported(seen: Observation):
    with pytest.raises(InputError, match="streams upwind"):
        observe([replace(seen, wind=WindTrack.constant((-5.0, 0.0, 0.0)))], SETUP)
    assert kinds(replace(seen, wind=WindTrack.constant((1.5, 4.8, 0.0)))) == {"flies-aside"}


def test_a_wind_log_beside_the_recording_in_time_is_refused(seen: Observation):
    times = np.arange(0.0, 60.0)
    log = WindTrack(times=times + 100.0, velocity=np.tile([5.0, 0.0, 0.0], (60, 1)))
    with pytest.raises(InputError, match="100 s to 159 s after the first frame"):
        observe([replace(seen, wind=log)], SETUP)
    assert kinds(replace(seen, wind=log.later(120.0))) == set()


def test_a_wind_in_other_units_by_far_is_reported_or_refused(seen: Observation):
    assert kinds(replace(seen, wind=WindTrack.constant((0.3, 0.0, 0.0)))) == {"wind-does-not-fit"}
    with pytest.raises(InputError, match="unit of the wind"):
        observe([replace(seen, wind=WindTrack.constant((50.0, 0.0, 0.0)))], SETUP)


def test_rest_coordinates_upside_down_are_reported(seen: Observation):
    turned = replace(seen, markers=[0.0, HEIGHT] + seen.markers * [1.0, -1.0])
    assert kinds(turned) == {"rest-upside-down"}


def test_pins_of_two_recordings_must_be_in_one_place(seen: Observation):
    other = replace(
        flag(noise=NOISE, seed=5, name="other"),
        positions=seen.positions + np.array([0.1, 0.0, 0.0]),
    )
    with pytest.raises(InputError, match=r"pins are up to 0\.1"):
        observe([seen, other], SETUP)


def test_a_cloth_whose_outline_is_not_given_is_taken_to_end_at_its_markers(seen: Observation):
    assert kinds(seen, replace(SETUP, outline=None)) == {"cloth-assumed-to-end-at-markers"}
