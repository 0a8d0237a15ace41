"""Random clips of 30 frames out of one record: reading by offset against the mcap package, and JPEG
against H.264.

Frames are a travelling wave seen through sensor noise, 300×300 gray; all readers must return the
same pixels.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import simplejpeg
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import stream
from flagdata.core.schema import CLIP_FRAMES, FRAME_SIZE, TOPIC_IMAGE
from flagdata.record import Coding, Record, RecordWriter

FRAMES = {Coding.JPEG: 12_000, Coding.H264: 1_500}
CLIPS = 60
PERIOD = 40_000_000
START = 1_767_225_600_000_000_000
NOISE = 3.0  # gray levels, a camera by day

Reader = Callable[[int], UInt8Array]


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Clips a second on one thread (CPU time, median of `CLIPS`), and how exact each reader and
    coding is."""
    result: dict[str, Any] = {"clip": f"{CLIP_FRAMES} frames of {FRAME_SIZE}×{FRAME_SIZE}"}
    with tempfile.TemporaryDirectory() as folder:
        pictures = _pictures(seed)
        for coding, count in FRAMES.items():
            path = Path(folder) / f"{coding.value}.mcap"
            began = time.process_time()
            _write(path, pictures, count, coding)
            written = time.process_time() - began
            starts = (
                stream(seed, "starts", coding.value)
                .integers(0, count - CLIP_FRAMES, CLIPS)
                .tolist()
            )
            record = Record.open(path)
            index = _seconds(lambda record=record: record.frame_count)
            result[coding.value] = {
                "frames": count,
                "bytes_per_frame": path.stat().st_size / count,
                "psnr": _psnr(record, pictures),
                "write_frames_per_second": count / written,
                "index_seconds": index,
                "clips_per_second": {"flagdata": _speed(_by_offset(record), starts)},
            }
            if coding is Coding.JPEG:
                peers = {
                    "mcap, summary cached": _by_mcap(path),
                    "mcap, opened for each clip": _by_mcap_anew(path),
                }
                for name, peer in peers.items():
                    np.testing.assert_array_equal(
                        peer(starts[0]), record.frames(starts[0], CLIP_FRAMES)
                    )
                    result[coding.value]["clips_per_second"][name] = _speed(peer, starts)
                result[coding.value]["decoding_share"] = _decoding_share(record, starts)
    return result


def _pictures(seed: int) -> UInt8Array:
    """(50, 300, 300): two seconds that repeat."""
    rng = stream(seed, "pictures")
    row, column = np.mgrid[:FRAME_SIZE, :FRAME_SIZE]
    waves = [
        120 + 70 * np.sin((column + 30 * np.sin(row / 80)) / 20 - 2 * np.pi * k / 25)
        for k in range(50)
    ]
    noisy = np.array(waves) + rng.normal(0, NOISE, (50, FRAME_SIZE, FRAME_SIZE))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _write(path: Path, pictures: UInt8Array, count: int, coding: Coding) -> None:
    with RecordWriter(path, metadata={}, coding=coding) as record:
        for k in range(count):
            time_ = START + k * PERIOD
            record.frame(
                log_time=time_,
                publish_time=time_,
                timestamp=time_,
                image=pictures[k % len(pictures)],
            )


def _psnr(record: Record, pictures: UInt8Array) -> float:
    error = record.frames(0, len(pictures)).astype(np.float64) - pictures
    return float(10 * np.log10(255**2 / np.mean(error**2)))


def _by_offset(record: Record) -> Reader:
    return lambda first: record.frames(first, CLIP_FRAMES)


def _by_mcap(path: Path) -> Reader:
    reader = make_reader(path.open("rb"), decoder_factories=[DecoderFactory()])
    reader.get_summary()
    return lambda first: _clip(reader, first)


def _by_mcap_anew(path: Path) -> Reader:
    def read(first: int) -> UInt8Array:
        with path.open("rb") as file:
            return _clip(make_reader(file, decoder_factories=[DecoderFactory()]), first)

    return read


def _clip(reader: Any, first: int) -> UInt8Array:
    start = START + first * PERIOD
    found = reader.iter_decoded_messages(
        [TOPIC_IMAGE], starting_at=start, ending_before=start + CLIP_FRAMES * PERIOD
    )
    return np.stack(
        [simplejpeg.decode_jpeg(image.data, colorspace="GRAY")[..., 0] for *_, image in found]
    )


def _speed(reader: Reader, starts: list[int]) -> float:
    reader(starts[0])
    return 1 / float(np.median([_seconds(lambda first=first: reader(first)) for first in starts]))


def _seconds(action: Callable[[], object]) -> float:
    began = time.process_time()
    action()
    return time.process_time() - began


def _decoding_share(record: Record, starts: list[int]) -> float:
    """Part of a clip's time that is JPEG decoding alone."""
    pictures = {
        first: [record.jpeg(k) for k in range(first, first + CLIP_FRAMES)] for first in starts
    }

    def decode(first: int) -> list[UInt8Array]:
        return [simplejpeg.decode_jpeg(picture, colorspace="GRAY") for picture in pictures[first]]

    alone = np.median([_seconds(lambda first=first: decode(first)) for first in starts])
    return float(alone * _speed(_by_offset(record), starts))
