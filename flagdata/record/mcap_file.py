"""An MCAP file as it is written: single messages, whole blocks of them, and attachments that come
in pieces.

Source: MCAP format specification, version 0. The bytes are those that `mcap.writer.Writer` of the
mcap library writes for the same calls without compression, which is tested; that one takes its
messages one by one, and 1.7 million of them take half a minute.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import IO

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from flagdata.core.arrays import BoolArray, IntArray, UInt8Array

MAGIC = b"\x89MCAP0\r\n"
MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
RECORD_HEAD = 9
"""Bytes of opcode and length of a record, which the length does not count."""
CHUNK = struct.Struct("<BQQQQIIQ")
"""Opcode, length; first and last time, size and CRC of the records, length of the compression's
name, their length."""
_NOTE = struct.Struct("<QQ")  # log time, offset in the chunk


@dataclass
class _OpenChunk:
    """Records that are not in the file yet, and where its messages lie among them."""

    data: bytearray = field(default_factory=bytearray)
    notes: dict[int, bytearray] = field(default_factory=dict)
    start: int = 0
    end: int = 0
    messages: int = 0

    def note(self, channel: int, notes: bytes, count: int, low: int, high: int) -> None:
        self.start = min(self.start, low) if self.messages else low
        self.end = max(self.end, high)
        self.messages += count
        self.notes.setdefault(channel, bytearray()).extend(notes)


@dataclass(frozen=True, kw_only=True)
class MessageBlock:
    """Messages of one channel, their payloads as rows of one array.

    Attributes:
        log_time: (n,) UTC nanoseconds, 1970 or later.
        publish_time: (n,) likewise.
        payload: (n, w) uint8; row i's payload is its bytes that `used` chooses, in their order.
        used: (n, w) bool.
    """

    log_time: IntArray
    publish_time: IntArray
    payload: UInt8Array
    used: BoolArray


class McapFile:
    """Writes one MCAP file with chunks that are not compressed.

    Args:
        stream: where to; writing begins at its start.
        chunk_size: a chunk ends with the message that makes it larger than this [bytes].
        profile: of the header.
        library: of the header.
    """

    def __init__(self, stream: IO[bytes], *, chunk_size: int, profile: str, library: str) -> None:
        self._stream = stream
        self._chunk_size = chunk_size
        self._crc = 0
        self._at = 0
        self._chunk = _OpenChunk()
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._start: int | None = None
        self._end = 0
        self._write(MAGIC)
        self._write(_bytes(Header(profile, library)))

    def register_schema(self, *, name: str, encoding: str, data: bytes) -> int:
        """Add a schema; its number."""
        schema = Schema(id=len(self._schemas) + 1, name=name, encoding=encoding, data=data)
        self._schemas.append(schema)
        self._chunk.data += _bytes(schema)
        return schema.id

    def register_channel(
        self,
        *,
        topic: str,
        message_encoding: str,
        schema_id: int,
        metadata: Mapping[str, str] | None = None,
    ) -> int:
        """Add a channel; its number."""
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic,
            message_encoding=message_encoding,
            schema_id=schema_id,
            metadata=dict(metadata or {}),
        )
        self._channels.append(channel)
        self._chunk.data += _bytes(channel)
        self._end_full_chunk()
        return channel.id

    def add_message(
        self, *, channel_id: int, log_time: int, publish_time: int, sequence: int, data: bytes
    ) -> None:
        """Add one message; times are UTC nanoseconds of 1970 or later."""
        length = MESSAGE.size - RECORD_HEAD + len(data)
        offset = len(self._chunk.data)
        self._chunk.data += MESSAGE.pack(
            Opcode.MESSAGE, length, channel_id, sequence, log_time, publish_time
        )
        self._chunk.data += data
        self._count(channel_id, 1, log_time, log_time)
        self._chunk.note(channel_id, _NOTE.pack(log_time, offset), 1, log_time, log_time)
        self._end_full_chunk()

    def add_messages(self, block: MessageBlock, *, channel_id: int, sequence: int) -> None:
        """Add a block of messages, the first of them with the number `sequence`."""
        lengths = block.used.sum(axis=1).astype(np.int64)
        head = np.zeros(
            len(lengths),
            dtype=[
                ("op", "u1"),
                ("n", "<u8"),
                ("ch", "<u2"),
                ("seq", "<u4"),
                ("log", "<u8"),
                ("pub", "<u8"),
            ],
        )
        head["op"], head["n"], head["ch"] = (
            Opcode.MESSAGE,
            lengths + (MESSAGE.size - RECORD_HEAD),
            channel_id,
        )
        head["seq"] = np.arange(sequence, sequence + len(lengths))
        head["log"], head["pub"] = block.log_time, block.publish_time
        head = head.view(np.uint8).reshape(-1, MESSAGE.size)
        records = np.hstack([head, block.payload])
        used = np.hstack([np.ones(head.shape, dtype=bool), block.used])
        ends = np.cumsum(lengths + MESSAGE.size)
        first = 0
        while first < len(lengths):
            before = int(ends[first - 1]) if first else 0
            room = self._chunk_size - len(self._chunk.data)
            last = min(int(np.searchsorted(ends, before + room, side="right")) + 1, len(lengths))
            rows = slice(first, last)
            log = block.log_time[rows]
            notes = np.empty((last - first, 2), dtype="<u8")
            notes[:, 0] = log
            notes[:, 1] = (
                np.concatenate(([before], ends[first : last - 1])) - before + len(self._chunk.data)
            )
            self._chunk.data += records[rows][used[rows]].tobytes()
            low, high = int(log.min()), int(log.max())
            self._count(channel_id, last - first, low, high)
            self._chunk.note(channel_id, notes.tobytes(), last - first, low, high)
            self._end_full_chunk()
            first = last

    def add_attachment(
        self,
        *,
        log_time: int,
        name: str,
        media_type: str,
        data: Iterable[bytes],
        size: int,
        create_time: int = 0,
    ) -> None:
        """Add an attachment of `size` bytes that come in pieces."""
        fixed = [
            struct.pack("<QQ", log_time, create_time),
            *(_prefix_length(text) for text in (name, media_type)),
        ]
        head = b"".join(fixed) + struct.pack("<Q", size)
        length = len(head) + size + 4
        offset = self._at
        self._write(struct.pack("<BQ", Opcode.ATTACHMENT, length))
        crc = zlib.crc32(head)
        self._write(head)
        for piece in data:
            crc = zlib.crc32(piece, crc)
            self._write(piece)
        self._write(struct.pack("<I", crc))
        self._attachments.append(
            AttachmentIndex(
                offset=offset,
                length=RECORD_HEAD + length,
                create_time=create_time,
                log_time=log_time,
                data_size=size,
                name=name,
                media_type=media_type,
            )
        )

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        data = _bytes(Metadata(name=name, metadata=dict(values)))
        self._metadata.append(MetadataIndex(offset=self._at, length=len(data), name=name))
        self._write(data)

    def flush(self) -> None:
        """End the chunk, if it holds a message, and hand all to the operating system."""
        self._end_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the summary and the footer; the stream stays open."""
        self._end_chunk()
        self._write(_bytes(DataEnd(self._crc)))
        start = self._at
        groups: list[tuple[int, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*self._schemas]),
            (Opcode.CHANNEL, [*self._channels]),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, [*self._chunks]),
            (Opcode.ATTACHMENT_INDEX, [*self._attachments]),
            (Opcode.METADATA_INDEX, [*self._metadata]),
        ]
        summary = bytearray()
        offsets = bytearray()
        for opcode, records in groups:
            data = b"".join(_bytes(record) for record in records)
            offset = SummaryOffset(
                group_opcode=opcode, group_start=start + len(summary), group_length=len(data)
            )
            offsets += _bytes(offset)
            summary += data
        places = start + len(summary)
        summary += offsets
        crc = zlib.crc32(summary + struct.pack("<BQQQ", Opcode.FOOTER, 8 + 8 + 4, start, places))
        self._stream.write(summary)
        self._stream.write(
            _bytes(Footer(summary_start=start, summary_offset_start=places, summary_crc=crc))
            + MAGIC
        )

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            metadata_count=len(self._metadata),
            message_start_time=self._start or 0,
            message_end_time=self._end,
            schema_count=len(self._schemas),
        )

    def _count(self, channel_id: int, count: int, low: int, high: int) -> None:
        self._counts[channel_id] = self._counts.get(channel_id, 0) + count
        self._start = low if self._start is None else min(self._start, low)
        self._end = max(self._end, high)

    def _end_full_chunk(self) -> None:
        if len(self._chunk.data) > self._chunk_size:
            self._end_chunk()

    def _end_chunk(self) -> None:
        if not self._chunk.messages:
            return
        done, self._chunk = self._chunk, _OpenChunk()
        offset, size = self._at, len(done.data)
        length, crc = CHUNK.size + size, zlib.crc32(done.data)
        self._write(
            CHUNK.pack(Opcode.CHUNK, length - RECORD_HEAD, done.start, done.end, size, crc, 0, size)
        )
        self._write(done.data)  # never copied: one message may be of hundreds of megabytes
        places: dict[int, int] = {}
        first = self._at
        for channel, notes in done.notes.items():
            places[channel] = self._at
            self._write(
                struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + len(notes), channel, len(notes))
                + notes
            )
        self._chunks.append(
            ChunkIndex(
                message_start_time=done.start,
                message_end_time=done.end,
                chunk_start_offset=offset,
                chunk_length=length,
                message_index_offsets=places,
                message_index_length=self._at - first,
                compression="",
                compressed_size=size,
                uncompressed_size=size,
            )
        )

    def _write(self, data: bytes | bytearray) -> None:
        self._crc = zlib.crc32(data, self._crc)
        self._at += len(data)
        self._stream.write(data)


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _prefix_length(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data
