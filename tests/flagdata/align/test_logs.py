"""Two logs of one wind: offset, drift and gain come back, and logs of different winds are
refused."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from flagdata.align import LagSearch, LogClock, log_clock
from flagdata.align.logs import gain_of
from flagdata.cli import root
from flagdata.core.clock_model import ClockModel
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.errors import RefusedError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND
RATE = 10


@dataclass(frozen=True, kw_only=True)
class Two:
    """A sonic at 10 Hz and a cup at 1 Hz in von Kármán turbulence whose mean wanders over the day.

    The cup's clock c is on the sonic's c + `offset` + `drift` (c − `middle`); it reads `zero` +
    `gain` × the wind that has passed a rotor of distance constant `distance` [m], with noise, in
    steps of 0.1 m/s; both logs have a gap.
    """

    seed: int
    hours: float
    offset: float = 3.37
    drift: float = 27e-6
    gain: float = 0.93
    zero: float = 0.1
    distance: float = 2.3
    related: bool = True

    @property
    def middle(self) -> int:
        return START + round(self.hours * 1800) * SECOND

    def gusts(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Zero mean, unit variance; von Kármán's spectrum (IEC 61400-1, B.13) by random phases."""
        reduced = np.fft.rfftfreq(count, 1 / RATE)[1:] * 70.0 / 6.0
        amplitude = np.sqrt(1 / (1 + 70.8 * reduced**2) ** (5 / 6))
        phases = generator.standard_normal(len(reduced)) + 1j * generator.standard_normal(
            len(reduced)
        )
        series = np.fft.irfft(np.concatenate([[0], amplitude * phases]), n=count)
        return series / np.std(series)

    def logs(self) -> tuple[WindSeries, WindSeries]:
        generator = stream(self.seed, "two-logs")
        count = round(self.hours * 3600) * RATE
        time = np.arange(count) / RATE
        mean = 6.0 * (1 + 0.4 * np.sin(2 * np.pi * time / 86_400 - 1))
        wind = np.maximum(mean * (1 + 0.18 * self.gusts(generator, count)), 0.2)
        other = (
            wind
            if self.related
            else np.maximum(mean * (1 + 0.18 * self.gusts(generator, count)), 0.2)
        )
        sonic = np.round((wind + generator.normal(0, 0.05, count)) / 0.01) * 0.01
        turned = np.empty(count)
        level = float(other[0])
        for index, value in enumerate(other.tolist()):
            level += (
                (1 - np.exp(-value / (RATE * self.distance))) * (value - level)
                if self.distance
                else value - level
            )
            turned[index] = level
        stamps = START + np.arange(count // RATE, dtype=np.int64) * SECOND
        true = stamps + np.round(self.offset * SECOND + self.drift * (stamps - self.middle)).astype(
            np.int64
        )
        cup = np.interp((true - START) / SECOND, time, turned)
        cup = self.zero + self.gain * cup + generator.normal(0, 0.1, len(cup))
        cup = np.round(np.maximum(cup, 0) / 0.1) * 0.1
        ours = series(
            START + np.arange(count, dtype=np.int64) * (SECOND // RATE), sonic, 0.33, distance=0.0
        )
        return ours, series(stamps, cup, 0.5, distance=self.distance)


def series(
    time: np.ndarray, speed: np.ndarray, gap: float, *, distance: float | None
) -> WindSeries:
    """A log with a silence of a hundredth of its length, `gap` of the way through."""
    keep = np.ones(len(time), dtype=bool)
    keep[round(gap * len(time)) : round((gap + 0.01) * len(time))] = False
    return WindSeries(
        time=time[keep],
        channels={"wind_speed": speed[keep]},
        flags=np.zeros(int(keep.sum()), dtype=np.uint16),
        sensor=Sensor(name="made", averaging=0.0, distance_constant=distance),
    )


def found(reference: WindSeries, sensor: WindSeries) -> LogClock:
    search = LagSearch(window=60.0)
    return log_clock(
        reference, sensor, names=("sonic", "cup"), search=search, generator=stream(1, "found")
    )


def at_middle(two: Two, model: ClockModel) -> float:
    return float(model.to_common(two.middle) - two.middle) / SECOND


def test_over_a_day_drift_is_found_to_2_ppm_and_offset_to_a_tenth_of_a_second() -> None:
    two = Two(seed=1, hours=24)
    clock = found(*two.logs())
    (segment,) = clock.model.segments
    assert at_middle(two, clock.model) == pytest.approx(two.offset, abs=0.1)
    assert segment.drift == pytest.approx(two.drift, abs=2e-6)
    assert 0 < segment.sigma_drift < 1e-6
    # Noise of the sonic's minutes, 0.05/√600 m/s, and readings held at 0 take less than a hundredth
    # off the slope.
    assert clock.gain.gain == pytest.approx(two.gain, abs=0.01)
    assert clock.gain.zero == pytest.approx(two.zero, abs=0.06)


def test_the_model_is_of_the_sensors_clock_whichever_log_is_faster() -> None:
    two = Two(seed=2, hours=1.5, drift=0.0)
    sonic, cup = two.logs()
    there, back = found(sonic, cup), found(cup, sonic)
    assert at_middle(two, there.model) == pytest.approx(two.offset, abs=0.1)
    assert at_middle(two, back.model) == pytest.approx(-two.offset, abs=0.1)
    assert back.gain.gain == pytest.approx(1 / two.gain, abs=0.03)


def test_two_logs_of_one_rate_are_aligned() -> None:
    two = Two(seed=3, hours=1.5, drift=0.0, distance=0.0)
    sonic, cup = two.logs()
    slow = np.flatnonzero(sonic.time % SECOND == 0)
    sampled = WindSeries(
        time=sonic.time[slow],
        channels={"wind_speed": sonic.channels["wind_speed"][slow]},
        flags=sonic.flags[slow],
        sensor=sonic.sensor,
    )
    assert at_middle(two, found(sampled, cup).model) == pytest.approx(two.offset, abs=0.1)


def test_an_unknown_rotor_widens_sigma() -> None:
    two = Two(seed=2, hours=1.0, drift=0.0)
    sonic, cup = two.logs()
    known = found(sonic, cup).model.segments[0].sigma_offset
    unknown = replace(cup, sensor=replace(cup.sensor, distance_constant=None))
    assert found(sonic, unknown).model.segments[0].sigma_offset > np.hypot(known, 0.1)


def test_logs_of_different_winds_are_refused_with_the_reason() -> None:
    sonic, cup = Two(seed=4, hours=1.5, related=False).logs()
    with pytest.raises(RefusedError, match="no offset can be estimated: ") as refused:
        found(sonic, cup)
    assert refused.value.exit_code == 3


def test_logs_of_different_days_are_refused_as_not_overlapping() -> None:
    sonic, cup = Two(seed=2, hours=1.0).logs()
    later = replace(cup, time=cup.time + 86_400 * SECOND)
    with pytest.raises(RefusedError, match="do not overlap"):
        found(sonic, later)


def test_gain_is_the_slope_of_minute_means() -> None:
    time = START + np.arange(3600, dtype=np.int64) * SECOND
    speed = 5.0 + np.sin(np.arange(3600.0) / 400)
    model = ClockModel.identity("b", "a", start=START, end=int(time[-1]) + 1, sigma=0.1)
    sensor = Sensor(name="made")
    flags = np.zeros(3600, dtype=np.uint16)
    one = WindSeries(time=time, channels={"wind_speed": speed}, flags=flags, sensor=sensor)
    two = WindSeries(
        time=time, channels={"wind_speed": 0.2 + 1.1 * speed}, flags=flags, sensor=sensor
    )
    gain = gain_of(one, two, model)
    assert (gain.gain, gain.zero) == (pytest.approx(1.1), pytest.approx(0.2))
    assert gain.sigma < 1e-6


def lake_of(folder: Path, two: Two) -> tuple[Lake, list[str]]:
    lake = Lake.create(folder)
    with lake.transaction("logs") as transaction:
        artifacts = []
        for name, log in zip(("sonic", "cup"), two.logs(), strict=True):
            path = transaction.staging(".mcap")
            with RecordWriter(path, metadata={}) as record:
                record.wind(log)
            artifact = Artifact(
                kind=Kind.WIND,
                name=name,
                object=transaction.put(path),
                source_hash=name[0].encode().hex()[:1] * 64,
                start=int(log.time[0]),
                end=int(log.time[-1]),
                session="mast",
            )
            transaction.add(artifact)
            artifacts.append(artifact.id)
    return lake, artifacts


def run(*arguments: str) -> dict[str, object]:
    result = CliRunner().invoke(
        root, [*arguments, "--json"], catch_exceptions=False, standalone_mode=False
    )
    return json.loads(result.stdout)


def test_the_command_writes_the_sensors_log_on_the_references_clock_in_one_commit(
    tmp_path: Path,
) -> None:
    two = Two(seed=2, hours=0.6, drift=0.0)
    lake, (sonic, cup) = lake_of(tmp_path / "lake", two)
    before = lake.resolve(None)
    arguments = ("align", sonic, cup, "--search", "30", "--lake", str(lake.path))
    said = run(*arguments)
    assert lake.resolve(None) == before + 1
    artifact = lake.artifact(str(said["wind"]))
    assert (artifact.kind, artifact.parents, artifact.session) == (Kind.WIND, (sonic, cup), "mast")
    assert artifact.clock_offset == pytest.approx(two.offset, abs=0.15)
    record = Record.open(lake.object_path(str(artifact.object)))
    written, own = (
        record.wind(),
        Record.open(lake.object_path(str(lake.artifact(cup).object))).wind(),
    )
    assert written is not None
    assert own is not None
    np.testing.assert_array_equal(record.device_wind_times, own.time)
    assert written.time[0] - own.time[0] == pytest.approx(two.offset * SECOND, abs=0.15 * SECOND)
    np.testing.assert_array_equal(written.channels["wind_speed"], own.channels["wind_speed"])
    again = run(*arguments)
    assert (again["wind"], again["created"]) == (said["wind"], False)
    assert lake.resolve(None) == before + 1
    for option in (("--window", "10s"), ("--by", "stamps", "--offset-sigma", "1")):
        with pytest.raises(UsageError, match="two logs"):
            run("align", sonic, cup, *option, "--lake", str(lake.path))
