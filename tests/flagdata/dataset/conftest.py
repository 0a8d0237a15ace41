"""Small lakes of made recordings, real-like and simulated, for the tests of the dataset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from flagdata.core.clock_model import ClockModel
from flagdata.core.schema import Kind
from flagdata.dataset import clip_rows
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries

NS = 1_000_000_000
PERIOD = NS // 25
NOON = 1_777_636_800 * NS  # 2026-05-01T12:00:00Z
DAY = 86_400 * NS


def picture(seed: int, index: int, size: int) -> np.ndarray:
    """A smooth gray picture that differs by recording and frame, so that JPEG keeps it nearly
    exactly."""
    y, x = np.mgrid[0:size, 0:size] / size
    return (128 + 60 * np.sin(2 * x + seed) + 60 * np.cos(2 * y + index / 7)).astype(np.uint8)


def wind_series(
    start: int, seconds: int, *, mean: float = 5.0, missing: tuple[int, int] = (0, 0)
) -> WindSeries:
    """1 Hz wind from `start`, a gust of 12 s about `mean`; rows of the range `missing` are left
    out."""
    index = np.array(
        [k for k in range(seconds) if not missing[0] <= k < missing[1]], dtype=np.int64
    )
    return WindSeries(
        time=start + index * NS,
        channels={"wind_speed": mean + 0.5 * np.sin(2 * np.pi * index / 12)},
        flags=np.zeros(len(index), dtype=np.uint16),
        sensor=Sensor(name="cup", accuracy=0.2),
    )


@dataclass(frozen=True, kw_only=True)
class Made:
    """A recording to make: `frames` frames from `start`, wind from 90 s before, clock σ 0.1 s."""

    number: int
    session: str | None = None
    start: int = NOON
    frames: int = 95
    size: int = 32
    mean: float = 5.0
    clock_sigma: float = 0.1
    missing: tuple[int, int] = (0, 0)
    seed: int | None = None
    truth: dict[str, float] | None = None
    skip_after: int | None = None
    """The frame after which two seconds of frames are missing."""


def write_record(path, made: Made) -> Record:
    times = made.start + np.arange(made.frames, dtype=np.int64) * PERIOD
    if made.skip_after is not None:
        times[made.skip_after + 1 :] += 2 * NS
    with RecordWriter(path, metadata={"camera": {"name": f"camera {made.number}"}}) as writer:
        if made.truth is None:
            seconds = 90 + int((times[-1] - made.start) // NS) + 1
            writer.wind(
                wind_series(made.start - 90 * NS, seconds, mean=made.mean, missing=made.missing)
            )
        else:
            writer.truth(made.truth, log_time=int(times[0]))
        for index, time in enumerate(times.tolist()):
            image = picture(made.number, index, made.size)
            writer.frame(log_time=time, publish_time=time - 3 * NS, timestamp=time, image=image)
    return Record.open(path)


def add_recording(lake: Lake, made: Made) -> str:
    """Commit the recording and its clips in one transaction; returns the recording's identity."""
    with lake.transaction(f"recording {made.number}") as transaction:
        path = transaction.staging(".mcap")
        record = write_record(path, made)
        clock = None
        if made.seed is None:
            clock = ClockModel.identity(
                "camera",
                "wind",
                start=made.start - 10 * NS,
                end=made.start + 600 * NS,
                sigma=made.clock_sigma,
            )
        source = None
        if made.seed is None:
            source = Artifact(
                kind=Kind.CAMERA, name=f"camera {made.number}", source_hash=f"{made.number:064x}"
            )
            transaction.add(source)
        recording = Artifact(
            kind=Kind.RECORDING,
            name=f"recording {made.number}",
            object=transaction.put(path),
            parents=(source.id,) if source else (),
            recipe={"number": made.number, "start": made.start},
            session=made.session,
            seed=made.seed,
            rate=25.0,
            clock_sigma=None if clock else 0.0,
            clock_model=clock.to_json() if clock else None,
        )
        record = Record.open(lake.object_path(recording.object))
        transaction.add(recording)
        for clip in clip_rows(record, recording):
            transaction.add(clip)
    return recording.id


@pytest.fixture(scope="session")
def field_lake(tmp_path_factory) -> Lake:
    """Eight real-like recordings of 3 clips on eight days at four sites, and eight simulated ones
    of 3 clips."""
    lake = Lake.create(tmp_path_factory.mktemp("lake") / "lake")
    for k in range(8):
        add_recording(
            lake, Made(number=k, session=f"site{k // 2}", start=NOON + k * DAY, mean=3.0 + k)
        )
    for k in range(8):
        truth = {"wind_speed": 2.0 + k, "bending": 1e-5 * (k + 1)}
        add_recording(lake, Made(number=100 + k, seed=k, truth=truth))
    lake.tag("v1")
    return lake


@pytest.fixture(scope="session")
def made():
    return Made
