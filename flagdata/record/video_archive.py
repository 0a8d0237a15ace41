"""H.264 for archives: 4 to 14 times smaller than JPEG, slower to reach a frame, since decoding
starts at a key frame.

As foxglove.CompressedVideo asks: Annex B, one picture a message, no B-frames, SPS and PPS on every
key frame. Gray values are the luma, full range, so that a decoded frame has the range it had.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import av
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import ColorRange

from flagdata.core.arrays import UInt8Array
from flagdata.errors import CorruptError, InputError

KEY_INTERVAL = 25
"""Frames from one key frame to the next."""
CONSTANT_RATE_FACTOR = 18
"""x264's quality: 41 to 42 dB on a flag of 352×288 (DynTex 571c110), where JPEG at quality 90 has
45 dB."""


class VideoEncoder:
    """Encodes gray frames one by one; each gives its picture at once (no look-ahead), so that a
    crash loses none.

    One thread and `cpu-independent`, so that the same frames give the same bytes on any machine
    with the same x264.

    Args:
        height, width: of all frames [px]; even, as 4:2:0 asks.
        rate_factor: x264's constant rate factor; smaller is better and larger in bytes.
        preset: x264's name of how long it searches, "medium", "veryfast".

    Raises:
        InputError: odd sizes.
    """

    def __init__(
        self,
        *,
        height: int,
        width: int,
        rate_factor: float = CONSTANT_RATE_FACTOR,
        preset: str = "medium",
    ) -> None:
        if height % 2 or width % 2:
            raise InputError(
                f"H.264 of {width}×{height} pixels", fix="use an even width and height, or JPEG"
            )
        self._shape = (height, width)
        self._count = 0
        codec: Any = av.CodecContext.create("libx264", "w")
        codec.width, codec.height, codec.pix_fmt = width, height, "yuv420p"
        codec.time_base, codec.framerate = Fraction(1, KEY_INTERVAL), Fraction(KEY_INTERVAL)
        codec.gop_size, codec.max_b_frames, codec.thread_count = KEY_INTERVAL, 0, 1
        codec.color_range = ColorRange.JPEG
        codec.options = {
            "crf": f"{rate_factor:g}",
            "preset": preset,
            "tune": "zerolatency",
            "x264-params": "cpu-independent=1:scenecut=0",
        }
        self._codec = codec

    def encode(self, image: UInt8Array) -> bytes:
        """Encodes the next picture, Annex B.

        Raises:
            InputError: another size or type than said.
        """
        if image.shape != self._shape or image.dtype != np.uint8:
            raise InputError(
                f"a frame of shape {image.shape} and type {image.dtype}, the first was "
                f"{self._shape} uint8",
                fix="give frames of one size",
            )
        frame = av.VideoFrame(self._shape[1], self._shape[0], "yuv420p")
        frame.color_range = ColorRange.JPEG
        frame.pts = self._count
        _plane(frame, 0)[:, : self._shape[1]] = image
        _plane(frame, 1)[:] = 128
        _plane(frame, 2)[:] = 128
        packets = self._codec.encode(frame)
        if len(packets) != 1:
            raise InputError(
                f"the H.264 encoder gave {len(packets)} pictures for frame {self._count}",
                fix="this build of libx264 ignores zerolatency; archive as JPEG",
            )
        self._count += 1
        return bytes(packets[0])


def decode(pictures: Iterable[bytes | memoryview], *, where: str) -> list[UInt8Array]:
    """Decode consecutive pictures, the first a key frame, to (height, width) gray.

    Raises:
        CorruptError: a picture that cannot be decoded.
    """
    codec: Any = av.CodecContext.create("h264", "r")
    codec.thread_count = 1
    codec.options = {"err_detect": "explode", "flags": "low_delay"}
    frames: list[UInt8Array] = []
    count = 0
    try:
        for picture in pictures:
            count += 1
            frames += [_gray(frame) for frame in codec.decode(av.Packet(bytes(picture)))]
        frames += [_gray(frame) for frame in codec.decode(None)]
    except FFmpegError as error:
        raise CorruptError(
            f"an H.264 picture cannot be decoded: {error}", where=where, fix="run flagdata verify"
        ) from None
    if len(frames) != count:
        raise CorruptError(
            f"{count} H.264 pictures gave {len(frames)} frames",
            where=where,
            fix="run flagdata verify",
        )
    return frames


def _plane(frame: av.VideoFrame, index: int) -> UInt8Array:
    plane: Any = frame.planes[index]
    return np.frombuffer(plane, dtype=np.uint8).reshape(-1, plane.line_size)[: plane.height]


def _gray(frame: av.VideoFrame) -> UInt8Array:
    return _plane(frame, 0)[:, : frame.width].copy()
