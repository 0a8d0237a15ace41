"""Bags as ROS writes them: plain CDR of ROS 2 and messages of ROS 1, by the mcap library's
writer."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray

from flagdata.core.arrays import UInt8Array
from tests.flagdata.ingest.mcap.conftest import NOON, STEP, encoded

TIME = "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
HEADER = (
    "std_msgs/Header header\n{}\n"
    + "=" * 80
    + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n"
)
HEADER += "string frame_id\n" + TIME
COMPRESSED = HEADER.format("string format\nuint8[] data")
PLAIN = HEADER.format(
    "uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data"
)
WIND = "builtin_interfaces/Time stamp\nfloat64 speed\nfloat64 direction\n" + TIME
WARM_WIND = WIND.replace("float64 speed", "float64 temperature\nfloat64 speed")


class Cdr:
    """A message of ROS 2, little-endian; of ROS 1 without header, alignment and the NUL behind a
    text."""

    def __init__(self, *, ros1: bool = False) -> None:
        self._data = bytearray()
        self._ros1 = ros1

    def put(self, kind: str, value: float) -> Cdr:
        if not self._ros1:
            self._data += bytes(-len(self._data) % struct.calcsize(kind))
        self._data += struct.pack("<" + kind, value)
        return self

    def stamp(self, instant: int) -> Cdr:
        return self.put("i", instant // 10**9).put("I", instant % 10**9)

    def text(self, text: str) -> Cdr:
        return self.data(text.encode() + (b"" if self._ros1 else b"\0"))

    def data(self, data: bytes) -> Cdr:
        self.put("I", len(data))
        self._data += data
        return self

    def done(self) -> bytes:
        return bytes(self._data) if self._ros1 else b"\0\1\0\0" + bytes(self._data)


def gray(k: int) -> UInt8Array:
    """A picture (48, 64) of one gray, by its number."""
    return np.full((48, 64), 40 + 3 * k, np.uint8)


def compressed(instant: int, k: int, *, form: str = "PNG", said: str = "png") -> bytes:
    return Cdr().stamp(instant).text("cam").text(said).data(encoded(gray(k), form)).done()


def plain(instant: int, image: NDArray[np.generic], encoding: str) -> bytes:
    made = (
        Cdr()
        .stamp(instant)
        .text("cam")
        .put("I", image.shape[0])
        .put("I", image.shape[1])
        .text(encoding)
    )
    return made.put("B", 0).put("I", image.strides[0]).data(image.tobytes()).done()


def direction(instant: int) -> float:
    """Of the wind [deg], changing from second to second."""
    return 200.0 + instant // 10**9 % 7


def wind(instant: int, speed: float, *, temperature: float | None = None) -> bytes:
    made = Cdr().stamp(instant)
    if temperature is not None:
        made.put("d", temperature)
    return made.put("d", speed).put("d", direction(instant)).done()


@contextmanager
def bag(path: Path) -> Iterator[Writer]:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="test")
        yield writer
        writer.finish()


def channel(writer: Writer, topic: str, name: str, definition: str) -> int:
    """A channel of its own, whether the topic has one or not."""
    schema = writer.register_schema(name, "ros2msg", definition.encode())
    return writer.register_channel(topic, "cdr", schema)


def film(path: Path, numbers: Sequence[int], *, topic: str = "/cam") -> Path:
    """A bag of PNG pictures of these numbers, each 40 ms after the one before, counted from
    noon."""
    with bag(path) as writer:
        camera = channel(writer, topic, "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in numbers:
            at = NOON + k * STEP
            writer.add_message(camera, at, compressed(at, k % 70), at)
    return path
