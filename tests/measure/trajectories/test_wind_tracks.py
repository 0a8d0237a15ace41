"""Wind beside a recording: where the air goes to, in the recording's axes and on its clock."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, UsageError
from flagdata.ingest import WindOptions
from flagdata.record.signals import Sensor, WindSeries
from measure.trajectories import LogPlacement, WindTrack, from_log
from measure.trajectories.wind_tracks import track

NORTH_IS_Y = math.pi / 2
BEGIN = 1_777_629_600_000_000_000  # 2026-05-01T10:00:00Z


def series(**channels: list[float]) -> WindSeries:
    n = len(next(iter(channels.values())))
    return WindSeries(
        time=BEGIN + np.arange(n, dtype=np.int64) * 1_000_000_000,
        channels={name: np.array(values) for name, values in channels.items()},
        flags=np.zeros(n, dtype=np.uint16),
        sensor=Sensor(name="test"),
    )


@pytest.mark.parametrize(
    ("degrees", "velocity"),
    [(0.0, (0, -5)), (90.0, (-5, 0)), (180.0, (0, 5)), (270.0, (5, 0)), (225.0, (3.5355, 3.5355))],
)
def test_a_direction_is_where_it_blows_from_clockwise_from_north(
    degrees: float, velocity: tuple[float, float]
):
    log = series(wind_speed=[5.0, 5.0], wind_direction=[math.radians(degrees)] * 2)
    wind, _ = track(log, LogPlacement(north=NORTH_IS_Y, offset=0.0), where="log")
    np.testing.assert_allclose(wind.velocity, [[*velocity, 0]] * 2, atol=1e-4)


def test_north_along_x_turns_a_north_wind_to_minus_x():
    log = series(wind_speed=[5.0], wind_direction=[0.0])
    wind, _ = track(log, LogPlacement(north=0.0, offset=0.0), where="log")
    np.testing.assert_allclose(wind.velocity, [[-5, 0, 0]], atol=1e-12)


def test_along_an_axis_only_speed_counts():
    log = series(wind_speed=[5.0, 6.0], wind_direction=[0.0, 1.0])
    wind, _ = track(log, LogPlacement(axis=(3.0, 4.0, 0.0), offset=0.0), where="log")
    np.testing.assert_allclose(wind.velocity, [[3, 4, 0], [3.6, 4.8, 0]])


def test_components_of_a_sonic_are_taken_as_they_are():
    log = series(wind_x=[1.0], wind_y=[2.0], wind_z=[-0.5])
    wind, _ = track(log, LogPlacement(offset=0.0), where="log")
    np.testing.assert_array_equal(wind.velocity, [[1, 2, -0.5]])


def test_a_part_of_a_log_has_its_own_mean_and_is_no_longer_than_the_log():
    """An hour at 2 m/s in which one minute has 8 m/s."""
    times = np.arange(3600.0)
    speed = np.where((times >= 1000) & (times < 1060), 8.0, 2.0)
    wind = WindTrack(times=times, velocity=np.outer(speed, [1.0, 0.0, 0.0])).later(1010.0)
    part = wind.between(-5.0, 35.0)
    assert (part.times[0], part.times[-1], part.speed) == (-5.0, 35.0, 8.0)
    np.testing.assert_array_equal(part.at(np.array([0.5, 20.25])), wind.at(np.array([0.5, 20.25])))
    assert part.uncertainty == wind.uncertainty
    whole = wind.between(-1e4, 1e4)
    np.testing.assert_array_equal(whole.times, wind.times)
    steady = WindTrack.constant((3.0, 0.0, 0.0))
    assert steady.between(-5.0, 35.0) is steady
    assert wind.between(5000.0, 6000.0) is wind  # beside the recording; it is refused for that


@pytest.mark.parametrize(
    "placement", [LogPlacement(offset=1.5), LogPlacement(start=BEGIN + 1_500_000_000)]
)
def test_times_count_from_the_first_frame(placement: LogPlacement):
    log = series(wind_x=[0.0, 1.0, 2.0, 3.0], wind_y=[0.0] * 4)
    wind, found = track(log, placement, where="log")
    np.testing.assert_allclose(wind.times, [-1.5, -0.5, 0.5, 1.5])
    np.testing.assert_allclose(wind.at(np.array([0.0])), [[1.5, 0, 0]])
    assert not found


def test_an_assumed_clock_and_a_gap_are_reported_and_unusable_samples_left_out():
    log = series(wind_x=[1.0] * 12, wind_y=[0.0] * 12)
    log.flags[2:9] = SampleFlag.MISSING
    wind, found = track(log, LogPlacement(), where="log")
    assert len(wind.times) == 5
    assert {f.kind for f in found} == {"clock-of-wind-assumed", "wind-samples-left-out", "wind-gap"}
    log.flags[:] = SampleFlag.SENSOR_FAULT
    with pytest.raises(InputError, match="no usable sample"):
        track(log, LogPlacement(), where="log")


def test_a_direction_without_north_is_not_guessed():
    log = series(wind_speed=[5.0], wind_direction=[0.0])
    with pytest.raises(UsageError, match="where north lies"):
        track(log, LogPlacement(), where="log")
    with pytest.raises(InputError, match="no direction"):
        track(series(wind_speed=[5.0]), LogPlacement(), where="log")


def test_a_vendors_file_is_read_as_ingest_reads_it(tmp_path: Path):
    path = tmp_path / "mast.csv"
    rows = [f"2026-05-01T12:00:{k:02d}+02:00,{4 + 0.1 * k:.1f},270" for k in range(40)]
    path.write_text("\n".join(["time,wind_speed (m/s),wind_direction (deg)", *rows]) + "\n")
    answers = WindOptions(
        expect=("fixed", "grows")
    )  # it blows from west all the time, and ever faster
    wind, _ = from_log(path, LogPlacement(north=NORTH_IS_Y, start=BEGIN + 2_000_000_000), answers)
    np.testing.assert_allclose(wind.at(np.array([0.0])), [[4.2, 0, 0]], atol=1e-9)


def test_a_track_states_when_the_recording_began_and_what_logged_it() -> None:
    log = series(wind_speed=[5.0] * 5)
    wind, _ = track(log, LogPlacement(axis=(1.0, 0.0, 0.0), offset=1.5), where="log")
    assert (wind.start, wind.sensor) == (BEGIN + 1_500_000_000, "test")
    assert wind.later(2.0).start == BEGIN + 3_500_000_000
    assert WindTrack.constant((5.0, 0.0, 0.0)).later(2.0).start is None
