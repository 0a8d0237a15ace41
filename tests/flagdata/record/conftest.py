"""A small record and the pictures in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.record import Chunking, Coding, RecordWriter
from flagdata.record.signals import Sensor, WindSeries

START = 1_767_225_600_000_000_000  # 2026-01-01T00:00:00Z
PERIOD = 40_000_000
DEVICE_LAG = 3_700_000_123  # the camera's own clock is behind by this many ns
EXPOSURE = 1_250_000


@pytest.fixture(scope="session")
def pictures() -> np.ndarray:
    """(60, 48, 64) uint8: a bright bar that wanders over a gradient, all frames different."""
    column, row = np.meshgrid(np.arange(64), np.arange(48))
    bar = [
        40 * (np.abs(column - (8 + 0.8 * k) - 3 * np.sin(row / 9 + k / 4)) < 4) for k in range(60)
    ]
    return (60 + 2 * row + column + np.array(bar)).astype(np.uint8)


@pytest.fixture(scope="session")
def series() -> WindSeries:
    """200 samples at 20 Hz with a missing value, a flag, and the host's clock 80 ms late."""
    n = 200
    time = START + np.arange(n, dtype=np.int64) * 50_000_000
    speed = 5 + np.sin(np.arange(n) / 10)
    speed[17] = np.nan
    flags = np.zeros(n, dtype=np.uint16)
    flags[17] = 8
    flags[150] = 1
    return WindSeries(
        time=time,
        channels={"wind_speed": speed, "wind_direction": np.mod(np.arange(n) / 30, 2 * np.pi)},
        flags=flags,
        sensor=Sensor(name="cup", height=2.5, accuracy=0.1, accuracy_relative=0.02),
        host_time=time + 80_000_000,
    )


@pytest.fixture(scope="session")
def write(pictures: np.ndarray, series: WindSeries) -> Callable[..., Path]:
    """Writes the whole sample record to a path."""

    def write(
        path: Path, *, coding: Coding = Coding.JPEG, chunking: Chunking = Chunking.COMMITTED
    ) -> Path:
        with RecordWriter(
            path,
            metadata={"camera": {"codec": "test"}, "provenance": {"a": "ü"}},
            coding=coding,
            chunking=chunking,
        ) as writer:
            for k, image in enumerate(pictures):
                time = START + k * PERIOD
                writer.frame(
                    log_time=time,
                    publish_time=time - DEVICE_LAG,
                    timestamp=time + EXPOSURE,
                    image=image,
                )
            writer.wind(series)
            writer.truth({"bending": 1e-6, "area_weight": 0.284}, log_time=START)
            writer.attach(
                "log.csv", b"time,speed\n" * 20_000, media_type="text/csv", log_time=START
            )
            writer.attach("note.txt", b"by hand", media_type="text/plain", log_time=START)
        return path

    return write


@pytest.fixture(scope="session")
def sample(tmp_path_factory: pytest.TempPathFactory, write: Callable[..., Path]) -> Path:
    return write(tmp_path_factory.mktemp("record") / "sample.mcap")
