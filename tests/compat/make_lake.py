"""Writes the archive of a small lake that the compatibility tests open: `python
tests/compat/make_lake.py OUT.tar.xz`.

Run it once for each `schema.FORMAT_VERSION`, with the code of that version, and commit the result
as lake_v<N>.tar.xz; an archive is never made again once its version has been released. The lake has
a record with frames and wind, a mesh sequence, a clip of the record, a tag, a branch with a row of
its own, a withdrawn row, and a merged catalog. Since format 3 record and clip are of a data set.
"""

import sys
import tarfile
import tempfile
from pathlib import Path

import numpy as np

from flagdata.core.schema import Kind, SampleFlag
from flagdata.lake import Artifact, Lake, MeshSequence, write_meshes
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries

START = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z
PERIOD = 40_000_000


def write_record(path: Path) -> None:
    with RecordWriter(path, metadata={"camera": {"name": "compat"}}) as writer:
        wind = WindSeries(
            time=START + np.arange(8, dtype=np.int64) * 250_000_000,
            channels={"wind_speed": np.linspace(4.0, 5.75, 8)},
            flags=np.full(8, SampleFlag.OK, dtype=np.uint16),
            sensor=Sensor(name="compat"),
        )
        writer.wind(wind)
        for i in range(40):
            time = START + i * PERIOD
            image = np.full((300, 300), 5 * i, dtype=np.uint8)
            writer.frame(
                log_time=time, publish_time=time - 1_000_000_000, timestamp=time, image=image
            )


def fill(lake: Lake) -> None:
    with lake.transaction("a recording and its clip") as tx:
        path = tx.staging(".mcap")
        write_record(path)
        name = tx.put(path)
        recording = Artifact(
            kind=Kind.RECORDING,
            name="field",
            object=name,
            source_hash="a" * 64,
            start=START,
            end=START + 39 * PERIOD,
            frame_first=0,
            frame_count=40,
            rate=25.0,
            session="s1",
            day="2026-05-01",
            dataset="compat",
            side="train",
            recipe={"crop": [0, 0, 300, 300]},
        )
        tx.add(recording)
        clip = Artifact(
            kind=Kind.CLIP,
            name="field clip 0",
            object=name,
            parents=(recording.id,),
            recording=recording.id,
            start=START,
            end=START + 29 * PERIOD,
            frame_first=0,
            frame_count=30,
            wind=4.5,
            wind_sigma=0.25,
            dataset="compat",
            side="train",
            quality=("low-coverage",),
            report='[{"kind": "low-coverage"}]',
        )
        tx.add(clip)
    lake.tag("v1")
    lake.branch("simulated", at="v1")
    with lake.transaction("a mesh sequence", branch="simulated") as tx:
        path = tx.staging(".zarr")
        meshes = MeshSequence(
            time=np.arange(3, dtype=np.int64) * PERIOD,
            positions=np.arange(36, dtype=np.float32).reshape(3, 4, 3),
            faces=np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
            rest=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32),
            attributes={"wind": 4.0},
        )
        write_meshes(path, meshes)
        tx.add(
            Artifact(
                kind=Kind.MESHES,
                name="square",
                object=tx.put(path),
                seed=7,
                parameters='{"wind": 4.0}',
            )
        )
    with lake.transaction("by mistake") as tx:
        mistake = Artifact(kind=Kind.MODEL, name="mistake", recipe={"by": "mistake"})
        tx.add(mistake)
    lake.withdraw([mistake.id], "a mistake")
    for i in range(30):  # so that the catalog has been merged and has a checkpoint
        with lake.transaction(f"measurement {i}") as tx:
            tx.add(Artifact(kind=Kind.MEASUREMENT, name=f"measurement {i}", recipe={"number": i}))


def main(target: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        lake = Lake.create(Path(folder) / "lake")
        fill(lake)
        with tarfile.open(target, "w:xz") as archive:
            archive.add(lake.path, arcname="lake")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
