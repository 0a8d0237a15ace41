"""A lake with one artifact of each sort that a page shows differently."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, MeshSequence, write_meshes
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.view import Media, Site
from tests.flagdata.export.conftest import jpeg, picture

SECOND = 1_000_000_000
START = 1_777_636_800 * SECOND  # 2026-05-01T12:00:00Z
FRAMES = 150
PERIOD = 40_000_000
NAME = "flag <b>&amp;</b> 旗"
CURVE = {
    "schema": "flagdata.lag-curve/1",
    "offset": [-2.0, -1.0, 0.0, 1.0, 2.0],
    "score": [0.0, 1.0, 9.0, 1.0, None],
    "evidence": [0.5, -0.5, 20.0, 0.5, 0.0],
    "chance_score": 5.0,
}


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What was put into the lake.

    Attributes:
        jpegs: the bytes of the frames of the recording, which has 150, one every 40 ms.
        wind: (90,) speed of each second from 60 s before the first frame on [m/s].
    """

    lake: Lake
    recording: str
    clip: str
    meshes: str
    network: str
    jpegs: tuple[bytes, ...]
    wind: FloatArray

    @property
    def site(self) -> Site:
        return Site(lake=self.lake, media=Media(self.lake), base="/key/")


@pytest.fixture
def shown(lake: Lake) -> Shown:
    jpegs = tuple(jpeg(picture(index % 100)) for index in range(FRAMES))
    times = START + PERIOD * np.arange(FRAMES)
    speed = 4.0 + np.arange(90) / 100
    wind = WindSeries(
        time=START + SECOND * (np.arange(90) - 60),
        channels={"wind_speed": speed},
        flags=np.zeros(90, dtype=np.uint16),
        sensor=Sensor(name="cup", accuracy=0.1),
    )
    with lake.transaction("all sorts") as tx:
        path = tx.staging(".mcap")
        with RecordWriter(path, metadata={}) as writer:
            writer.wind(wind)
            writer.attach(
                "alignment.json",
                json.dumps(CURVE).encode(),
                media_type="application/json",
                log_time=START,
            )
            for time, data in zip(times.tolist(), jpegs, strict=True):
                writer.frame(log_time=time, publish_time=time, timestamp=time, image=data)
        finding = {"kind": "gaps", "severity": "warning", "what": "<i>two</i>"}
        report = {"offset": 0.0, "sigma": 0.2, "findings": [finding]}
        recording = Artifact(
            kind=Kind.RECORDING,
            name=NAME,
            object=tx.put(path),
            start=int(times[0]),
            end=int(times[-1]),
            frame_count=FRAMES,
            rate=25.0,
            clock_method="estimated",
            clock_offset=0.0,
            clock_sigma=0.2,
            report=json.dumps(report),
        )
        clip = Artifact(
            kind=Kind.CLIP,
            name="clip",
            object=recording.object,
            parents=(recording.id,),
            recording=recording.id,
            start=int(times[30]),
            end=int(times[59]),
            frame_first=30,
            frame_count=30,
            wind=4.5,
            wind_sigma=0.1,
        )
        folder = tx.staging(".zarr")
        write_meshes(folder, _cloth())
        meshes = Artifact(
            kind=Kind.MESHES, name="cloth", object=tx.put(folder), frame_count=3, seed=1
        )
        network = Artifact(kind=Kind.NETWORK, name="wave", parents=(recording.id,))
        for artifact in (recording, clip, meshes, network):
            tx.add(artifact)
    return Shown(
        lake=lake,
        recording=recording.id,
        clip=clip.id,
        meshes=meshes.id,
        network=network.id,
        jpegs=jpegs,
        wind=speed,
    )


def _cloth() -> MeshSequence:
    """A square that turns about its hoist."""
    rest = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], dtype=np.float32)
    turned = [
        [[u * np.cos(a), u * np.sin(a), v] for u, v in rest.tolist()] for a in (0.0, 0.4, 0.8)
    ]
    return MeshSequence(
        time=np.arange(3) * PERIOD,
        positions=np.array(turned, dtype=np.float32),
        faces=np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32),
        rest=rest,
    )
