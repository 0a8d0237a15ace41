"""The synthetic anemometer: means of the simulated air, its instrument's faults, a log like a real
one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from sim.datasets import AnemometerSpec, DatasetRecipe, Truth, anemometer, casts
from sim.run import Crew

BEGIN = 1_577_836_800_000_000_000
IDEAL = AnemometerSpec(
    truth=Truth.STATED, rate=1.0, before=75.0, noise=0.0, resolution=1e-6, accuracy=0.0, effects={}
)
Make = Callable[..., DatasetRecipe]


def crew(make: Make, scene: Mapping[str, str]) -> Crew:
    return Crew(next(casts(make(scene=dict(scene)))).simulation)


def steady(make: Make, speed: float, toward: float = 0.0) -> Crew:
    return crew(make, {"speed = { low = 0.0, high = 10.0 }": f"speed = {speed}\ntoward = {toward}"})


def gusty(make: Make) -> Crew:
    changes = {
        "speed = { low = 0.0, high = 10.0 }": "speed = 6.0",
        "[time]\nsettle = 0.2": "[effects.gusts]\nintensity = 0.2\n[time]\nsettle = 40.0",
    }
    return crew(make, changes)


def test_an_ideal_instrument_reads_a_steady_wind_as_it_is(make: Make) -> None:
    team = steady(make, 4.25)
    reading = anemometer.read(IDEAL, team, team.member(0), instrument=1, seed=1, begin=BEGIN)
    np.testing.assert_allclose(reading.series.channels["wind_speed"], 4.25, atol=1e-6)
    end = team.recipe.time
    assert reading.series.time[-1] <= BEGIN + round((end.total - 1) / end.rate * 1e9)
    assert reading.series.time[-1] > BEGIN + round((end.total - 1) / end.rate * 1e9) - 1_100_000_000
    assert BEGIN + round(end.settling / end.rate * 1e9) - reading.series.time[0] > 73 * 10**9


@pytest.mark.parametrize("rate", [4.0, 10.0, 20.0, 32.0])
def test_an_instrument_of_any_rate_has_a_reading_each_period(make: Make, rate: float) -> None:
    team = steady(make, 4.25)
    reading = anemometer.read(
        replace(IDEAL, rate=rate), team, team.member(0), instrument=1, seed=1, begin=BEGIN
    )
    np.testing.assert_allclose(reading.series.channels["wind_speed"], 4.25, atol=1e-6)
    np.testing.assert_allclose(np.diff(reading.series.time), 1e9 / rate, atol=1)


@pytest.mark.parametrize(
    ("toward", "blowing_from"),
    [(0.0, 270.0), (math.pi / 2, 180.0), (math.pi, 90.0), (-math.pi / 4, 315.0)],
)
def test_direction_is_where_the_wind_blows_from_clockwise_from_north(
    make: Make, toward: float, blowing_from: float
) -> None:
    # x is east, y is north: air that goes east comes from the west, 270°.
    team = steady(make, 5.0, toward)
    reading = anemometer.read(IDEAL, team, team.member(0), instrument=1, seed=1, begin=BEGIN)
    np.testing.assert_allclose(
        np.degrees(reading.series.channels["wind_direction"]), blowing_from, atol=1e-9
    )


def test_noise_resolution_and_gain_are_those_of_the_recipe(make: Make) -> None:
    team = steady(make, 5.0)
    spec = replace(
        IDEAL, before=2000.0, noise=0.3, resolution=0.1, effects={"anemometer-gain": {"gain": 1.1}}
    )
    reading = anemometer.read(spec, team, team.member(0), instrument=1, seed=1, begin=BEGIN)
    speed = reading.series.channels["wind_speed"]
    # 2000 samples: the mean within 4 standard errors, the standard deviation within 4 of its own
    # (σ/√(2n)).
    assert speed.mean() == pytest.approx(5.5, abs=4 * 0.3 / math.sqrt(2000))
    assert speed.std() == pytest.approx(
        math.hypot(0.3, 0.1 / math.sqrt(12)), rel=4 / math.sqrt(4000)
    )
    np.testing.assert_allclose(speed, np.round(speed / 0.1) * 0.1, atol=1e-12)
    assert reading.parameters == {"anemometer-gain.gain": 1.1, "anemometer.noise": 0.3}
    assert (reading.series.sensor.resolution, reading.series.sensor.averaging) == (0.1, 1.0)


def test_below_its_threshold_it_reads_zero_and_says_so(make: Make) -> None:
    spec = replace(IDEAL, effects={"anemometer-dead-zone": {"threshold": 0.5}})
    for speed, reads, flag in ((0.4, 0.0, SampleFlag.DEAD_ZONE), (0.6, 0.6, SampleFlag.OK)):
        team = steady(make, speed)
        series = anemometer.read(
            spec, team, team.member(0), instrument=1, seed=1, begin=BEGIN
        ).series
        np.testing.assert_allclose(series.channels["wind_speed"], reads, atol=1e-6)
        assert set(series.flags.tolist()) == {int(flag)}
        assert series.sensor.threshold == 0.5


def test_samples_are_means_of_the_gusts_the_flag_felt(make: Make) -> None:
    team = gusty(make)
    member = team.member(0)
    series = anemometer.read(IDEAL, team, member, instrument=1, seed=1, begin=BEGIN).series
    assert series.time[0] >= BEGIN + 10**9  # the air before the simulation is unknown
    system, _ = team.assemble([member])
    for stamp, speed in list(
        zip(series.time.tolist(), series.channels["wind_speed"].tolist(), strict=True)
    )[::7]:
        end = (stamp - BEGIN) / 1e9
        times = np.linspace(end - 1, end, 400)
        air = np.array([math.hypot(*system.wind.velocity(float(t))[:2, 0].tolist()) for t in times])
        # Ten instants stand for the second: gusts change by up to some 0.5 m/s in 0.1 s, a tenth of
        # it at the edges.
        assert speed == pytest.approx(air.mean(), abs=0.06)
    assert (
        series.channels["wind_speed"].std() > 0.3
    )  # 20 % of 6 m/s, less what a second's mean and 40 s take away


def test_lag_smooths_gusts(make: Make) -> None:
    team = gusty(make)
    late = replace(IDEAL, effects={"anemometer-lag": {"distance": 20.0}})
    fast, slow = (
        anemometer.read(spec, team, team.member(0), instrument=1, seed=1, begin=BEGIN)
        for spec in (IDEAL, late)
    )
    quick, lagging = (np.diff(r.series.channels["wind_speed"]).std() for r in (fast, slow))
    assert lagging < 0.8 * quick
    assert slow.series.sensor.distance_constant == 20.0
