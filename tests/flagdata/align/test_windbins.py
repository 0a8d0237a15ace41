"""Bins of wind whose instants are those of the air, whatever the phase of the logger's stamps."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.align import wind_bins
from flagdata.core.rng import stream
from flagdata.errors import InputError
from flagdata.record.signals import Sensor, WindSeries

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND


def ramp_log(
    *,
    spacing: float,
    phase: float,
    averaging: float | None,
    stated: float | None,
    jitter: float = 0.0,
    count: int = 400,
) -> WindSeries:
    """A wind of 1 m/s + 1 m/s a second since START, by an instrument that gives the mean of the
    time before a stamp.

    The mean of a ramp over a second is its value in the middle of it, so each speed identifies its
    instant.
    """
    at = (np.arange(count) + 1) * spacing + phase
    stamp = at + jitter * stream(1, "jitter").uniform(-0.5, 0.5, count)
    speed = 1 + stamp - (averaging or 0.0) / 2
    return WindSeries(
        time=START + np.round(stamp * SECOND).astype(np.int64),
        channels={"wind_speed": speed},
        flags=np.zeros(count, dtype=np.uint16),
        sensor=Sensor(name="ramp", averaging=stated, distance_constant=0.0),
    )


def error_of_instants(series: WindSeries) -> np.ndarray:
    """Middle of each bin less the instant that its speed is of [s]."""
    average = wind_bins(series).average
    middle = (average.time - START) / SECOND - average.period / 2
    return middle - (average.speed - 1)


@pytest.mark.parametrize("phase", [0.0, 0.2, 0.5, 0.77])
def test_one_reading_a_second_stands_for_the_second_before_its_stamp_at_any_phase(
    phase: float,
) -> None:
    series = ramp_log(spacing=1.0, phase=phase, averaging=1.0, stated=1.0)
    np.testing.assert_allclose(error_of_instants(series), 0.0, atol=1e-6)
    assert wind_bins(series).sigma == 0.0


@pytest.mark.parametrize("phase", [0.0, 0.5])
def test_jitter_of_a_slow_logger_neither_loses_nor_doubles_bins(phase: float) -> None:
    series = ramp_log(spacing=1.0, phase=phase, averaging=1.0, stated=1.0, jitter=0.3)
    average = wind_bins(series).average
    assert len(average.time) == 400
    assert set(average.count.tolist()) == {1}
    # Single bins are off by their sample's own jitter, all of them together are not.
    assert abs(np.median(error_of_instants(series))) < 0.02


@pytest.mark.parametrize(
    ("spacing", "phase"), [(0.05, 0.0), (0.05, 0.013), (0.25, 0.1), (0.005, 0.0)]
)
def test_fast_sensors_are_averaged_over_the_second_their_samples_are_of(
    spacing: float, phase: float
) -> None:
    series = ramp_log(
        spacing=spacing, phase=phase, averaging=spacing, stated=spacing, count=round(100 / spacing)
    )
    # First and last bins are not full; the median bin's instant is right to a fraction of the
    # spacing.
    errors = error_of_instants(series)[1:-1]
    assert np.max(np.abs(errors)) < spacing / 2 + 1e-6
    assert abs(np.median(errors)) < 0.02 * spacing + 1e-6


@pytest.mark.parametrize("averaging", [None, 1.0])
def test_unknown_averaging_is_within_the_stated_uncertainty(averaging: float | None) -> None:
    series = ramp_log(spacing=1.0, phase=0.0, averaging=averaging, stated=None)
    bins = wind_bins(series)
    # Both extremes, a reading of the instant and the mean since the one before, are √3 σ off: the
    # ends of a rectangle.
    assert bins.sigma == pytest.approx(1 / (4 * np.sqrt(3)))
    np.testing.assert_allclose(
        np.abs(error_of_instants(series)), np.sqrt(3) * bins.sigma, atol=1e-6
    )


def test_readings_every_five_seconds_make_bins_of_five_seconds() -> None:
    assert (
        wind_bins(ramp_log(spacing=5.0, phase=2.0, averaging=5.0, stated=5.0)).average.period == 5.0
    )


def test_a_gap_stays_a_gap() -> None:
    series = ramp_log(spacing=1.0, phase=0.0, averaging=1.0, stated=1.0)
    speed = series.channels["wind_speed"].copy()
    speed[100:130] = np.nan
    holed = WindSeries(
        time=series.time, channels={"wind_speed": speed}, flags=series.flags, sensor=series.sensor
    )
    assert len(wind_bins(holed).average.time) == 370


def test_logs_that_cannot_show_gusts_say_so() -> None:
    with pytest.raises(InputError, match="too rarely"):
        wind_bins(ramp_log(spacing=120.0, phase=0.0, averaging=None, stated=None))
    one = ramp_log(spacing=1.0, phase=0.0, averaging=None, stated=None, count=1)
    with pytest.raises(InputError, match="1 usable"):
        wind_bins(one)
    other = WindSeries(
        time=one.time, channels={"air_temperature": np.ones(1)}, flags=one.flags, sensor=one.sensor
    )
    with pytest.raises(InputError, match="no channel wind_speed"):
        wind_bins(other)


def slow_sensor(distance_constant: float | None) -> WindSeries:
    """A steady 5 m/s, one instant a second."""
    return WindSeries(
        time=START + np.arange(60, dtype=np.int64) * SECOND,
        channels={"wind_speed": np.full(60, 5.0)},
        flags=np.zeros(60, dtype=np.uint16),
        sensor=Sensor(name="cup", averaging=0.0, distance_constant=distance_constant),
    )


def test_a_rotating_sensor_reports_air_that_passed_its_distance_constant_over_the_speed_ago() -> (
    None
):
    quick, slow = wind_bins(slow_sensor(0.0)), wind_bins(slow_sensor(2.5))
    # 2.5 m at 5 m/s: half a second, trusted to 20 %.
    assert (quick.average.time - slow.average.time == SECOND // 2).all()
    assert slow.sigma == pytest.approx(0.1)
    assert quick.sigma == 0.0


def test_an_unknown_sensor_may_be_a_sonic_or_a_heavy_cup() -> None:
    quick, unknown = wind_bins(slow_sensor(0.0)), wind_bins(slow_sensor(None))
    # 0 to 3 m at 5 m/s: 0.3 s ± 0.6/√12.
    assert (quick.average.time - unknown.average.time == 3 * SECOND // 10).all()
    assert unknown.sigma == pytest.approx(0.6 / np.sqrt(12))
