"""Films that are not looked at: features that are a known function of a gusty wind, and the log
beside it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.record.signals import Sensor
from measure.anemometer import ReadingCalibration, Recording, calibrate_reading
from measure.cloth import Log
from measure.film import FlagSize, WindowLayout
from measure.measuring_model import Features, Place

SIZE = FlagSize(length=1.5, height=1.0)
STEP = 1.2
NOISE = 0.3
"""Scatter of each feature, in its spread by the wind."""
_RATE = 10.0


NETWORK: Any = SimpleNamespace(identity="0" * 64, estimator=SimpleNamespace(name="made"))
"""What is asked of a network."""


def gusts(seconds: float, *, seed: int) -> tuple[FloatArray, FloatArray]:
    """Times and a wind of 5 ± 0.8 m/s with a correlation time of 4 s, 30 s before and after the
    film as well."""
    rng = stream(seed, "made", "gusts")
    count = round((seconds + 60) * _RATE)
    return np.arange(count) / _RATE - 30.0, 5.0 + 0.8 * slow(
        rng.standard_normal((count, 1)), 4 * _RATE
    )[:, 0]


def slow(kicks: FloatArray, time: float) -> FloatArray:
    """Standard normal series (n, k) with a correlation time in steps, of white ones: AR(1)."""
    keep = np.exp(-1 / time)
    return np.asarray(lfilter([np.sqrt(1 - keep**2)], [1.0, -keep], kicks, axis=0))


def place(*, seed: int = 0, shifted: float = 0.0) -> Place:
    """A textured background with the flag's hoist in the middle, `shifted` by heights of the
    hoist."""
    picture = 100 + 20 * stream(seed, "made", "background").standard_normal((64, 64))
    bare = np.ones((64, 64), bool)
    bare[16:48, 24:60] = False
    hoist = np.array([[0.4, 0.3], [0.4, 0.6]]) + 0.3 * shifted
    return Place(hoist=hoist, side=1.0, background=picture.astype(np.float32), bare=bare)


def features(
    wind: tuple[FloatArray, FloatArray],
    *,
    seed: int,
    other: float = 0.0,
    where: Place | None = None,
) -> Features:
    """Six features, four of which follow the wind of the window, with noise.

    Args:
        other: by how much a feature that does not follow the wind is shifted, in its scatter:
            another flag.
    """
    times, speed = wind
    count = int((times[-1] + 1 / _RATE - 30.0) / STEP + 1e-6)
    starts = STEP * np.arange(count, dtype=np.float64)
    means = np.array([speed[(times >= a) & (times < a + STEP)].mean() for a in starts])
    noise = stream(seed, "made", "features").standard_normal((count, 6))
    values = noise.copy()
    values[:, :4] = (means[:, None] - 5.0) / 0.8 * np.array([1.0, -1.0, 0.5, 2.0]) + NOISE * noise[
        :, :4
    ]
    values[:, 5] += other
    layout = WindowLayout(
        frames=30, spacings=(0.04,), step=STEP, period=0.04, first=0.0, last=count * STEP
    )
    return Features(
        film="made",
        starts=starts,
        layout=layout,
        values=values,
        names=tuple("abcdef"),
        summaries=values.astype(np.float32),
        winds=means * 1.1 + 0.3,
        clip=np.zeros((30, 8, 8), np.uint8),
        place=where if where is not None else place(),
    )


def recording(
    *, seconds: float = 240.0, seed: int = 1, late: float = 0.0, clock: float = 0.0, **changes: Any
) -> Recording:
    """A film and a log of one sample a second, whose stamps are `late` seconds too early."""
    wind = gusts(seconds, seed=seed)
    samples = np.arange(-29.0, seconds + 29.0)
    read = np.interp(samples, *wind) + 0.05 * stream(seed, "made", "log").standard_normal(
        len(samples)
    )
    log = Log(times=samples - late, speed=read, clock=clock)
    return Recording(
        name="made",
        artifact="a" * 32,
        features=features(wind, seed=seed),
        log=log,
        sensor=Sensor(name="cup", accuracy=0.2),
    )


def model(*recordings: Recording) -> ReadingCalibration:
    """Calibrated on recordings, by default one of four minutes."""
    return calibrate_reading(recordings or (recording(),), network=NETWORK, size=SIZE, level=0.9)
