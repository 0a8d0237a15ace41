"""A small lake whose every frame, instant and wind value is known, made without the code that
exports it."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.core.arrays import FloatArray, IntArray, UInt8Array
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries

NOON = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z
SECOND = 1_000_000_000
WIDTH, HEIGHT = 64, 48
CLIP = 30
CAMERA_BEHIND = 7 * SECOND  # the camera's own clock shows 7 s less than the common one


@dataclass(frozen=True, kw_only=True)
class Known:
    """What was put into the lake.

    Attributes:
        lake: the lake.
        recording: artifact of the recording.
        clips: artifacts of its three clips, in order of time.
        times: (90,) instants of the frames, common clock.
        images: (90, 48, 64) the frames before JPEG.
        jpegs: the frames' bytes, 90.
        wind_time, wind_speed: (140,) anemometer samples, one a second from noon; speed grows by
            0.05 m/s a second.
    """

    lake: Lake
    recording: str
    clips: tuple[str, ...]
    times: IntArray
    images: UInt8Array
    jpegs: tuple[bytes, ...]
    wind_time: IntArray
    wind_speed: FloatArray


def picture(index: int) -> UInt8Array:
    """A gray picture (48, 64) that says its index: a smooth slope from 40, brighter by 1 level a
    frame."""
    return (40 + index + np.arange(HEIGHT)[:, None] + np.arange(WIDTH)[None, :] // 2).astype(
        np.uint8
    )


def jpeg(image: UInt8Array) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "JPEG", quality=95)
    return buffer.getvalue()


@pytest.fixture(scope="session")
def known(tmp_path_factory: pytest.TempPathFactory) -> Known:
    folder = tmp_path_factory.mktemp("export")
    lake = Lake.create(folder / "lake")
    # Steps of 40 ms and 33.366700 ms in turn, from 80 s after noon: a truly variable rate, exact in
    # nanoseconds.
    steps = np.where(np.arange(89) % 2 == 0, 40_000_000, 33_366_700)
    times = NOON + 80 * SECOND + np.concatenate([[0], np.cumsum(steps)])
    wind_time = NOON + SECOND * np.arange(140)
    wind_speed = 3.0 + 0.05 * np.arange(140)
    images = np.stack([picture(i) for i in range(90)])
    jpegs = tuple(jpeg(image) for image in images)
    with lake.transaction("a recording and its clips") as tx:
        path = tx.staging(".mcap")
        write_record(path, times, jpegs, wind_time, wind_speed)
        name = tx.put(path)
        recording = Artifact(
            kind=Kind.RECORDING,
            name="pier",
            object=name,
            source_hash="a" * 64,
            session="pier",
            day="2026-05-01",
            start=int(times[0]),
            end=int(times[-1]),
            frame_count=90,
            rate=27.3,
            clock_method="given",
            clock_offset=7.0,
            clock_drift=0.0,
            clock_sigma=0.02,
        )
        tx.add(recording)
        clips = [clip(recording, name, number, times) for number in range(3)]
        for artifact in clips:
            tx.add(artifact)
    return Known(
        lake=lake,
        recording=recording.id,
        clips=tuple(c.id for c in clips),
        times=times,
        images=images,
        jpegs=jpegs,
        wind_time=wind_time,
        wind_speed=wind_speed,
    )


def write_record(
    path: Path,
    times: IntArray,
    jpegs: tuple[bytes, ...],
    wind_time: IntArray,
    wind_speed: FloatArray,
) -> None:
    with RecordWriter(path, metadata={"provenance": {"source_name": "pier.mp4"}}) as writer:
        writer.wind(
            WindSeries(
                time=wind_time,
                channels={"wind_speed": wind_speed},
                flags=np.zeros(len(wind_time), dtype=np.uint16),
                sensor=Sensor(name="cup", accuracy=0.1),
            )
        )
        writer.attach("log.csv", b"time,speed\n", media_type="text/csv", log_time=int(wind_time[0]))
        for time, data in zip(times.tolist(), jpegs, strict=True):
            writer.frame(
                log_time=time, publish_time=time - CAMERA_BEHIND, timestamp=time, image=data
            )


def clip(recording: Artifact, name: str, number: int, times: IntArray) -> Artifact:
    first = CLIP * number
    return Artifact(
        kind=Kind.CLIP,
        name=f"pier {number}",
        object=name,
        parents=(recording.id,),
        recording=recording.id,
        session="pier",
        day="2026-05-01",
        start=int(times[first]),
        end=int(times[first + CLIP - 1]),
        frame_first=first,
        frame_count=CLIP,
        rate=27.3,
        wind=3.5 + number,
        wind_sigma=0.125,
        wind_coverage=1.0,
        wind_staleness=0.25,
        clock_method="given",
        clock_offset=7.0,
        clock_drift=0.0,
        clock_sigma=0.02,
        parameters=('{"density":0.2}', None, '{"damping":NaN}')[number],
        quality=("wind-stale",) if number == 1 else (),
    )
