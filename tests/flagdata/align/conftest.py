"""Gusts, an anemometer and a flag, made from published spectra and independent of the estimators
under test."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from flagdata.align import MotionSeries
from flagdata.core.rng import stream
from flagdata.record.signals import Sensor, WindAverage, WindSeries
from flagdata.timebase import from_datetime

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND
FINE = 20  # samples of the true wind a second


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A ten-minute film beside an anemometer whose clock differs by `offset`; all that varies
    between cases.

    The true wind has von Kármán's spectrum n S(n)/σ² = 4 f / (1 + 70.8 f²)^(5/6), f = n L / U (IEC
    61400-1, B.13).
    """

    seed: int
    offset: float = 0.0
    duration: float = 600.0
    margin: float = 150.0
    mean: float = 6.0
    turbulence: float = 0.18
    length: float = 70.0
    sensor_noise: float = 0.1
    flag_noise: float = 0.35
    exponent: float = 1.6
    response: float = 0.3
    memory: float = 0.3
    apart: float = 3.0
    drift: float = 0.0
    period: float = 1.0


def gusts(scene: Scene, generator: np.random.Generator, seconds: float) -> np.ndarray:
    """Zero-mean gusts of unit variance at FINE samples a second, by random phases and von Kármán
    amplitudes."""
    count = round(seconds * FINE)
    frequency = np.fft.rfftfreq(count, 1 / FINE)[1:]
    reduced = frequency * scene.length / scene.mean
    spectrum = 4 * reduced / (1 + 70.8 * reduced**2) ** (5 / 6) / frequency
    amplitude = np.sqrt(spectrum) * (
        generator.standard_normal(len(spectrum)) + 1j * generator.standard_normal(len(spectrum))
    )
    series = np.fft.irfft(np.concatenate([[0], amplitude]), n=count)
    return series / np.std(series)


def lagged(series: np.ndarray, seconds: float) -> np.ndarray:
    """First-order lag with a time constant."""
    keep = np.exp(-1 / (FINE * seconds))
    out, _ = lfilter([1 - keep], [1, -keep], series, zi=[keep * series[0]])
    return out


def red_noise(generator: np.random.Generator, count: int, steps: float) -> np.ndarray:
    """Gauss–Markov noise of unit variance with a correlation length in samples."""
    keep = np.exp(-1 / steps)
    start = generator.standard_normal()
    out, _ = lfilter(
        [np.sqrt(1 - keep**2)], [1, -keep], generator.standard_normal(count), zi=[keep * start]
    )
    return out


def make(
    scene: Scene, *, gust: np.ndarray | None = None, other: np.ndarray | None = None
) -> tuple[MotionSeries, WindAverage]:
    """The motion on the camera's clock and the 1 Hz wind on its own: common = camera + offset.

    Args:
        gust: replaces von Kármán's gusts.
        other: replaces the gusts at the flag only, for unrelated pairs.
    """
    generator = stream(scene.seed, "scene")
    seconds = scene.duration + 2 * scene.margin
    here = gusts(scene, generator, seconds) if gust is None else gust
    # Taylor's frozen gusts between the two places, less what decays on the way: coherence exp(−8 n
    # d / U) (Davenport).
    spectrum = np.fft.rfft(here)
    frequency = np.fft.rfftfreq(len(here), 1 / FINE)
    coherence = np.exp(-8 * frequency * scene.apart / scene.mean)
    fresh = np.fft.rfft(gusts(scene, stream(scene.seed, "fresh"), seconds))
    there = np.fft.irfft(
        spectrum * np.sqrt(coherence) + fresh * np.sqrt(1 - coherence), n=len(here)
    )
    if other is not None:
        there = other
    speed_here = np.maximum(scene.mean * (1 + scene.turbulence * here), 0.1)
    speed_there = np.maximum(scene.mean * (1 + scene.turbulence * there), 0.1)

    per_bin = round(FINE * scene.period)
    bins = len(here) // per_bin
    binned = speed_here[: bins * per_bin].reshape(bins, per_bin).mean(axis=1)
    binned = np.round(binned + scene.sensor_noise * generator.standard_normal(bins), 1)
    wind_time = START + np.round((np.arange(1, bins + 1) * scene.period) * SECOND).astype(np.int64)
    wind = WindAverage(
        time=wind_time,
        speed=binned,
        sigma=np.full(bins, 0.1),
        direction=np.full(bins, np.nan),
        count=np.ones(bins, dtype=np.int32),
        period=scene.period,
    )

    felt = lagged(speed_there, scene.memory)
    rate = 25.0
    frames = round(scene.duration * rate)
    true = scene.margin + np.arange(frames) / rate
    delay = scene.response - scene.memory if scene.response > scene.memory else 0.0
    drive = np.interp(true - delay, np.arange(len(felt)) / FINE, felt)
    flutter = red_noise(generator, frames, 0.7 * rate) + 0.7 * generator.standard_normal(frames)
    energy = drive**scene.exponent * np.exp(scene.flag_noise * flutter)
    camera = true - scene.offset - scene.drift * (true - seconds / 2)
    motion = MotionSeries(time=START + np.round(camera * SECOND).astype(np.int64), energy=energy)
    return motion, wind


def scene(
    *, gust: np.ndarray | None = None, other: np.ndarray | None = None, **changes: float
) -> tuple[MotionSeries, WindAverage]:
    """`scene(seed=1, offset=12.3, …)`: a film's motion and an anemometer's averages."""
    return make(Scene(**changes), gust=gust, other=other)  # type: ignore[arg-type]


def gusts_alone(seed: int, seconds: float) -> np.ndarray:
    """Gusts of unit variance of another day."""
    return gusts(Scene(seed=seed), stream(seed, "another day"), seconds)


@dataclass(frozen=True, kw_only=True)
class Tunnel:
    """The camera-tracked card flag and the tunnel's anemometer, both stamped by one laptop.

    Attributes:
        device, host: (n,) stamps of the tracked flag by the camera's computer and by the laptop
            [UTC ns].
        motion: (n,) RMS displacement of the tracked points [px].
        wind: the anemometer on the laptop's clock, its zero of -0.35 m/s put right.
    """

    device: np.ndarray
    host: np.ndarray
    motion: np.ndarray
    wind: WindSeries


@pytest.fixture(scope="session")
def tunnel(reference_data: Path) -> Tunnel:
    """Read here by hand, so that nothing hangs on the ingest."""
    folder = reference_data / "wind" / "flag-camera-tunnel"

    def lines(name: str) -> list[tuple[int, str]]:
        with (folder / name).open(newline="") as file:
            rows = list(csv.reader(file))[1:]
        return [
            (from_datetime(datetime.fromisoformat(stamp).replace(tzinfo=UTC)), raw)
            for stamp, raw in rows
        ]

    device, host, motion = [], [], []
    for stamp, raw in lines("pi_log.csv"):
        fields = raw.split(",")
        if len(fields) == 7:
            seconds, milliseconds = fields[0].split(".")
            device.append(int(seconds) * SECOND + int(milliseconds) * 1_000_000)
            host.append(stamp)
            motion.append(float(fields[1]))
    stamps, speeds = zip(
        *((stamp, float(raw) + 0.35) for stamp, raw in lines("gt_log.csv")), strict=True
    )
    wind = WindSeries(
        time=np.array(stamps),
        channels={"wind_speed": np.array(speeds)},
        flags=np.zeros(len(stamps), dtype=np.uint16),
        sensor=Sensor(name="tunnel", averaging=0.0, distance_constant=0.0),
    )
    return Tunnel(device=np.array(device), host=np.array(host), motion=np.array(motion), wind=wind)
