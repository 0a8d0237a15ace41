"""Self-made camera files whose frames carry their own number, so that a test reads which source
frame was chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.ingest import CameraOptions

SIDE = 96
CELL = 16
START = 1_777_629_600_000_000_000  # 2026-05-01T10:00:00Z


def numbered(number: int) -> UInt8Array:
    """(96, 96) gray picture of 6 × 6 cells: `number` in binary in the upper rows, then a white and
    a black corner."""
    cells = np.full((6, 6), 64, dtype=np.uint8)
    for bit in range(18):
        cells[bit // 6, bit % 6] = 255 if number >> bit & 1 else 0
    cells[5, 0], cells[5, 5] = 255, 0
    return np.kron(cells, np.ones((CELL, CELL), dtype=np.uint8))


def number_of(image: UInt8Array) -> int:
    """The number in a square picture of any size that shows all of `numbered`."""
    cell = image.shape[0] / 6
    middle = [round((i + 0.5) * cell) for i in range(6)]
    return sum(int(image[middle[bit // 6], middle[bit % 6]] > 128) << bit for bit in range(18))


PLAIN = CameraOptions(start=START, size=SIDE)
"""Options under which the numbered pictures come out one to one."""


def write_video(
    path: Path,
    stamps: Sequence[int],
    *,
    tick: Fraction = Fraction(1, 1000),
    codec: str = "libx264",
    container: str | None = None,
    pixel_format: str = "yuv420p",
    encoder: dict[str, str] | None = None,
    muxer: dict[str, str] | None = None,
    metadata: dict[str, str] | None = None,
    rotation: int | None = None,
    aspect: Fraction | None = None,
    picture: Callable[[int], UInt8Array] = numbered,
    rate: int | Fraction = 25,
) -> Path:
    """Writes a file of numbered frames, one for each of `stamps` (in units of `tick`)."""
    with av.open(str(path), "w", format=container, options=muxer or {}) as out:
        out.metadata.update(metadata or {})
        first = picture(0)
        stream = out.add_stream(codec, rate=rate)
        stream.width, stream.height = first.shape[1], first.shape[0]
        stream.pix_fmt = pixel_format
        stream.codec_context.time_base = tick
        stream.codec_context.thread_count = 1
        if encoder is None and codec == "libx264":
            encoder = {"preset": "ultrafast", "crf": "12"}
        stream.options = encoder or {}
        if rotation is not None:
            stream.set_display_rotation(rotation)
        if aspect is not None:
            stream.codec_context.sample_aspect_ratio = aspect
        for number, stamp in enumerate(stamps):
            frame = av.VideoFrame.from_ndarray(picture(number), format="gray").reformat(
                format=pixel_format, threads=1
            )
            frame.pts, frame.time_base = stamp, tick
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


@pytest.fixture(scope="session")
def cfr60(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of H.264 at 60 Hz in MP4, without B-frames, a key frame every 12."""
    path = tmp_path_factory.mktemp("cfr") / "cfr60.mp4"
    return write_video(
        path,
        range(120),
        tick=Fraction(1, 60),
        rate=60,
        encoder={"preset": "ultrafast", "crf": "12", "g": "12", "bf": "0"},
    )
