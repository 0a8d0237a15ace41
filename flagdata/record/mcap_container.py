"""The MCAP container read by offset: the summary at its end, and where each message of a topic
lies. No message is decoded here, no offset is trusted before what it points at has been checked,
and no payload is given out before its checksum is.

Source: the MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import pairwise
from typing import TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Metadata,
    MetadataIndex,
    Schema,
)
from numpy.typing import NDArray

from flagdata.core.arrays import IntArray
from flagdata.errors import CorruptError, InputError
from flagdata.record.mcap_file import CHUNK, MAGIC, MESSAGE, RECORD_HEAD
from flagdata.record.record_bytes import Bytes
from flagdata.record.record_checksums import (
    CHECKSUMS,
    FIX,
    HEAD_BYTES,
    ChannelChecksums,
    Checksums,
    metadata_checksum,
)

MESSAGE_HEAD = MESSAGE.size  # then the data
CHUNK_HEAD = CHUNK.size  # and the name of the compression; then the records
_FOOTER = struct.Struct("<BQQQI")
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, bytes of the entries
_INDEX_ENTRY = 16  # log time, offset
_TAIL = _FOOTER.size + len(MAGIC)
_LAST = 512 << 10
"""Bytes at the end of a record that hold its summary and checksums, unless it is very long."""
_MESSAGE = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log", "<u8"),
        ("publish", "<u8"),
    ]
)
_RECOVER = "run `flagdata recover` on the file"

R = TypeVar("R")


@dataclass(frozen=True, kw_only=True)
class Summary:
    """What the end of a record says about it. All offsets lie within the file."""

    data_end: int
    """Where the summary section begins [B]."""
    schemas: Mapping[int, Schema]
    channels: Mapping[str, Channel]
    """By topic."""
    chunks: tuple[ChunkIndex, ...]
    """In file order."""
    attachments: tuple[AttachmentIndex, ...]
    metadata: tuple[MetadataIndex, ...]
    checksums: Checksums | None
    """`None` in a record that was written before there were any."""


@dataclass(frozen=True, kw_only=True)
class Messages:
    """Where the messages of one topic lie, in order of log time: all arrays (n,) int64.

    Attributes:
        log_time, publish_time: [UTC ns].
        offset, length: of the message's data in the file [B].
        checksums: (n,) uint32, of each message's data; `None` where the channel has one checksum,
            or none.
        checksum: of the data of all messages in file order; `None` where each has its own, or there
            are none.
        first: number of the topic's message in row 0.
    """

    log_time: IntArray
    publish_time: IntArray
    offset: IntArray
    length: IntArray
    checksums: NDArray[np.uint32] | None = None
    checksum: int | None = None
    first: int = 0

    def __len__(self) -> int:
        return len(self.log_time)


def read_exact(file: Bytes, length: int, offset: int, *, where: str) -> bytes:
    """Reads `length` bytes at `offset`.

    Raises:
        CorruptError: the file ends before.
    """
    data = file.read(length, offset)
    while len(data) < length:
        further = file.read(length - len(data), offset + len(data))
        if not further:
            raise CorruptError(
                f"the record ends before byte {offset + length}", where=where, fix=_RECOVER
            )
        data += further
    return data


def read_summary(file: Bytes, *, where: str) -> Summary:
    """Read and check the summary section.

    Raises:
        CorruptError: not an MCAP file, cut off, or a summary whose checksum or offsets are wrong.
    """
    size = file.size
    file.prepare([(0, len(MAGIC)), (size - _LAST, size)])
    if size < len(MAGIC) + _TAIL or file.read(len(MAGIC), 0) != MAGIC:
        raise CorruptError(
            "this is no MCAP record", where=where, fix="check that it is the right file"
        )
    tail = read_exact(file, _TAIL, size - _TAIL, where=where)
    if tail[-len(MAGIC) :] != MAGIC:
        raise CorruptError("the record is cut off: its end is missing", where=where, fix=_RECOVER)
    opcode, length, start, _, checksum = _FOOTER.unpack_from(tail)
    if opcode != Opcode.FOOTER or length != _FOOTER.size - RECORD_HEAD:
        raise CorruptError("the record has no footer", where=where, fix=_RECOVER)
    if not len(MAGIC) <= start < size - _TAIL:
        raise CorruptError("the record has no summary", where=where, fix=_RECOVER)
    body = read_exact(file, size - _TAIL - start, start, where=where)
    if zlib.crc32(tail[: _FOOTER.size - 4], zlib.crc32(body)) != checksum:
        raise CorruptError(
            "the checksum of the record's summary is wrong", where=where, fix=_RECOVER
        )
    return _with_checksums(file, _summary(body, start, where=where), where=where)


def _with_checksums(file: Bytes, summary: Summary, *, where: str) -> Summary:
    for entry in summary.metadata:
        if entry.name == CHECKSUMS:
            record = _record_at(file, entry.offset, entry.length, Opcode.METADATA, where=where)
            stored = parse(Metadata.read, record, where=where).metadata
            return replace(summary, checksums=Checksums.parse(stored, where=where))
    return summary


def _summary(body: bytes, start: int, *, where: str) -> Summary:
    schemas: dict[int, Schema] = {}
    channels: dict[str, Channel] = {}
    chunks: list[ChunkIndex] = []
    attachments: list[AttachmentIndex] = []
    metadata: list[MetadataIndex] = []
    for opcode, record in split_records(body, where=where):
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema.read, record, where=where)
            schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel.read, record, where=where)
            channels[channel.topic] = channel
        elif opcode == Opcode.CHUNK_INDEX:
            chunk = parse(ChunkIndex.read, record, where=where)
            _check_span(
                chunk.chunk_start_offset,
                chunk.chunk_length + chunk.message_index_length,
                start,
                where=where,
            )
            if (
                CHUNK_HEAD + len(chunk.compression.encode()) + chunk.compressed_size
                != chunk.chunk_length
            ):
                raise CorruptError("the lengths of a chunk do not agree", where=where, fix=_RECOVER)
            chunks.append(chunk)
        elif opcode == Opcode.ATTACHMENT_INDEX:
            attachment = parse(AttachmentIndex.read, record, where=where)
            _check_span(attachment.offset, attachment.length, start, where=where)
            attachments.append(attachment)
        elif opcode == Opcode.METADATA_INDEX:
            entry = parse(MetadataIndex.read, record, where=where)
            _check_span(entry.offset, entry.length, start, where=where)
            metadata.append(entry)
    return Summary(
        data_end=start,
        schemas=schemas,
        channels=channels,
        chunks=tuple(sorted(chunks, key=lambda chunk: chunk.chunk_start_offset)),
        attachments=tuple(attachments),
        metadata=tuple(metadata),
        checksums=None,
    )


def _check_span(offset: int, length: int, end: int, *, where: str) -> None:
    if offset < len(MAGIC) or offset + length > end:
        raise CorruptError(
            f"the summary points to bytes {offset} to {offset + length} of {end}",
            where=where,
            fix=_RECOVER,
        )


def split_records(body: bytes | memoryview, *, where: str) -> Iterator[tuple[int, memoryview]]:
    """Yields opcode and content of each record in `body`; nothing is copied.

    Raises:
        CorruptError: a record reaches beyond the end.
    """
    at = 0
    body = memoryview(body)
    while at < len(body):
        if at + RECORD_HEAD > len(body):
            raise CorruptError("a record's head is cut off", where=where, fix=_RECOVER)
        opcode, length = struct.unpack_from("<BQ", body, at)
        at += RECORD_HEAD
        if at + length > len(body):
            raise CorruptError(
                f"a record of {length} bytes reaches beyond its section", where=where, fix=_RECOVER
            )
        yield opcode, body[at : at + length]
        at += length


def parse(read: Callable[[ReadDataStream], R], record: bytes | memoryview, *, where: str) -> R:
    """Parses `record`'s content by the `read` of one of mcap.records.

    Raises:
        CorruptError: it is not of that kind.
    """
    try:
        return read(ReadDataStream(BytesIO(record)))
    except (struct.error, UnicodeDecodeError, McapError, OverflowError) as error:
        raise CorruptError(
            f"a record of the container cannot be read: {error}", where=where, fix=_RECOVER
        ) from None


def data_start(chunk: ChunkIndex) -> int:
    """Returns where the records of an uncompressed chunk begin in the file [B]."""
    return chunk.chunk_start_offset + CHUNK_HEAD + len(chunk.compression.encode())


def read_messages(
    file: Bytes, summary: Summary, topic: str, *, where: str, span: tuple[int, int] | None = None
) -> Messages:
    """Finds where each message of `topic` lies; every head is read and compared with the index.
    None if the topic is absent.

    Args:
        span: only these messages, (first, count) of a topic in order, see `in_order`; no head of
            others is read.

    Raises:
        CorruptError: an index that does not fit the messages, or heads that have changed since they
            were written.
        InputError: compressed chunks, whose messages have no place in the file.
    """
    channel = summary.channels.get(topic)
    if channel is None:
        return Messages(log_time=_empty(), publish_time=_empty(), offset=_empty(), length=_empty())
    time, head_offsets, limit = _places(file, summary, channel.id, where=where, span=span)
    first = 0 if span is None else span[0]
    heads = b"".join([file.read(MESSAGE_HEAD, at) for at in head_offsets.tolist()])
    if len(heads) != MESSAGE_HEAD * len(head_offsets):
        raise CorruptError("the record ends before its last message", where=where, fix=_RECOVER)
    head = np.frombuffer(heads, dtype=_MESSAGE)
    length = head["length"].astype(np.int64) - (MESSAGE_HEAD - RECORD_HEAD)
    sound = (
        (head["opcode"] == Opcode.MESSAGE)
        & (head["channel"] == channel.id)
        & (head["log"].astype(np.int64) == time)
        & (length >= 0)
        & (head_offsets + MESSAGE_HEAD + length <= limit)
    )
    if not bool(sound.all()):
        bad = int(np.flatnonzero(~sound)[0])
        raise CorruptError(
            f"message {first + bad} of {topic} is not where the index says",
            where=f"{where}, byte {head_offsets[bad]}",
            fix=_RECOVER,
        )
    stored_checksums = None
    if summary.checksums is not None:
        stored_checksums = summary.checksums.channels.get(topic)
        stored_checksums = (
            _check_heads(head, stored_checksums, topic, where=where)
            if span is None
            else _of_span(stored_checksums, span)
        )
    order = np.argsort(time, kind="stable")
    if span is not None and not np.array_equal(order, np.arange(len(time))):
        raise CorruptError(
            f"the messages of {topic} are not in order of time", where=where, fix=_RECOVER
        )
    return Messages(
        log_time=time[order],
        publish_time=head["publish"].astype(np.int64)[order],
        offset=(head_offsets + MESSAGE_HEAD)[order],
        length=length[order],
        checksums=None
        if stored_checksums is None or stored_checksums.messages is None
        else stored_checksums.messages[order],
        checksum=None if stored_checksums is None else stored_checksums.data,
        first=first,
    )


def in_order(file: Bytes, summary: Summary, topic: str, *, where: str) -> bool:
    """Checks whether a topic's messages lie in order of time from chunk to chunk, each with a
    checksum of its own, so that `read_messages` may read a span of them. The summary states from
    when to when each chunk has messages; an index is read only of chunks in which other topics
    overlap with the next.

    Raises:
        CorruptError: an index that is damaged.
    """
    stored_checksums = None if summary.checksums is None else summary.checksums.channels.get(topic)
    if (
        stored_checksums is None
        or stored_checksums.messages is None
        or topic not in summary.channels
    ):
        return False
    channel = summary.channels[topic].id
    chunks = [chunk for chunk in summary.chunks if channel in chunk.message_index_offsets]
    if (
        any(chunk.compression for chunk in chunks)
        or sum(message_count(chunk, channel) for chunk in chunks) != stored_checksums.count
    ):
        return False
    bounds = [(chunk.message_start_time, chunk.message_end_time) for chunk in chunks]
    overlaps = {
        i + k
        for i, (earlier, later) in enumerate(pairwise(bounds))
        if later[0] <= earlier[1]
        for k in (0, 1)
    }
    shared = [i for i in sorted(overlaps) if len(chunks[i].message_index_offsets) > 1]
    file.prepare([_index_span(chunks[i], channel) for i in shared])
    for i in shared:
        time, _ = _message_index(
            file, chunks[i].message_index_offsets[channel], channel, summary.data_end, where=where
        )
        bounds[i] = (int(time.min(initial=0)), int(time.max(initial=0)))
    return all(earlier[1] < later[0] for earlier, later in pairwise(bounds))


def _index_span(chunk: ChunkIndex, channel: int) -> tuple[int, int]:
    """Returns where the index of a channel's messages in a chunk begins and ends [B]: indexes
    follow their chunk in a row."""
    first = chunk.message_index_offsets[channel]
    later = [at for at in chunk.message_index_offsets.values() if at > first]
    return first, min(
        later, default=chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
    )


def message_count(chunk: ChunkIndex, channel: int) -> int:
    """Counts the messages of a channel in a chunk, by the length of their index."""
    first, end = _index_span(chunk, channel)
    return (end - first - _INDEX.size) // _INDEX_ENTRY


def _places(
    file: Bytes, summary: Summary, channel: int, *, where: str, span: tuple[int, int] | None
) -> tuple[IntArray, IntArray, IntArray]:
    """Finds the log time of messages, where their heads lie, and where the records of their chunks
    end, in file order.

    Args:
        span: see `read_messages`; what is read of these messages next is prepared.
    """
    parts: list[tuple[ChunkIndex, int, int]] = []
    before = 0
    for chunk in summary.chunks:
        if channel in chunk.message_index_offsets:
            if chunk.compression:
                raise InputError(
                    f"the record's chunks are compressed ({chunk.compression})",
                    where=where,
                    fix=_RECOVER + " to rewrite it",
                )
            count = message_count(chunk, channel)
            first, last = (
                (0, count) if span is None else (span[0] - before, span[0] + span[1] - before)
            )
            if span is None or (first < count and last > 0):
                parts.append((chunk, max(first, 0), last))
            before += count
    if span is not None:
        file.prepare([_index_span(chunk, channel) for chunk, _, _ in parts])
    times, places, limits, used = [_empty()], [_empty()], [_empty()], []
    for chunk, first, last in parts:
        at = chunk.message_index_offsets[channel]
        time, offset = _message_index(file, at, channel, summary.data_end, where=where)
        if len(offset) and (
            offset.min() < 0 or offset.max() + MESSAGE_HEAD > chunk.compressed_size
        ):
            raise CorruptError("a message index points out of its chunk", where=where, fix=_RECOVER)
        limit = data_start(chunk) + chunk.compressed_size
        rows = slice(None) if span is None else slice(first, last)
        times.append(time[rows])
        places.append(offset[rows] + data_start(chunk))
        limits.append(np.full(len(time[rows]), limit))
        if span is not None and len(time[rows]):
            end = data_start(chunk) + int(offset[last]) if last < len(offset) else limit
            used.append((int(places[-1][0]), end))
    if span is not None:
        file.prepare(used)
    return np.concatenate(times), np.concatenate(places), np.concatenate(limits)


def _of_span(
    stored_checksums: ChannelChecksums | None, span: tuple[int, int]
) -> ChannelChecksums | None:
    if stored_checksums is None or stored_checksums.messages is None:
        return None
    first, count = span
    return replace(
        stored_checksums, messages=stored_checksums.messages[first : first + count], count=count
    )


def _check_heads(
    head: NDArray[np.void], stored_checksums: ChannelChecksums | None, topic: str, *, where: str
) -> ChannelChecksums:
    """Returns the channel's checksums, once its heads, in file order, agree with them."""
    if stored_checksums is None or stored_checksums.count != len(head):
        count = "no" if stored_checksums is None else str(stored_checksums.count)
        raise CorruptError(
            f"{topic} has {len(head)} messages, and {count} checksums", where=where, fix=FIX
        )
    head_bytes = np.frombuffer(head.tobytes(), dtype=np.uint8).reshape(len(head), MESSAGE_HEAD)
    if (
        zlib.crc32(np.ascontiguousarray(head_bytes[:, MESSAGE_HEAD - HEAD_BYTES :]).tobytes())
        != stored_checksums.heads
    ):
        raise CorruptError(
            f"the times of {topic} have changed since they were written", where=where, fix=FIX
        )
    return stored_checksums


def check_parts(
    parts: Sequence[bytes | memoryview], table: Messages, topic: str, *, first: int, where: str
) -> None:
    """Compares the payloads of consecutive messages from row `first` on with their checksums, where
    there are any.

    Of a channel with one checksum, `parts` are all messages.

    Raises:
        CorruptError: one that has changed since it was written.
    """
    if table.checksums is not None:
        for index, part in enumerate(parts, start=first):
            if zlib.crc32(part) != table.checksums[index]:
                raise CorruptError(
                    f"message {table.first + index} of {topic} has changed since it was written: "
                    "its checksum is wrong",
                    where=f"{where}, byte {table.offset[index]}",
                    fix=FIX,
                )
    elif table.checksum is not None:
        total = 0
        for index in np.argsort(table.offset, kind="stable").tolist():
            total = zlib.crc32(parts[index], total)
        if total != table.checksum:
            raise CorruptError(
                f"{topic} has changed since it was written: its checksum is wrong",
                where=f"{where}, bytes {table.offset.min()} to "
                f"{(table.offset + table.length).max()}",
                fix=FIX,
            )


def check_chunk(file: Bytes, chunk: ChunkIndex, *, where: str) -> None:
    """Compares the records of an uncompressed chunk with the chunk's own checksum, where it has
    one.

    Raises:
        CorruptError: they have changed since they were written.
    """
    start = data_start(chunk)
    head = read_exact(file, start - chunk.chunk_start_offset, chunk.chunk_start_offset, where=where)
    (checksum,) = struct.unpack_from(
        "<I", head, RECORD_HEAD + 24
    )  # after the two times and the size
    if (
        checksum
        and zlib.crc32(read_exact(file, chunk.compressed_size, start, where=where)) != checksum
    ):
        raise CorruptError(
            "a chunk has changed since it was written: its checksum is wrong",
            where=f"{where}, bytes {start} to {start + chunk.compressed_size}",
            fix=FIX,
        )


def _empty() -> IntArray:
    return np.empty(0, dtype=np.int64)


def _message_index(
    file: Bytes, at: int, channel: int, end: int, *, where: str
) -> tuple[IntArray, IntArray]:
    if at + _INDEX.size > end:
        raise CorruptError("a message index lies beyond the data", where=where, fix=_RECOVER)
    opcode, length, owner, size = _INDEX.unpack(read_exact(file, _INDEX.size, at, where=where))
    is_sound = size + 6 == length and size % _INDEX_ENTRY == 0
    if opcode != Opcode.MESSAGE_INDEX or owner != channel or not is_sound or at + size > end:
        raise CorruptError(
            "there is no message index where the summary says",
            where=f"{where}, byte {at}",
            fix=_RECOVER,
        )
    pairs = np.frombuffer(
        read_exact(file, size, at + _INDEX.size, where=where), dtype="<u8"
    ).astype(np.int64)
    return pairs[0::2], pairs[1::2]


def read_metadata(file: Bytes, summary: Summary, *, where: str) -> dict[str, dict[str, str]]:
    """Reads all metadata records but the checksums, by name.

    Raises:
        CorruptError: not what the summary says, or changed since they were written.
    """
    metadata: dict[str, dict[str, str]] = {}
    stored_checksums = None if summary.checksums is None else summary.checksums.metadata
    for entry in summary.metadata:
        if entry.name == CHECKSUMS:
            continue
        record = _record_at(file, entry.offset, entry.length, Opcode.METADATA, where=where)
        content = parse(Metadata.read, record, where=where)
        if stored_checksums is not None and (
            content.name != entry.name
            or stored_checksums.get(entry.name) != metadata_checksum(content.metadata)
        ):
            raise CorruptError(
                f"the metadata {entry.name!r} has changed since it was written: its checksum is "
                "wrong",
                where=f"{where}, byte {entry.offset}",
                fix=FIX,
            )
        metadata[entry.name] = content.metadata
    return metadata


def read_attachment(file: Bytes, entry: AttachmentIndex, *, where: str) -> bytes:
    """Reads the bytes of an attachment as stored, checked.

    Raises:
        CorruptError: the checksum is wrong.
    """
    record = _record_at(file, entry.offset, entry.length, Opcode.ATTACHMENT, where=where)
    if zlib.crc32(record[:-4]) != int.from_bytes(record[-4:], "little"):
        raise CorruptError(
            f"the checksum of attachment {entry.name!r} is wrong", where=where, fix=_RECOVER
        )
    return parse(Attachment.read, record, where=where).data


def _record_at(file: Bytes, offset: int, length: int, opcode: Opcode, *, where: str) -> memoryview:
    record = read_exact(file, length, offset, where=where)
    records = list(split_records(record, where=where))
    if len(records) != 1 or records[0][0] != opcode:
        raise CorruptError(
            f"there is no {opcode.name.lower()} at byte {offset}", where=where, fix=_RECOVER
        )
    return records[0][1]
