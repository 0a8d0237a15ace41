"""The ground truth of a clip, against hand-worked means and the theory of correlated series."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.core.schema import SampleFlag
from flagdata.dataset import TruthSeries
from flagdata.errors import InputError, UsageError
from flagdata.record.signals import Sensor, WindSeries

NS = 1_000_000_000
START = 1_777_636_800 * NS  # 2026-05-01T12:00:00Z


def series(seconds, speed, *, flags=None, sensor=None, channel="wind_speed"):
    """A wind series with samples at `seconds` after START."""
    time = START + np.round(np.asarray(seconds, dtype=float) * NS).astype(np.int64)
    values = np.broadcast_to(np.asarray(speed, dtype=float), time.shape).copy()
    bits = (
        np.zeros(len(time), dtype=np.uint16)
        if flags is None
        else np.asarray(flags, dtype=np.uint16)
    )
    return WindSeries(
        time=time, channels={channel: values}, flags=bits, sensor=sensor or Sensor(name="exact")
    )


def truth(wind, end, **options):
    return TruthSeries.of(wind).before(START + round(end * NS), **options)


def test_constant_wind_is_its_own_mean_with_no_scatter():
    result = truth(series(np.arange(1, 121), 5.0, sensor=Sensor(name="exact", accuracy=0.0)), 100)
    assert result.wind == 5.0
    assert result.sigma == 0.0
    assert (result.coverage, result.staleness, result.count) == (1.0, 0.0, 60)


def test_mean_of_a_ramp_is_its_value_at_the_mean_of_the_stamps():
    seconds = np.arange(0, 200)
    result = truth(series(seconds, 0.1 * seconds), 100)
    # Samples at 41, 42, ..., 100 s: mean stamp (41 + 100) / 2.
    assert result.wind == pytest.approx(0.1 * 70.5, rel=1e-12)


def test_dense_ramp_has_the_mid_value_of_the_window():
    seconds = np.arange(0, 200, 0.05)
    # A sample speaks for the 0.05 s before it, so the mean lies half of that late.
    assert truth(series(seconds, 0.1 * seconds), 100).wind == pytest.approx(0.1 * 70.025, rel=1e-9)


def test_window_is_open_at_its_start_and_closed_at_its_end():
    seconds = np.arange(0, 121)
    speed = np.where(seconds == 40, 1000.0, 4.0) + np.where(seconds == 101, 1000.0, 0.0)
    speed = speed + np.where(seconds == 100, 60.0, 0.0)
    # 40 s (exactly a window early) and 101 s (after the end) are out; 100 s (exactly the end) is
    # one of 60 samples.
    assert truth(series(seconds, speed), 100).wind == pytest.approx(4.0 + 60.0 / 60, rel=1e-12)


def test_nothing_after_the_end_is_used():
    seconds = np.arange(0, 121)
    speed = 3.0 + 0.5 * (seconds % 3)
    calm = truth(series(seconds, speed), 60)
    storm = truth(series(seconds, np.where(seconds > 60, 30.01, speed)), 60)
    assert calm == storm


def test_gap_lowers_coverage_by_its_share_and_is_not_filled_in():
    seconds = np.concatenate(
        [np.arange(0, 71), np.arange(86, 121)]
    )  # rows 71..85 are missing: 15 s
    speed = np.where(seconds < 80, 2.0, 6.0)
    result = truth(series(seconds, speed), 100)
    assert result.coverage == pytest.approx(45 / 60, rel=1e-12)
    # 30 samples of 2 m/s (41..70 s) and 15 of 6 m/s (86..100 s).
    assert result.wind == pytest.approx((30 * 2 + 15 * 6) / 45, rel=1e-12)


@pytest.mark.parametrize(
    "flag", [SampleFlag.STALE, SampleFlag.OUT_OF_RANGE, SampleFlag.MISSING, SampleFlag.SENSOR_FAULT]
)
def test_unusable_samples_are_left_out_and_leave_a_hole(flag):
    seconds = np.arange(0, 121)
    bad = (seconds > 50) & (seconds <= 62)
    wind = series(seconds, np.where(bad, 99.0, 4.0), flags=np.where(bad, int(flag), 0))
    result = truth(wind, 100)
    assert result.wind == 4.0
    assert result.coverage == pytest.approx(48 / 60, rel=1e-12)


def test_staleness_is_the_age_of_the_newest_usable_sample():
    seconds = np.arange(0, 121)
    wind = series(seconds, 4.0, flags=np.where(seconds > 93, int(SampleFlag.STALE), 0))
    assert truth(wind, 100).staleness == pytest.approx(7.0, rel=1e-12)


def test_log_that_ended_long_ago_has_no_mean_and_says_how_old_it_is():
    result = truth(series(np.arange(0, 11), 4.0), 100)
    assert math.isnan(result.wind)
    assert math.isnan(result.sigma)
    assert (result.coverage, result.staleness, result.count) == (0.0, 90.0, 0)
    assert result.flags == ("wind-missing",)


def test_log_that_begins_later_is_infinitely_stale():
    assert truth(series(np.arange(200, 300), 4.0), 100).staleness == math.inf


def test_irregular_logger_is_not_biased_towards_its_busy_moments():
    # 2 m/s for 30 s logged once a second, then 8 m/s for 30 s logged twice a second.
    seconds = np.concatenate([np.arange(-60, 31), np.arange(30.5, 60.01, 0.5)])
    speed = np.where(seconds <= 30, 2.0, 8.0)
    assert truth(series(seconds, speed), 60).wind == pytest.approx(5.0, rel=1e-12)


def test_a_log_that_lost_every_fifth_row_covers_four_fifths():
    seconds = np.array([second for second in range(-60, 121) if second % 5 != 1])
    assert truth(series(seconds, 4.0), 100).coverage == pytest.approx(4 / 5, rel=1e-12)


def test_rows_that_arrive_in_bunches_cover_the_time_between():
    # A serial port that hands over ten readings at once, five times a second.
    bunches = np.arange(0, 120, 0.2)
    seconds = np.sort((bunches[:, None] + 0.0001 * np.arange(10)).ravel())
    assert truth(series(seconds, 4.0), 100).coverage == pytest.approx(1.0, abs=0.01)


def test_clock_uncertainty_acts_through_the_slope_of_the_wind():
    seconds = np.arange(-60, 200, 0.1)
    ramp = series(seconds, 10 + 0.02 * seconds)
    # The mean of a ramp of 0.02 m/s² moves by 0.02 m/s for each second the window moves.
    assert truth(ramp, 100, clock_sigma=2.0).sigma_clock == pytest.approx(0.04, rel=1e-6)
    assert truth(ramp, 100).sigma_clock == 0.0
    assert truth(series(seconds, 10.0), 100, clock_sigma=2.0).sigma_clock == 0.0


def test_clock_uncertainty_is_the_scatter_that_a_wrong_clock_causes():
    generator = np.random.default_rng(4)
    phi, n, sigma = math.exp(-1 / 10), 40_000, 2.0  # gusts with a correlation time of 10 s
    gust = np.empty(n)
    gust[0] = generator.normal()
    for k, step in enumerate(generator.normal(size=n - 1) * math.sqrt(1 - phi**2)):
        gust[k + 1] = phi * gust[k] + step
    wind = TruthSeries.of(series(np.arange(n), 10 + gust))
    ends = np.arange(200, n - 200, 67)
    stated, shifts = [], []
    for end, error in zip(ends.tolist(), generator.normal(size=len(ends)) * sigma, strict=True):
        instant = START + end * NS
        right = wind.before(instant, clock_sigma=sigma)
        stated.append(right.sigma_clock)
        shifts.append(wind.before(instant + round(error * NS)).wind - right.wind)
    # Root mean squares of 590 windows (3 % sampling error each); the edges' means over ±2 s smooth
    # the gusts a little.
    assert np.sqrt(np.mean(np.square(stated))) == pytest.approx(np.std(shifts), rel=0.2)


def test_clock_uncertainty_is_bounded_by_the_scatter_where_the_log_has_no_edge():
    seconds = np.concatenate([np.arange(45, 90), np.arange(110, 200)])
    wind = series(seconds, np.where(seconds % 2 == 0, 3.0, 5.0))
    # Nothing near the edge at 40 s: √2 × scatter (1 m/s, nearly: 45 samples) over the window of 60
    # s, per second.
    assert truth(wind, 100, clock_sigma=1.0).sigma_clock == pytest.approx(
        math.sqrt(2) / 60, rel=1e-3
    )


def test_sensor_accuracy_does_not_shrink_by_averaging():
    sensor = Sensor(name="cup", accuracy=0.3, accuracy_relative=0.02, resolution=0.1)
    step = 0.1 / math.sqrt(12)
    seconds = np.arange(0, 121)
    assert truth(series(seconds, 5.0, sensor=sensor), 100).sigma == pytest.approx(
        math.hypot(0.3, step), rel=1e-12
    )
    assert truth(series(seconds, 20.0, sensor=sensor), 100).sigma == pytest.approx(
        math.hypot(0.4, step), rel=1e-12
    )


def test_dead_zone_widens_the_interval_by_what_it_may_hide():
    sensor = Sensor(name="cup", accuracy=0.0, threshold=0.6)
    wind = series(
        np.arange(0, 121), 0.0, flags=np.full(121, int(SampleFlag.DEAD_ZONE)), sensor=sensor
    )
    result = truth(wind, 100)
    # A true speed anywhere in [0, 0.6] read as 0: root mean square 0.6 / √3.
    assert result.sigma == pytest.approx(0.6 / math.sqrt(3), rel=1e-12)
    assert "wind-dead-zone" in result.flags


def test_unknown_accuracy_is_reported():
    assert "sensor-accuracy-unknown" in truth(series(np.arange(0, 121), 5.0), 100).flags
    known = Sensor(name="cup", accuracy=0.1)
    assert truth(series(np.arange(0, 121), 5.0, sensor=known), 100).flags == ()


def test_of_an_unknown_sensor_the_step_of_its_readings_is_the_least_uncertainty():
    seconds = np.arange(-300, 121)
    # Rounded to 0.5 m/s and steady in the minute before 100 s: the scatter of the mean is 0 there.
    result = truth(series(seconds, np.where(seconds < 0, 3.5 + 0.5 * (seconds % 2), 4.5)), 100)
    assert result.sigma_mean == 0.0
    assert result.sigma == pytest.approx(0.5 / math.sqrt(12), rel=1e-12)
    assert result.flags == ("sensor-accuracy-unknown",)


def test_the_step_comes_on_top_of_the_scatter_of_the_mean():
    seconds = np.arange(0, 121)
    result = truth(series(seconds, 4 + 0.1 * (seconds % 2)), 100)
    assert result.sigma_sensor == pytest.approx(0.1 / math.sqrt(12), rel=1e-9)
    assert result.sigma == pytest.approx(
        math.hypot(result.sigma_mean, result.sigma_sensor), rel=1e-12
    )


@pytest.mark.parametrize("speed", [0.0, 4.0])
def test_an_unknown_sensor_that_always_reads_the_same_has_no_known_uncertainty(speed):
    result = truth(series(np.arange(0, 121), speed), 100)
    assert result.wind == speed
    assert math.isnan(result.sigma)
    assert result.flags == ("sensor-accuracy-unknown", "wind-sigma-unknown")


@pytest.mark.parametrize(
    ("last", "flags"), [(96, ()), (94, ("wind-stale",)), (80, ("wind-coverage-low", "wind-stale"))]
)
def test_a_thin_or_stale_minute_is_flagged(last, flags):
    wind = series(np.arange(0, last + 1), 4.0, sensor=Sensor(name="cup", accuracy=0.1))
    assert truth(wind, 100).flags == flags


def test_one_sample_has_a_mean_but_no_known_uncertainty():
    result = truth(series([90], 5.0), 100)
    assert result.wind == 5.0
    assert math.isnan(result.sigma)
    assert "wind-sigma-unknown" in result.flags


def test_white_noise_has_the_textbook_standard_error():
    generator = np.random.default_rng(1)
    windows = 400
    speed = 10 + generator.normal(size=60 * windows)
    wind = TruthSeries.of(series(np.arange(1, 60 * windows + 1), speed))
    sigmas = [wind.before(START + 60 * k * NS).sigma_mean for k in range(1, windows + 1)]
    # 1/√60 = 0.129. τ is never taken below 1, so that its estimate errs upwards: 10 % is allowed.
    assert np.mean(sigmas) == pytest.approx(1 / math.sqrt(60), rel=0.1)
    assert np.mean(sigmas) >= 1 / math.sqrt(60) * 0.98


@pytest.mark.parametrize("phi", [0.5, 0.7, 0.9])
def test_standard_error_covers_the_true_mean_of_correlated_wind(phi):
    generator = np.random.default_rng(2)
    windows = 1200  # of a minute at 1 Hz; AR(1): correlation time (1 + φ)/(1 - φ) = 3, 6 and 19 s
    noise = generator.normal(size=60 * windows) * math.sqrt(1 - phi**2)
    speed = np.empty(len(noise))
    speed[0] = noise[0]
    for k in range(1, len(noise)):
        speed[k] = phi * speed[k - 1] + noise[k]
    wind = TruthSeries.of(series(np.arange(1, len(speed) + 1), 10 + speed))
    results = [wind.before(START + 60 * k * NS) for k in range(10, windows + 1)]
    inside = np.mean([abs(r.wind - 10) <= 2 * r.sigma_mean for r in results])
    naive = np.mean([abs(r.wind - 10) <= 2 / math.sqrt(60) for r in results])
    # Nominal 95.4 %, sampling error 0.6 %; a minute holds 20, 10 and 3 independent winds, and what
    # it says of their scatter is uncertain too, for which 3 % are allowed.
    assert 0.92 < inside < 0.99
    assert naive < 0.8  # the error of uncorrelated samples falls badly short


@pytest.mark.parametrize("rate", [1, 4, 20])
def test_standard_error_does_not_depend_on_the_logging_rate(rate):
    seconds = np.arange(1, 61 * rate) / rate
    gust = 5 + np.sin(2 * np.pi * seconds / 12)
    coarse = truth(series(np.arange(1, 61), 5 + np.sin(2 * np.pi * np.arange(1, 61) / 12)), 60)
    # Block means over a second lose sinc(1/12) = 1.1 % of a 12 s wave.
    assert truth(series(seconds, gust), 60).sigma_mean == pytest.approx(coarse.sigma_mean, rel=0.03)


def test_sonic_components_give_the_horizontal_speed():
    wind = series(np.arange(0, 121), 3.0, channel="wind_x")
    both = replace(
        wind, channels={**wind.channels, "wind_y": np.full(121, -4.0), "wind_z": np.full(121, 9.0)}
    )
    assert truth(both, 100).wind == pytest.approx(5.0, rel=1e-12)


def test_rows_of_other_channels_take_nothing_from_the_coverage():
    # Two sentences a second, one with the wind over ground, one with the apparent wind 0.1 s later.
    seconds = np.sort(np.concatenate([np.arange(0, 121), np.arange(0, 121) + 0.1]))
    ground = np.arange(len(seconds)) % 2 == 0
    wind = series(seconds, np.where(ground, 4.0, np.nan))
    both = replace(
        wind, channels={**wind.channels, "apparent_wind_speed": np.where(ground, np.nan, 9.0)}
    )
    result = truth(both, 100)
    assert (result.wind, result.coverage, result.count) == (4.0, 1.0, 60)


def test_apparent_wind_is_refused_as_ground_truth():
    with pytest.raises(InputError, match="apparent wind is not ground truth"):
        TruthSeries.of(series(np.arange(0, 121), 3.0, channel="apparent_wind_speed"))


def test_impossible_window_or_clock_is_a_usage_error():
    for options in (
        {"window": 0.0},
        {"window": math.inf},
        {"clock_sigma": -1.0},
        {"clock_sigma": math.nan},
    ):
        with pytest.raises(UsageError):
            truth(series(np.arange(0, 121), 3.0), 100, **options)


@given(
    gaps=st.lists(st.floats(0.05, 20.0), min_size=2, max_size=80),
    end=st.floats(0.0, 200.0),
    window=st.floats(1.0, 120.0),
    speed=st.floats(0.0, 60.0),
)
def test_any_spacing_keeps_the_mean_within_the_samples_and_coverage_within_one(
    gaps, end, window, speed
):
    result = truth(series(np.cumsum(gaps), speed), end, window=window)
    assert 0.0 <= result.coverage <= 1.0
    assert result.staleness >= 0.0
    if result.count:
        assert result.wind == pytest.approx(speed, rel=1e-12, abs=1e-12)
        assert result.staleness < window
    else:
        assert math.isnan(result.wind)
