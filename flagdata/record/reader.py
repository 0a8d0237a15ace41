"""Reads a record: frames straight from their place in the file, wind, parameters, metadata and
attachments.

Nothing is given out that has changed since it was written: frames, channels and metadata are
compared with the record's checksums; in a record without any, whole chunks against MCAP's own, once
each.
"""

from __future__ import annotations

import functools
import weakref
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import simplejpeg
from google.protobuf.message import DecodeError

from flagdata.core.arrays import FloatArray, IntArray, UInt8Array
from flagdata.core.files.addresses import local_path
from flagdata.core.schema import TOPIC_IMAGE, TOPIC_TRUTH, TOPIC_WIND, TOPIC_WIND_1HZ
from flagdata.errors import CorruptError, InputError, NotFoundError, UsageError
from flagdata.recipes.retired_names import present_names
from flagdata.record import mcap_container, messages
from flagdata.record.key_frames import is_key
from flagdata.record.metadata import sensor_of
from flagdata.record.record_bytes import Bytes, open_bytes
from flagdata.record.signals import WindAverage, WindSeries
from flagdata.record.writer import ATTACHMENT_LIMIT, GZIP_SUFFIX, Coding, encode_jpeg
from flagdata.storage import Place

FRAME_PIXELS = 1 << 26
"""No frame of a record is larger [px]; a header that says so is damaged."""
SPAN_SLACK = 256 << 10
"""Bytes of other topics that one read of neighbouring frames may take along."""
_CODINGS: dict[Coding, Any] = {
    Coding.JPEG: messages.CompressedImage,
    Coding.H264: messages.CompressedVideo,
}
_VERIFY = "run flagdata verify"


class Record:
    """A record opened for reading. Cheap to open and to pickle: each process opens the file itself,
    when first needed, and reads the summary and the frame index once. Reads are by offset, so that
    a fork or threads share nothing.

    Of a record in a bucket the frames that are asked for are fetched, with the summary and their
    own part of the index; `frame_times`, `device_frame_times` and the wind need the heads of all
    messages of their topic.

    Attributes:
        path: the file, or its place in a bucket.
    """

    def __init__(self, path: Place) -> None:
        self.path = path
        self._sound: set[int] = set()  # indices of the chunks that were checked

    @classmethod
    def open(cls, path: Place) -> Record:
        """Open the record at `path` and check its container.

        Raises:
            NotFoundError: no such file.
            CorruptError: not a whole MCAP record.
        """
        record = cls(local_path(path) if isinstance(path, Path) else path)
        record._summary  # noqa: B018  read and checked here, kept for later
        return record

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self.path, "_sound": set()}

    def __repr__(self) -> str:
        return f"Record({str(self.path)!r})"

    @functools.cached_property
    def _file(self) -> Bytes:
        file = open_bytes(self.path)
        weakref.finalize(self, file.close)
        return file

    @functools.cached_property
    def _summary(self) -> mcap_container.Summary:
        return mcap_container.read_summary(self._file, where=str(self.path))

    @functools.cached_property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """The metadata records by name."""
        return mcap_container.read_metadata(self._file, self._summary, where=str(self.path))

    @property
    def has_checksums(self) -> bool:
        """Whether frames, channels and metadata have checksums of their own; old records have those
        of chunks only."""
        return self._summary.checksums is not None

    @property
    def topics(self) -> tuple[str, ...]:
        return tuple(sorted(self._summary.channels))

    @functools.cached_property
    def _frames(self) -> mcap_container.Messages:
        return self._messages(TOPIC_IMAGE)

    @functools.cached_property
    def coding(self) -> Coding:
        """How the frames are stored.

        Raises:
            NotFoundError: the record has no frames.
            InputError: frames of a schema that is neither.
        """
        where = str(self.path)
        if TOPIC_IMAGE not in self._summary.channels:
            raise NotFoundError(
                "the record has no frames", where=where, fix="name a camera or recording artifact"
            )
        schema = self._schema(TOPIC_IMAGE)
        names = {kind.DESCRIPTOR.full_name: coding for coding, kind in _CODINGS.items()}
        if schema not in names:
            raise InputError(
                f"{TOPIC_IMAGE} holds {schema}",
                where=where,
                fix=f"write it as one of {', '.join(names)}",
            )
        return names[schema]

    @functools.cached_property
    def _in_spans(self) -> bool:
        """Whether frames are found without the heads of all others."""
        remote = not isinstance(self.path, Path)
        return remote and mcap_container.in_order(
            self._file, self._summary, TOPIC_IMAGE, where=str(self.path)
        )

    @property
    def frame_count(self) -> int:
        checksums = self._summary.checksums
        return (
            checksums.channels[TOPIC_IMAGE].count
            if checksums is not None and self._in_spans
            else len(self._frames)
        )

    @property
    def frame_times(self) -> IntArray:
        """(n,) instants of the frames on the common clock [UTC ns]."""
        return self._frames.log_time

    @property
    def device_frame_times(self) -> IntArray:
        """(n,) instants of the frames on the camera's own clock [UTC ns]."""
        return self._frames.publish_time

    def times(self, first: int, count: int) -> IntArray:
        """Reads (count,) instants of consecutive frames from index `first` on the common clock [UTC
        ns].

        Raises:
            NotFoundError: the record has no such frames.
        """
        table = self._span(first, count)
        return table.log_time[first - table.first :][:count]

    def frames(self, first: int, count: int) -> UInt8Array:
        """Decodes `count` consecutive frames from index `first`: (count, height, width) gray.

        Raises:
            NotFoundError: the record has no such frames.
            CorruptError: a frame that cannot be decoded, or of another size than the first.
        """
        if self.coding is Coding.H264:
            return self._video_frames(first, count)
        pictures = self._payloads(first, count)
        where = str(self.path)
        try:
            height, width, _, _ = simplejpeg.decode_jpeg_header(pictures[0])
            if int(height) * int(width) > FRAME_PIXELS:
                raise CorruptError(
                    f"frame {first} claims {width}×{height} pixels", where=where, fix=_VERIFY
                )
            out = np.empty((count, int(height), int(width), 1), dtype=np.uint8)
            for i, picture in enumerate(pictures):
                decoded = simplejpeg.decode_jpeg(picture, colorspace="GRAY", buffer=out[i])
                if decoded.shape != out.shape[1:]:
                    raise CorruptError(
                        f"frame {first + i} is {decoded.shape[1]}×{decoded.shape[0]}, others "
                        f"{width}×{height}",
                        where=where,
                        fix="ingest the camera file again",
                    )
        except ValueError as error:
            raise CorruptError(
                f"frames {first} to {first + count - 1}: {error}", where=where, fix=_VERIFY
            ) from None
        return out[..., 0]

    def jpeg(self, index: int) -> bytes:
        """Reads one frame as JPEG, see `jpegs`."""
        return self.jpegs(index, 1)[0]

    def jpegs(self, first: int, count: int) -> list[bytes]:
        """Reads consecutive frames as JPEG: the stored bytes, or the decoded frames encoded anew
        where the record is H.264.

        Raises:
            NotFoundError: the record has no such frames.
        """
        if self.coding is Coding.H264:
            return [encode_jpeg(frame) for frame in self._video_frames(first, count)]
        return [bytes(picture) for picture in self._payloads(first, count)]

    def timestamps(self, first: int, count: int) -> IntArray:
        """Reads (count,) mid-exposures of frames on the common clock [UTC ns], from their messages.

        Raises:
            NotFoundError: the record has no such frames.
            CorruptError: a frame that cannot be decoded.
        """
        kind = _CODINGS[self.coding]
        try:
            decoded = [kind.FromString(bytes(part)) for part in self._read_frames(first, count)]
        except DecodeError as error:
            raise CorruptError(
                f"a message of {TOPIC_IMAGE} cannot be read: {error}",
                where=str(self.path),
                fix=_VERIFY,
            ) from None
        return np.array([messages.timestamp_of(m.timestamp) for m in decoded], dtype=np.int64)

    def wind(self) -> WindSeries | None:
        """Reads all samples of the anemometer, on the common clock; `None` if the record has no
        wind."""
        table = self._messages(TOPIC_WIND)
        if not len(table):
            return None
        samples = self._decode(TOPIC_WIND, messages.WindSample, table)
        columns: dict[str, FloatArray] = {}
        for channel, (name, _) in messages.WIND_FIELDS.items():
            if any(sample.HasField(name) for sample in samples):
                columns[channel] = np.array(
                    [getattr(s, name) if s.HasField(name) else np.nan for s in samples]
                )
        hosts = [messages.timestamp_of(s.host_time) for s in samples if s.HasField("host_time")]
        return WindSeries(
            time=table.log_time,
            channels=columns,
            flags=np.array([s.flags for s in samples], dtype=np.uint16),
            sensor=sensor_of(self.metadata, where=str(self.path)),
            host_time=np.array(hosts, dtype=np.int64) if len(hosts) == len(samples) else None,
        )

    @property
    def device_wind_times(self) -> IntArray:
        """(n,) instants of the wind samples on the anemometer's own clock [UTC ns]."""
        return self._messages(TOPIC_WIND).publish_time

    def wind_1hz(self) -> WindAverage | None:
        """Means over 1 s of the common clock; `None` if the record has no wind."""
        table = self._messages(TOPIC_WIND_1HZ)
        if not len(table):
            return None
        means = self._decode(TOPIC_WIND_1HZ, messages.WindMean, table)
        return WindAverage(
            time=table.log_time,
            speed=np.array([m.speed for m in means]),
            sigma=np.array([m.sigma for m in means]),
            direction=np.array([m.direction for m in means]),
            count=np.array([m.count for m in means], dtype=np.int32),
            period=means[0].period,
        )

    @functools.cached_property
    def truth(self) -> Mapping[str, float] | None:
        """The parameters a simulated record was made with, SI; `None` for a real one."""
        table = self._messages(TOPIC_TRUTH)
        if not len(table):
            return None
        message = self._decode(TOPIC_TRUTH, messages.TruthParameters, table)[0]
        return present_names({p.name: p.value for p in message.parameters})

    @property
    def attachments(self) -> tuple[str, ...]:
        """Names of the attached files."""
        return tuple(_own_name(entry.name, entry.media_type) for entry in self._summary.attachments)

    def attachment(self, name: str) -> bytes:
        """Reads the bytes of an attached file, as they were before packing.

        Raises:
            NotFoundError: no attachment of that name.
            CorruptError: its checksum is wrong, or it unpacks to more than the limit.
        """
        for entry in self._summary.attachments:
            if _own_name(entry.name, entry.media_type) != name:
                continue
            data = mcap_container.read_attachment(self._file, entry, where=str(self.path))
            return _unpack(data, name) if entry.media_type.endswith(GZIP_SUFFIX) else data
        raise NotFoundError(
            f"there is no attachment {name!r}",
            where=str(self.path),
            fix=f"there are: {', '.join(self.attachments) or 'none'}",
        )

    def _video_frames(self, first: int, count: int) -> UInt8Array:
        key = first
        pictures = self._payloads(first, count)
        while not is_key(pictures[0]):
            if key == 0:
                raise CorruptError(
                    f"there is no key frame up to frame {first}", where=str(self.path), fix=_VERIFY
                )
            key -= 1
            pictures[:0] = self._payloads(key, 1)
        from flagdata.record.video_archive import (
            decode,
        )  # FFmpeg, which a wind's record needs nothing of

        return np.stack(decode(pictures, where=str(self.path))[first - key :])

    def _schema(self, topic: str) -> str:
        schema = self._summary.schemas.get(self._summary.channels[topic].schema_id)
        return schema.name if schema else "messages without a schema"

    def _messages(self, topic: str) -> mcap_container.Messages:
        return mcap_container.read_messages(self._file, self._summary, topic, where=str(self.path))

    def _payloads(self, first: int, count: int) -> list[memoryview]:
        field = messages.data_field(_CODINGS[self.coding])
        return [messages.payload(part, field=field) for part in self._read_frames(first, count)]

    def _read_frames(self, first: int, count: int) -> Sequence[memoryview]:
        table = self._span(first, count)
        return self._read(TOPIC_IMAGE, table, first - table.first, count)

    def _span(self, first: int, count: int) -> mcap_container.Messages:
        """Finds where consecutive frames lie, and maybe others.

        Raises:
            UsageError: no frames are asked for.
            NotFoundError: the record has no such frames.
        """
        if count < 1 or first < 0:
            raise UsageError(
                f"{count} frames from {first} were asked for",
                fix="ask for at least one, from 0 or later",
            )
        if first + count > self.frame_count:
            raise NotFoundError(
                f"frames {first} to {first + count - 1} of {self.frame_count}",
                where=str(self.path),
                fix="ask for fewer",
            )
        if not self._in_spans:
            return self._frames
        where, span = str(self.path), (first, count)
        return mcap_container.read_messages(
            self._file, self._summary, TOPIC_IMAGE, where=where, span=span
        )

    def _read(
        self, topic: str, table: mcap_container.Messages, first: int, count: int
    ) -> Sequence[memoryview]:
        """Reads the payloads of consecutive rows, checked; of any channel but that of the frames,
        all its messages."""
        parts = self._parts(table, first, count)
        if self.has_checksums:
            mcap_container.check_parts(parts, table, topic, first=first, where=str(self.path))
        else:
            self._check_chunks(table.offset[first : first + count])
        return parts

    def _check_chunks(self, offsets: IntArray) -> None:
        starts = np.array(
            [chunk.chunk_start_offset for chunk in self._summary.chunks], dtype=np.int64
        )
        for index in np.unique(np.searchsorted(starts, offsets, side="right") - 1).tolist():
            if index not in self._sound:
                mcap_container.check_chunk(
                    self._file, self._summary.chunks[index], where=str(self.path)
                )
                self._sound.add(index)

    def _parts(
        self, table: mcap_container.Messages, first: int, count: int
    ) -> Sequence[memoryview]:
        offsets = table.offset[first : first + count].tolist()
        lengths = table.length[first : first + count].tolist()
        start, end = offsets[0], offsets[-1] + lengths[-1]
        where = str(self.path)
        if offsets == sorted(offsets) and end - start <= sum(lengths) + SPAN_SLACK:
            block = memoryview(
                mcap_container.read_exact(self._file, end - start, start, where=where)
            )
            return [block[o - start : o - start + n] for o, n in zip(offsets, lengths, strict=True)]
        return [
            memoryview(mcap_container.read_exact(self._file, n, o, where=where))
            for o, n in zip(offsets, lengths, strict=True)
        ]

    def _decode(self, topic: str, kind: Any, table: mcap_container.Messages) -> list[Any]:
        if self._schema(topic) != kind.DESCRIPTOR.full_name:
            raise InputError(
                f"{topic} holds {self._schema(topic)}",
                where=str(self.path),
                fix=f"write it as {kind.DESCRIPTOR.full_name}",
            )
        try:
            return [
                kind.FromString(bytes(part)) for part in self._read(topic, table, 0, len(table))
            ]
        except DecodeError as error:
            raise CorruptError(
                f"a message of {topic} cannot be read: {error}", where=str(self.path), fix=_VERIFY
            ) from None


def _own_name(name: str, media_type: str) -> str:
    return name.removesuffix(".gz") if media_type.endswith(GZIP_SUFFIX) else name


def _unpack(data: bytes, name: str) -> bytes:
    unpacker = zlib.decompressobj(wbits=31)
    try:
        out = unpacker.decompress(data, ATTACHMENT_LIMIT)
    except zlib.error as error:
        raise CorruptError(
            f"attachment {name!r} cannot be unpacked: {error}", fix=_VERIFY
        ) from None
    if not unpacker.eof:
        raise CorruptError(
            f"attachment {name!r} is cut off or unpacks beyond {ATTACHMENT_LIMIT} bytes",
            fix=_VERIFY,
        )
    return out
