"""A small lake of films whose waves depend on the wind, for the tests of training and of what is
trained."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.core.schema import Kind
from flagdata.dataset import clip_rows
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries

PERIOD = 40_000_000
START = 1_577_836_800_000_000_000
FILM_FRAMES = 14
SIDES = {"train": (10, 2), "validation": (6, 1), "test": (6, 2)}
"""Simulations of a side, and films of each."""


def film(wind: float, look: int) -> UInt8Array:
    """(frames, 40, 48): waves across a patch, whose frequency is in proportion to the wind; places
    differ by look."""
    rng = np.random.default_rng(look)
    t = np.arange(FILM_FRAMES)[:, None, None] / 25
    y, x = np.mgrid[0:40, 0:48]
    phase, dx, dy = rng.uniform(0, 6), rng.uniform(-3, 3), rng.uniform(-3, 3)
    patch = np.exp(-(((x - 24 - dx) / 12) ** 4) - ((y - 20 - dy) / 9) ** 4)
    waves = np.cos(0.5 * x - 2 * np.pi * (0.9 * wind + 1) * t + phase)
    return np.clip(110 + 80 * patch * waves + rng.normal(0, 2, waves.shape), 0, 255).astype(
        np.uint8
    )


def write_film(path: Path, wind: float, look: int, *, period: int = PERIOD) -> None:
    times = START + np.arange(FILM_FRAMES, dtype=np.int64) * period
    with RecordWriter(path, metadata={"camera": {"name": "made"}}) as record:
        for time, frame in zip(times.tolist(), film(wind, look), strict=True):
            record.frame(log_time=time, publish_time=time, timestamp=time, image=frame)
        seconds = START + np.arange(-70, 2, dtype=np.int64) * 1_000_000_000
        record.wind(
            WindSeries(
                time=seconds,
                channels={"wind_speed": np.full(len(seconds), wind)},
                flags=np.zeros(len(seconds), dtype=np.uint16),
                sensor=Sensor(name="cup"),
            )
        )
        bending = {f"bending.{index}": 3e-5 * 1.1**look for index in range(15)}
        truth = {"wind_speed": wind, "area_weight": 0.1 + 0.007 * (look % 10), **bending}
        record.truth(truth, log_time=START)


def fill(lake: Lake, name: str = "made", *, period: int = PERIOD, strongest: float = 10.0) -> None:
    """The films of all sides, as a build leaves them."""
    rng = np.random.default_rng(1)
    for number, (side, (simulations, films)) in enumerate(SIDES.items()):
        with lake.transaction(f"build {name}: {side}") as transaction:
            for index in range(simulations * films):
                seed = 1000 * number + index % simulations
                wind = float(np.random.default_rng(seed).uniform(0, strongest))
                staged = transaction.staging(".mcap")
                write_film(staged, wind, int(rng.integers(1 << 30)) % 1000, period=period)
                stored = transaction.put(staged)
                record = Record.open(lake.object_path(stored))
                recording = Artifact(
                    kind=Kind.RECORDING,
                    name=f"{name}-{side}-{index:05d}",
                    dataset=name,
                    side=side,
                    seed=seed,
                    object=stored,
                    recipe={"film": index, "side": side},
                    start=START,
                    end=START + (FILM_FRAMES - 1) * period,
                    frame_count=FILM_FRAMES,
                    rate=1e9 / period,
                )
                transaction.add(recording)
                for clip in clip_rows(record, recording, frames=12):
                    transaction.add(clip)


@pytest.fixture(scope="session")
def lake_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lake with the data set "made", tagged v1; tests do not write to it."""
    path = tmp_path_factory.mktemp("models") / "lake"
    lake = Lake.create(path)
    fill(lake)
    lake.tag("v1")
    return path
