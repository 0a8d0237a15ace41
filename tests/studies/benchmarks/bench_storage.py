"""Records in a bucket: bytes and requests of one clip out of a long recording, by its parts and by
the whole object.

The server is moto's on loopback; requests and bytes are what a distant store would be asked for,
the seconds are not.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import stream
from flagdata.core.schema import CLIP_FRAMES
from flagdata.lake.objects import RemoteObjects
from flagdata.record import Record, RecordWriter
from flagdata.storage import RemotePath
from tests.s3 import BUCKET, SECRETS, moto

SIZE = 100 * 10**6
"""Bytes of the record's frames."""
_FRAME = 20_000  # bytes of a frame of 300×300 by day, see `bench-records.json`
_PERIOD = 40_000_000
_START = 1_767_225_600_000_000_000


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Requests, bytes and seconds of one clip, of a second one of the same record, and of the whole
    object before."""
    with tempfile.TemporaryDirectory() as folder, moto() as address:
        for name in [name for name in os.environ if name.startswith("AWS_")]:
            del os.environ[name]
        os.environ.update(SECRETS, AWS_REGION="us-east-1", AWS_ENDPOINT_URL=address)
        path = Path(folder) / "record.mcap"
        _write(path, seed)
        data = path.read_bytes()
        name = f"mcap/{hashlib.sha256(data).hexdigest()}"
        objects = RemoteObjects(RemotePath(BUCKET, "bench"))
        objects.path(name).upload(path)
        count = SIZE // _FRAME
        one, two = (
            int(first) for first in stream(seed, "clips").integers(0, count - CLIP_FRAMES, 2)
        )
        result: dict[str, Any] = {
            "record": {"bytes": len(data), "frames": count},
            "clip frames": CLIP_FRAMES,
        }
        os.environ["FLAGDATA_CACHE"] = f"{folder}/whole"
        with _counted() as tally:
            whole, result["whole object, a clip"] = _timed(
                lambda: Record.open(objects.existing(name)).jpegs(one, CLIP_FRAMES), tally
            )
        os.environ["FLAGDATA_CACHE"] = f"{folder}/parts"
        with _counted() as tally:
            parts, result["parts, opened and the first clip"] = _timed(
                lambda: Record.open(objects.readable(name)).jpegs(one, CLIP_FRAMES), tally
            )
            assert parts == whole
            record = Record.open(objects.readable(name))
            _, result["parts, another clip"] = _timed(lambda: record.jpegs(two, CLIP_FRAMES), tally)
            _, result["parts, the first clip again"] = _timed(
                lambda: record.jpegs(one, CLIP_FRAMES), tally
            )
    return result


def _write(path: Path, seed: int) -> None:
    rng = stream(seed, "pictures")
    bodies: list[UInt8Array] = [rng.integers(0, 255, _FRAME - 4, dtype=np.uint8) for _ in range(50)]
    with RecordWriter(path, metadata={"provenance": {}}) as writer:
        for k in range(SIZE // _FRAME):
            time_ns = _START + k * _PERIOD
            image = b"\xff\xd8" + bodies[k % len(bodies)].tobytes() + b"\xff\xd9"
            writer.frame(log_time=time_ns, publish_time=time_ns, timestamp=time_ns, image=image)


def _timed(
    read: Callable[[], list[bytes]], tally: dict[str, int]
) -> tuple[list[bytes], dict[str, Any]]:
    tally.update(requests=0, bytes=0)
    began = time.perf_counter()
    found = read()
    return found, {**tally, "seconds on loopback": round(time.perf_counter() - began, 4)}


@contextmanager
def _counted() -> Iterator[dict[str, int]]:
    """Requests for ranges and heads, and the bytes that they gave."""
    tally = {"requests": 0, "bytes": 0}
    ranges, one, head = RemotePath.read_ranges, RemotePath.read_range, RemotePath.stat

    def read_ranges(place: RemotePath, offsets: list[int], lengths: list[int]) -> list[bytes]:
        tally["requests"] += len(offsets)
        tally["bytes"] += sum(lengths)
        return ranges(place, offsets, lengths)

    def read_range(place: RemotePath, offset: int, length: int) -> bytes:
        tally["requests"] += 1
        tally["bytes"] += length
        return one(place, offset, length)

    def stat(place: RemotePath) -> Any:
        tally["requests"] += 1
        return head(place)

    RemotePath.read_ranges, RemotePath.read_range, RemotePath.stat = read_ranges, read_range, stat  # type: ignore[method-assign]
    try:
        yield tally
    finally:
        RemotePath.read_ranges, RemotePath.read_range, RemotePath.stat = ranges, one, head  # type: ignore[method-assign]
