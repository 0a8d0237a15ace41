"""Averages: means, directions and their uncertainty against hand-worked examples and theory."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, UsageError
from flagdata.record.averaging import average, correlation, instrument_sigma
from flagdata.record.signals import Sensor, WindSeries

S = 1_000_000_000
T0 = 1_777_636_800 * S


def series(
    time: object,
    speed: object,
    *,
    direction: object = None,
    flags: object = None,
    sensor: Sensor | None = None,
) -> WindSeries:
    channels = {"wind_speed": np.asarray(speed, dtype=np.float64)}
    if direction is not None:
        channels["wind_direction"] = np.radians(np.asarray(direction, dtype=np.float64))
    at = np.asarray(time, dtype=np.int64)
    return WindSeries(
        time=at,
        channels=channels,
        flags=np.zeros(len(at), dtype=np.uint16)
        if flags is None
        else np.asarray(flags, dtype=np.uint16),
        sensor=sensor or Sensor(name="test"),
    )


def test_a_bin_is_stamped_at_its_end_and_holds_the_sample_there() -> None:
    # (0, 1] holds 0.5 and 1.0; (1, 2] holds 1.25 and 2.0
    means = average(series([T0 + S // 2, T0 + S, T0 + 5 * S // 4, T0 + 2 * S], [1, 3, 5, 9]))
    assert means.time.tolist() == [T0 + S, T0 + 2 * S]
    assert means.speed.tolist() == [2, 7]
    assert means.count.tolist() == [2, 2]


def test_bins_without_usable_samples_are_absent() -> None:
    flags = [0, SampleFlag.STALE, SampleFlag.MISSING, 0]
    means = average(series([T0 + i * S for i in range(1, 5)], [1, 2, 3, 4], flags=flags))
    assert means.time.tolist() == [T0 + S, T0 + 4 * S]
    assert means.speed.tolist() == [1, 4]


@pytest.mark.parametrize("flag", [SampleFlag.DEAD_ZONE, SampleFlag.TIME_UNSURE, SampleFlag.ALIASED])
def test_flags_that_leave_the_speed_usable_keep_the_sample(flag: SampleFlag) -> None:
    assert average(series([T0], [2.0], flags=[flag])).speed.tolist() == [2.0]


def test_directions_are_averaged_as_vectors_across_north() -> None:
    # equal speeds from 350° and 20°: the vector mean is from 5°
    means = average(series([T0 + S // 2, T0 + S], [4, 4], direction=[350, 20]))
    assert np.degrees(means.direction[0]) == pytest.approx(5.0)


def test_stronger_wind_counts_more_in_the_direction() -> None:
    # 3 m/s from north and 4 m/s from east: atan(4/3) = 53.13° (the 3-4-5 triangle)
    means = average(series([T0 + S // 2, T0 + S], [3, 4], direction=[0, 90]))
    assert np.degrees(means.direction[0]) == pytest.approx(53.13010235)


def test_opposite_winds_have_no_direction() -> None:
    assert np.isnan(
        average(series([T0 + S // 2, T0 + S], [2, 2], direction=[90, 270])).direction[0]
    )


def test_calm_has_no_direction() -> None:
    assert np.isnan(average(series([T0 + S // 2, T0 + S], [0, 0], direction=[90, 90])).direction[0])


def test_the_sigma_of_independent_samples_is_their_scatter_over_root_n() -> None:
    draw = stream(1, "averaging").normal(5.0, 0.8, 20 * 3000)
    means = average(series(T0 + 1 + np.arange(len(draw)) * (S // 20), draw))
    inside = means.count == 20
    # the scatter of 3,000 means is σ/√n; it is known to 1/√6000 = 1.3 %, the mean of the sigmas to
    # less
    assert np.std(means.speed[inside]) == pytest.approx(0.8 / np.sqrt(20), rel=0.05)
    assert np.sqrt(np.mean(means.sigma[inside] ** 2)) == pytest.approx(0.8 / np.sqrt(20), rel=0.05)


@pytest.mark.parametrize("rho", [0.3, 0.6, 0.8])
def test_correlated_samples_count_as_fewer(rho: float) -> None:
    """An AR(1) series has Var(mean of n) = σ²/n · (1 + ρ)/(1 - ρ) for large n."""
    noise = stream(2, "ar1").normal(0, np.sqrt(1 - rho**2), 400 * 600)
    value = np.empty_like(noise)
    value[0] = noise[0]
    for i in range(1, len(noise)):
        value[i] = rho * value[i - 1] + noise[i]
    means = average(series(T0 + 1 + np.arange(len(value)) * (S // 400), 10 + value))
    inside = means.count == 400
    expected = np.sqrt((1 + rho) / (1 - rho) / 400)
    # 600 means give the scatter to 3 %; the within-bin variance is low by n_eff⁻¹, up to 2.5 % at ρ
    # = 0.8
    assert np.std(means.speed[inside]) == pytest.approx(expected, rel=0.1)
    assert np.sqrt(np.mean(means.sigma[inside] ** 2)) == pytest.approx(expected, rel=0.1)


def test_a_sample_read_several_times_over_counts_once() -> None:
    # 100 independent readings, each logged five times: ρ = 1 - 1/5 · 2σ²/2σ² = 0.8, n_eff = 500 ·
    # 0.2/1.8 = 56 of 100
    draw = np.repeat(stream(3, "repeat").normal(0, 1, 100 * 200), 5)
    starts = np.arange(0, len(draw), 500)
    rho = correlation(draw, starts, np.full(len(starts), 500))
    assert rho == pytest.approx(0.8, abs=0.01)


def test_one_sample_in_a_bin_has_the_instruments_sigma_alone() -> None:
    sensor = Sensor(name="s", accuracy=0.1, accuracy_relative=0.03, resolution=0.12)
    means = average(series([T0, T0 + 2 * S], [2.0, 10.0], sensor=sensor))
    # the larger of 0.1 and 3 % of the reading; the resolution as q/√12 = 0.0346 (JCGM 100:2008,
    # F.2.2.1)
    assert means.sigma == pytest.approx(
        [np.hypot(0.1, 0.12 / np.sqrt(12)), np.hypot(0.3, 0.12 / np.sqrt(12))]
    )


def test_an_instrument_of_unknown_accuracy_counts_as_exact() -> None:
    assert instrument_sigma(Sensor(name="s"), np.array([5.0])).tolist() == [0.0]


def test_accuracy_is_not_reduced_by_averaging() -> None:
    time = T0 + 1 + np.arange(1000) * (S // 1000)
    means = average(series(time, np.full(1000, 5.0), sensor=Sensor(name="s", accuracy=0.2)))
    assert means.sigma[0] == pytest.approx(0.2)


def test_any_period_can_be_averaged_over() -> None:
    means = average(series([T0 + i * S for i in range(1, 121)], np.arange(1, 121)), 60.0)
    assert means.time.tolist() == [T0 + 60 * S, T0 + 120 * S]
    assert means.speed.tolist() == [30.5, 90.5]
    assert means.period == 60.0


def test_a_series_without_wind_speed_is_refused_with_what_it_has() -> None:
    log = WindSeries(
        time=np.array([T0]),
        channels={"apparent_wind_speed": np.array([3.0])},
        flags=np.zeros(1, dtype=np.uint16),
        sensor=Sensor(name="boat"),
    )
    with pytest.raises(InputError, match="apparent_wind_speed"):
        average(log)
    assert average(log, channel="apparent_wind_speed").speed.tolist() == [3.0]


@pytest.mark.parametrize("period", [0.0, -1.0, float("nan"), float("inf"), 1e-9])
def test_a_period_that_is_no_length_of_time_is_refused(period: float) -> None:
    with pytest.raises(UsageError):
        average(series([T0], [1.0]), period)


def test_nothing_usable_gives_no_bins() -> None:
    means = average(series([T0, T0 + S], [np.nan, 1.0], flags=[0, SampleFlag.STALE]))
    assert (
        len(means.time)
        == len(means.speed)
        == len(means.sigma)
        == len(means.direction)
        == len(means.count)
        == 0
    )
