"""Writes a record: frames, wind, parameters and attachments into one MCAP file, streaming, with
reproducible bytes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import simplejpeg
from mcap.well_known import MessageEncoding, SchemaEncoding

from flagdata.core.arrays import IntArray, UInt8Array
from flagdata.core.clock_model import ClockModel
from flagdata.core.schema import (
    FORMAT_VERSION,
    TOPIC_IMAGE,
    TOPIC_TRUTH,
    TOPIC_WIND,
    TOPIC_WIND_1HZ,
)
from flagdata.errors import ConflictError, InputError, LimitError, TimeError, UsageError
from flagdata.record import messages
from flagdata.record.averaging import average
from flagdata.record.key_frames import is_key
from flagdata.record.mcap_file import MessageBlock
from flagdata.record.metadata import CLOCK, SENSOR, sensor_metadata
from flagdata.record.record_checksums import CHECKSUMS, ChecksummedFile
from flagdata.record.record_file import Output
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS

if TYPE_CHECKING:
    from flagdata.record.video_archive import VideoEncoder
import zlib
from collections.abc import Iterator

from flagdata.record.message_payloads import Payloads, means, samples

PIECE = 1 << 20
"""Bytes read at a time."""
QUICK_ABOVE = 8 << 20
"""Bytes from which an attachment is packed for speed: zlib's level 1 takes a quarter of level 9's
time on a log."""
_GZIP = 31  # wbits of zlib for a gzip stream, whose header then holds neither name nor time


def pieces_of(path: Path, size: int) -> Iterator[bytes]:
    """Yields the content of a file of `size` bytes.

    Raises:
        InputError: it cannot be read.
        ConflictError: it has another size by now.
    """
    done = 0
    try:
        with path.open("rb") as stream:
            while piece := stream.read(PIECE):
                done += len(piece)
                yield piece
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", where=str(path), fix="check its permissions"
        ) from None
    if done != size:
        raise ConflictError(
            f"the file had {size} bytes and then {done}",
            where=str(path),
            fix="ingest it when it is complete",
        )


def compress_pieces(data: Iterable[bytes], size: int) -> list[bytes] | None:
    """Compresses `data` of `size` bytes by gzip, in pieces; `None` where that is not smaller."""
    level = 1 if size > QUICK_ABOVE else 9
    coder = zlib.compressobj(level, zlib.DEFLATED, _GZIP)
    out = [coder.compress(piece) for piece in data]
    out.append(coder.flush())
    pieces = [piece for piece in out if piece]
    return pieces if sum(map(len, pieces)) < size else None


JPEG_QUALITY = 90
FRAME_ID = "camera"
PROFILE = "flagdata"
ATTACHMENT_LIMIT = 256 << 20
COMPRESS_ATTACHMENTS_ABOVE = 64 << 10
GZIP_SUFFIX = (
    "+gzip"  # of the media type of an attachment that was packed here (RFC 8460, section 6.5)
)
MEAN_PERIOD = 1.0  # s, of the derived means on schema.TOPIC_WIND_1HZ
_ROWS_AT_ONCE = 16_384  # samples made into bytes together


class Chunking(StrEnum):
    """How often data becomes safe against a crash, against how directly it is read afterwards."""

    COMMITTED = "committed"
    """Chunks of 1 MiB, for a file that is written in one go."""
    LIVE = "live"
    """Chunks of 256 KiB, and one at least every second of log time, for a file written while
    recording."""


class Coding(StrEnum):
    """How frames are stored."""

    JPEG = "jpeg"
    """foxglove.CompressedImage: every frame reached alone."""
    H264 = "h264"
    """foxglove.CompressedVideo: for archives, see `flagdata.record.video_archive`."""


CHUNK_BYTES = {Chunking.COMMITTED: 1 << 20, Chunking.LIVE: 256 << 10}


def library_name() -> str:
    """Returns what the header of a record says wrote it: the format, not the program's version, so
    that bytes last."""
    return f"flagdata format {FORMAT_VERSION}"


class RecordWriter:
    """Writes one record; a context manager. Chunks are not compressed, so that readers reach a
    frame directly.

    Leaving the block normally completes the file. Leaving it by an exception, or a crash, leaves a
    file without a
    summary: `salvage` recovers its whole chunks. The same calls give the same bytes.

    Args:
        path: the file to create; it must not exist.
        metadata: MCAP metadata records, name → key → value ("camera", "provenance", …).
        chunking: see `Chunking`.
        coding: see `Coding`.
        quality: JPEG quality of frames given as arrays, 1 to 100.

    Raises:
        ConflictError: `path` exists.
        FlagdataError: the disk refuses it (no space, no permission, a file too large), now or at
            any later call.
    """

    def __init__(
        self,
        path: Path,
        *,
        metadata: Mapping[str, Mapping[str, str]],
        chunking: Chunking = Chunking.COMMITTED,
        coding: Coding = Coding.JPEG,
        quality: int = JPEG_QUALITY,
    ) -> None:
        if not 1 <= quality <= 100:
            raise UsageError(
                f"JPEG quality {quality} is not between 1 and 100", fix="leave it at the default"
            )
        if CHECKSUMS in metadata:
            raise ConflictError(
                f"metadata {CHECKSUMS!r} is the record's own", where=str(path), fix="rename it"
            )
        self.path = path
        self._quality = quality
        self._chunking = chunking
        self._coding = coding
        self._video: VideoEncoder | None = None
        self._stream = Output(path)
        self._writer = ChecksummedFile(
            self._stream, chunk_size=CHUNK_BYTES[chunking], profile=PROFILE, library=library_name()
        )
        self._names: set[str] = set()
        self._channels: dict[str, int] = {}
        self._sequences: dict[str, int] = {}
        self._last_frame: tuple[int, int] | None = None
        self._flushed: int | None = None
        for name, values in metadata.items():
            self._metadata(name, values)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._stream:
            if kind is None:
                self._writer.finish()
                self._stream.sync()

    def frame(
        self, *, log_time: int, publish_time: int, timestamp: int, image: UInt8Array | bytes
    ) -> None:
        """Appends one frame.

        Args:
            log_time: instant on the common clock [UTC ns]; greater than the last frame's.
            publish_time: instant on the camera's own clock [UTC ns].
            timestamp: mid-exposure on the common clock [UTC ns].
            image: (height, width) uint8 gray, encoded here; or the bytes of a JPEG or of an H.264
                picture (Annex B, the first a key frame), as the coding is, kept as they are.

        Raises:
            InputError: an array of another shape or type, bytes that are no JPEG, or time that does
                not increase.
        """
        self._check_order(log_time, publish_time)
        if self._coding is Coding.JPEG:
            message = messages.CompressedImage(
                frame_id=FRAME_ID, format="jpeg", data=self._jpeg(image)
            )
        else:
            message = messages.CompressedVideo(
                frame_id=FRAME_ID, format="h264", data=self._picture(image)
            )
        messages.set_timestamp(message.timestamp, timestamp)
        self._message(TOPIC_IMAGE, message, log_time=log_time, publish_time=publish_time)

    def wind(self, series: WindSeries, *, clock: ClockModel | None = None) -> None:
        """Write all samples of an anemometer, and the means of its wind speed over 1 s of the
        common clock.

        A log without wind over ground (only apparent wind from a moving platform, say) has no
        means.

        Args:
            series: on the device's own clock.
            clock: of the device on the common clock; `None` where the device's clock is the common
                clock.

        Raises:
            ConflictError: called twice.
            InputError: the clock model folds time back over a jump.
        """
        if TOPIC_WIND in self._channels:
            raise ConflictError(
                "the record has wind already", where=str(self.path), fix="write one series a record"
            )
        self._metadata(SENSOR, sensor_metadata(series.sensor))
        common = series.time
        if clock is not None:
            common = clock.to_common(series.time)
            self._metadata(CLOCK + "/" + clock.device, {"model": clock.to_json()})
        aligned = replace(series, time=common)
        for first in range(0, len(series), _ROWS_AT_ONCE):
            rows = slice(first, first + _ROWS_AT_ONCE)
            payloads = samples(series, common, rows)
            self._messages(
                TOPIC_WIND, messages.WindSample, payloads, common[rows], series.time[rows]
            )
        if "wind_speed" in series.channels:
            self._means(aligned)

    def truth(self, parameters: Mapping[str, float], *, log_time: int) -> None:
        """Write the parameters a simulated record was made with, by name, in SI.

        Raises:
            ConflictError: called twice.
            InputError: a value that is not finite.
        """
        if TOPIC_TRUTH in self._channels:
            raise ConflictError(
                "the record has parameters already", where=str(self.path), fix="write them once"
            )
        message = messages.TruthParameters()
        messages.set_timestamp(message.timestamp, log_time)
        for name in sorted(parameters):
            if not math.isfinite(parameters[name]):
                raise InputError(
                    f"parameter {name!r} is {parameters[name]}", fix="leave unknown parameters out"
                )
            message.parameters.add(name=name, value=parameters[name])
        self._message(TOPIC_TRUTH, message, log_time=log_time, publish_time=log_time)

    def attach(self, name: str, data: bytes, *, media_type: str, log_time: int) -> None:
        """Attaches a file (the vendor's log, a calibration). Above 64 KiB it is stored gzipped as
        `name`.gz where that is smaller; readers give it back by its own name.

        Raises:
            ConflictError: the name is taken.
            LimitError: more than 256 MiB.
        """
        self._check_attachment(name, len(data), media_type)
        self._attach(name, lambda: [data], len(data), media_type=media_type, log_time=log_time)

    def attach_file(self, name: str, path: Path, *, media_type: str, log_time: int) -> None:
        """Attaches the content of a file as `attach` does, without holding it in memory.

        Raises:
            ConflictError, LimitError: as `attach`.
            InputError: it cannot be read, or changed while it was.
        """
        size = self._check_attachment(name, path.stat().st_size, media_type)
        self._attach(
            name, lambda: pieces_of(path, size), size, media_type=media_type, log_time=log_time
        )

    def _check_attachment(self, name: str, size: int, media_type: str) -> int:
        """Returns the size, if such an attachment may be added; its name is taken from now on."""
        if size > ATTACHMENT_LIMIT:
            raise LimitError(
                f"attachment of {size} bytes",
                where=name,
                fix=f"attach at most {ATTACHMENT_LIMIT} bytes",
            )
        if f"attachment {name}" in self._names:
            raise ConflictError(
                f"attachment {name!r} is there already", where=str(self.path), fix="rename it"
            )
        self._names.add(f"attachment {name}")
        if media_type.endswith(GZIP_SUFFIX):
            raise InputError(
                f"media type {media_type!r} is reserved for attachments that the record itself "
                "compresses",
                fix="use application/gzip",
            )
        return size

    def _attach(
        self,
        name: str,
        read: Callable[[], Iterable[bytes]],
        size: int,
        *,
        media_type: str,
        log_time: int,
    ) -> None:
        gzipped = compress_pieces(read(), size) if size > COMPRESS_ATTACHMENTS_ABOVE else None
        if gzipped is not None:
            size, name, media_type = sum(map(len, gzipped)), f"{name}.gz", media_type + GZIP_SUFFIX
        data = read() if gzipped is None else gzipped
        self._writer.add_attachment(
            log_time=log_time, name=name, media_type=media_type, data=data, size=size
        )

    def _jpeg(self, image: UInt8Array | bytes) -> bytes:
        if not isinstance(image, bytes):
            return encode_jpeg(image, quality=self._quality)
        if not (image.startswith(b"\xff\xd8") and image.endswith(b"\xff\xd9")):
            raise InputError(
                "a frame's bytes are not a JPEG",
                fix="give a (height, width) uint8 array or a whole JPEG",
            )
        return image

    def _picture(self, image: UInt8Array | bytes) -> bytes:
        if isinstance(image, bytes):
            if not image.startswith((b"\x00\x00\x01", b"\x00\x00\x00\x01")):
                raise InputError(
                    "a frame's bytes are no H.264 picture", fix="give Annex B, or an array"
                )
            if TOPIC_IMAGE not in self._channels and not is_key(image):
                raise InputError("the first H.264 picture is no key frame", fix="begin with one")
            return image
        if self._video is None:
            _check_image(image)
            from flagdata.record.video_archive import (
                VideoEncoder,
            )  # FFmpeg, which a wind's record needs nothing of

            self._video = VideoEncoder(height=image.shape[0], width=image.shape[1])
        return self._video.encode(image)

    def _metadata(self, name: str, values: Mapping[str, str]) -> None:
        if name in self._names:
            raise ConflictError(
                f"metadata {name!r} is there already", where=str(self.path), fix="write it once"
            )
        self._names.add(name)
        self._writer.add_metadata(name, dict(values))

    def _means(self, aligned: WindSeries) -> None:
        averaged = average(aligned, MEAN_PERIOD)
        self._messages(
            TOPIC_WIND_1HZ, messages.WindMean, means(averaged), averaged.time, averaged.time
        )

    def _check_order(self, log_time: int, publish_time: int) -> None:
        if self._last_frame is not None and (
            log_time <= self._last_frame[0] or publish_time <= self._last_frame[1]
        ):
            raise InputError(
                f"a frame at {log_time} (device {publish_time}) does not follow "
                f"{self._last_frame[0]} "
                f"(device {self._last_frame[1]})",
                where=str(self.path),
                fix="give frames in order of time",
            )
        self._last_frame = (log_time, publish_time)

    def _message(self, topic: str, message: Any, *, log_time: int, publish_time: int) -> None:
        channel = self._channel(topic, type(message), min(log_time, publish_time))
        if self._chunking is Chunking.LIVE:
            self._flush_each_second(log_time)
        self._writer.add_message(
            channel_id=channel,
            log_time=log_time,
            data=message.SerializeToString(deterministic=True),
            publish_time=publish_time,
            sequence=self._sequences[topic],
        )
        self._sequences[topic] += 1

    def _messages(
        self,
        topic: str,
        kind: Any,
        payloads: Payloads,
        log_time: IntArray,
        publish_time: IntArray,
    ) -> None:
        """Add many messages of one topic, in order of log time."""
        first = 0
        while first < len(log_time):
            earliest = min(int(log_time[first:].min()), int(publish_time[first:].min()))
            channel = self._channel(topic, kind, earliest)
            last = len(log_time)
            if self._chunking is Chunking.LIVE:
                self._flush_each_second(int(log_time[first]))
                until = (self._flushed or 0) + NANOSECONDS
                last = max(first + 1, int(np.searchsorted(log_time, until)))
            rows = slice(first, last)
            block = MessageBlock(
                log_time=log_time[rows],
                publish_time=publish_time[rows],
                payload=payloads.data[rows],
                used=payloads.used[rows],
            )
            self._writer.add_messages(block, channel_id=channel, sequence=self._sequences[topic])
            self._sequences[topic] += last - first
            first = last

    def _channel(self, topic: str, kind: Any, earliest: int) -> int:
        """Returns the number of a topic's channel, for messages from `earliest` on [UTC ns]."""
        if earliest < 0:
            raise TimeError(
                "an instant before 1970, which MCAP cannot hold",
                where=f"{self.path}, {topic}",
                fix="set the device's start time",
            )
        if topic not in self._channels:
            schema = self._writer.register_schema(
                name=kind.DESCRIPTOR.full_name,
                encoding=SchemaEncoding.Protobuf,
                data=messages.descriptor_set(kind),
            )
            self._channels[topic] = self._writer.register_channel(
                topic=topic, message_encoding=MessageEncoding.Protobuf, schema_id=schema
            )
            self._sequences[topic] = 0
        return self._channels[topic]

    def _flush_each_second(self, log_time: int) -> None:
        if self._flushed is None:
            self._flushed = log_time
        elif abs(log_time - self._flushed) >= NANOSECONDS:
            self._writer.flush()
            self._flushed = log_time


def encode_jpeg(image: UInt8Array, *, quality: int = JPEG_QUALITY) -> bytes:
    """Encodes a (height, width) uint8 gray image as JPEG.

    Raises:
        InputError: another shape or type.
    """
    _check_image(image)
    return simplejpeg.encode_jpeg(
        np.ascontiguousarray(image)[..., None], quality=quality, colorspace="GRAY"
    )


def _check_image(image: UInt8Array) -> None:
    if image.ndim != 2 or image.dtype != np.uint8 or image.size == 0:
        raise InputError(
            f"a frame cannot have the shape {image.shape} and the type {image.dtype}",
            fix="give a (height, width) uint8 gray image",
        )
