"""MCAP files as other programs write them: by the mcap library and Foxglove's own schemas."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import CompressionType, Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from PIL import Image

from flagdata.core.arrays import UInt8Array

NOON = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z
STEP = 40_000_000
FRAMES = 50
LATE = 15_000_000  # a picture is logged 15 ms after its exposure


def pictures() -> list[UInt8Array]:
    """Gray pictures (48, 64), each all of one value, 40 and up by 3."""
    return [np.full((48, 64), 40 + 3 * k, np.uint8) for k in range(FRAMES)]


def stamped(message: Any, k: int) -> Any:
    message.timestamp.seconds, message.timestamp.nanos = divmod(NOON + k * STEP, 1_000_000_000)
    return message


def encoded(image: UInt8Array, form: str) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, form)
    return buffer.getvalue()


def videos(codec: str) -> list[bytes]:
    """The pictures as packets of a video without B-frames, a key frame every ten, Annex B."""
    context: Any = av.CodecContext.create(codec, "w")
    context.width, context.height, context.pix_fmt = 64, 48, "yuv420p"
    context.time_base, context.framerate = Fraction(1, 25), Fraction(25)
    context.gop_size, context.max_b_frames, context.thread_count = 10, 0, 1
    context.options = {"tune": "zerolatency"}
    packets: list[bytes] = []
    for k, image in enumerate(pictures()):
        frame = av.VideoFrame.from_ndarray(
            np.repeat(image[..., None], 3, axis=2), format="rgb24"
        ).reformat(format="yuv420p")
        frame.pts = k
        packets += [bytes(packet) for packet in context.encode(frame)]
    return packets + [bytes(packet) for packet in context.encode(None)]


@pytest.fixture(scope="session")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of a robot: a PNG, a JPEG and a raw topic, H.264, a wind in JSON, a text; zstd, topics
    interleaved."""
    path = tmp_path_factory.mktemp("mcap") / "drive.mcap"
    packets = videos("libx264")
    with path.open("wb") as stream, ProtobufWriter(stream) as writer:
        for k, image in enumerate(pictures()):
            raw = RawImage(width=64, height=48, encoding="rgb8", step=200)
            raw.data = np.pad(
                np.repeat(image[..., None], 3, axis=2).reshape(48, 192), ((0, 0), (0, 8))
            ).tobytes()
            messages = {
                "/png": CompressedImage(format="png", data=encoded(image, "PNG")),
                "/jpeg": CompressedImage(format="jpeg", data=encoded(image, "JPEG")),
                "/raw": raw,
                "/video": CompressedVideo(format="h264", data=packets[k]),
            }
            for topic, message in messages.items():
                at = NOON + k * STEP
                writer.write_message(
                    topic, stamped(message, k), log_time=at + LATE, publish_time=at + LATE
                )
    return path


@pytest.fixture
def write_json(tmp_path: Path) -> Callable[..., Path]:
    """Writes an MCAP file of JSON topics: topic → messages, one every 100 ms from noon."""

    def write(topics: dict[str, list[dict[str, Any]]], *, name: str = "log.mcap") -> Path:
        path = tmp_path / name
        with path.open("wb") as stream:
            writer = Writer(stream, compression=CompressionType.LZ4)
            writer.start(profile="", library="test")
            for topic, messages in topics.items():
                schema = writer.register_schema(
                    name=topic.strip("/"), encoding="jsonschema", data=b"{}"
                )
                channel = writer.register_channel(
                    topic=topic, message_encoding="json", schema_id=schema
                )
                for k, message in enumerate(messages):
                    at = NOON + k * 100_000_000
                    writer.add_message(
                        channel, log_time=at, publish_time=at, data=json.dumps(message).encode()
                    )
            writer.finish()
        return path

    return write
