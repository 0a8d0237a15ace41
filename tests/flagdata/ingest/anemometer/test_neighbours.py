"""Two logs of one wind that are hours apart are reported; two winds, and two logs on one clock, are
not."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.rng import stream
from flagdata.ingest import Labels, WindIngest, WindOptions, ingest_wind
from flagdata.ingest.anemometer.samples.neighbours import hours_off
from flagdata.lake import Lake
from flagdata.record.signals import Sensor, WindSeries

S = 1_000_000_000
T0 = 1_777_636_800 * S
N = 1440


def wind(seed: int, n: int = N) -> np.ndarray:
    """A day of minutes: weather of hours with gusts of minutes about it."""
    slow = np.convolve(
        stream(seed, "weather").normal(0, 1, n + 180), np.ones(180) / np.sqrt(180), mode="valid"
    )[:n]
    return 8 + 1.5 * slow + stream(seed, "gusts").normal(0, 1, n)


def series(speed: np.ndarray, *, off: float = 0.0, seed: int = 0) -> WindSeries:
    """As a sensor of its own reads it, with a noise of 0.4 m/s, `off` seconds from the truth."""
    read = np.maximum(speed + stream(seed, "reading").normal(0, 0.4, len(speed)), 0.0)
    time = T0 + np.arange(len(speed)) * 60 * S + round(off * S)
    flags = np.zeros(len(speed), dtype=np.uint16)
    return WindSeries(
        time=time, channels={"wind_speed": read}, flags=flags, sensor=Sensor(name="x")
    )


@pytest.mark.parametrize("off", [-3600, 3600, 5400, -7200])
def test_two_logs_of_one_wind_an_hour_apart_are_reported_with_the_correction(off: int) -> None:
    finding = hours_off(series(wind(1), off=off, seed=2), series(wind(1), seed=3), name="mast")
    assert finding is not None
    assert finding.value == -off
    assert "mast" in finding.what
    assert "--zone" in (finding.fix or "")


@pytest.mark.parametrize("off", [0, 20, -45])
def test_two_logs_on_one_clock_are_not_reported(off: int) -> None:
    assert hours_off(series(wind(1), off=off, seed=2), series(wind(1), seed=3), name="mast") is None


@pytest.mark.parametrize("seed", range(4, 12))
def test_two_winds_are_not_reported_whatever_their_weather(seed: int) -> None:
    assert (
        hours_off(series(wind(seed), seed=2), series(wind(seed + 100), seed=3), name="mast") is None
    )


def test_short_logs_are_not_compared() -> None:
    assert hours_off(series(wind(1, 20), off=3600), series(wind(1, 20)), name="mast") is None


def test_the_second_log_of_a_session_is_compared_with_the_first(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    truth = wind(1)
    kinds = []
    for name, hour in (("summer", 2), ("winter", 1)):
        one = series(truth, seed=hour)
        local = [
            (dt.datetime.fromtimestamp(t // S, dt.UTC) + dt.timedelta(hours=hour)).strftime(
                "%Y-%m-%d %H:%M:%S"
            )
            for t in one.time.tolist()
        ]
        path = tmp_path / f"{name}.csv"
        rows = zip(local, one.channels["wind_speed"], strict=True)
        path.write_text("time,wind_speed [m/s]\n" + "".join(f"{at},{v:.2f}\n" for at, v in rows))
        options = WindIngest(wind=WindOptions(zone="+02:00"))
        result = ingest_wind(lake, path, options, labels=Labels(session="field"))
        kinds.append([f["kind"] for f in result.report["findings"]])
    assert "hours-off" not in kinds[0]
    assert "hours-off" in kinds[1]
    assert "hours-off" in result.artifact.quality
