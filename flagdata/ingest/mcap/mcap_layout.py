"""Where an MCAP file has its messages: in chunks and outside them, by one pass over the records
themselves.

The summary at a file's end may be absent, and its index need not list all that is there: programs
write messages without chunks, or behind the last one. So the heads of all records are read, and of
a chunk what it states; what the summary counts is only compared with what was found.

Source: the MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
from collections import Counter, OrderedDict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, Schema, Statistics

from flagdata.core.files.regular_files import MCAP, check_input
from flagdata.core.findings import Finding
from flagdata.core.shell import command_line
from flagdata.errors import CorruptError, LimitError
from flagdata.record.mcap_container import CHUNK_HEAD, RECORD_HEAD, parse
from flagdata.record.salvage import CHUNK_LIMIT
from flagdata.record.unpacking import check_stated, unpack_chunk

_RUN = 1 << 20
"""Bytes of messages outside chunks that are read at once, and one message more."""
_KEPT = 64 << 20
"""Bytes of unpacked blocks that stay in memory for the next message, beside the latest."""
_HEAD = struct.Struct("<BQ")
_INDEX = struct.Struct("<HI")  # channel, bytes of the entries
_INDEX_ENTRY = 16
_MESSAGE = struct.Struct(
    "<BQHIQQ"
)  # opcode, length, channel, sequence, log time, publish time; the data follow
_CHUNK = struct.Struct(
    "<QQQII"
)  # first and last time, unpacked size, checksum, length of the compression's name
_DEFINED = frozenset({Opcode.SCHEMA, Opcode.CHANNEL})
_RECOVER = "salvage what is whole: flagdata recover FILE NEW.mcap"


@dataclass(frozen=True, kw_only=True, slots=True)
class Block:
    """Records that are read at once: a chunk, or a run of messages outside chunks.

    Attributes:
        at, length: where its records, or the chunk's one, lie in the file [B].
        chunk: whether it is a chunk.
        counts: messages by channel; `None` for a chunk that no index follows.
    """

    at: int
    length: int
    chunk: bool
    counts: Mapping[int, int] | None


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What an MCAP file has, and where.

    Attributes:
        profile: what its header says its content is.
        schemas, channels: by number.
        blocks: in the order of the file.
        counts: messages that are there, by channel.
        announced: messages that the summary states, by channel; empty where it states none.
    """

    path: Path
    profile: str
    schemas: Mapping[int, Schema]
    channels: Mapping[int, Channel]
    blocks: tuple[Block, ...]
    counts: Mapping[int, int]
    announced: Mapping[int, int]

    def missing(self, channels: Collection[int]) -> int:
        """Messages of some channels that the summary states and the file does not have."""
        return sum(
            max(0, self.announced.get(channel, 0) - self.counts.get(channel, 0))
            for channel in channels
        )

    def undefined_findings(self) -> tuple[Finding, ...]:
        """Reports messages whose channel the file does not define; empty where there are none."""
        lost = sum(count for channel, count in self.counts.items() if channel not in self.channels)
        if not lost:
            return ()
        message = (
            f"{lost} messages are of a channel that the file does not define, and were not read"
        )
        return (
            Finding.of(
                "messages-undefined",
                message,
                count=lost,
                where=self.path.name,
                fix="copy the file again, or write it again with the program that made it",
            ),
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class Message:
    """A message as it lies in a file.

    Attributes:
        block, offset: number of its block, and where it begins among the block's records [B].
        log_time: when it was recorded [UTC ns, unsigned].
    """

    block: int
    offset: int
    channel: int
    log_time: int
    data: bytes


def layout_of(path: Path) -> Layout:
    """Reads what a file has, and where; of a file that has not changed since it was last asked for,
    from memory.

    Raises:
        NotFoundError, InputError: there is no such file, or it is empty.
        CorruptError: no MCAP file, one that was cut off or is damaged, or several behind one
            another.
        LimitError: a chunk that would unpack to more than is held in memory.
    """
    check_input(path)
    state = path.stat()
    return _scan_file(path, state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=1024)  # a long bag has hundreds of parts
def _scan_file(path: Path, size: int, changed: int) -> Layout:
    with path.open("rb") as stream:
        return _Scan(path, stream, size).run()


@dataclass
class _Scan:
    """One pass over the heads of a file's records."""

    path: Path
    stream: BinaryIO
    size: int
    profile: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)
    announced: dict[int, int] = field(default_factory=dict)
    run_at: int = 0
    run_counts: Counter[int] = field(default_factory=Counter)

    def run(self) -> Layout:
        if self.stream.read(len(MCAP)) != MCAP:
            raise CorruptError(
                "this is no MCAP file", where=str(self.path), fix="check that it is the right file"
            )
        at = len(MCAP)
        ended = closed = False
        while not closed:
            opcode, length = self._head(at)
            start, at = at, at + RECORD_HEAD + length
            if at > self.size:
                raise self._cut_off(f"a record of {length} bytes")
            if opcode == Opcode.MESSAGE and not ended:
                self._loose(start, length)
                continue
            if opcode not in _DEFINED:
                self._end_run(start)
            if opcode == Opcode.CHUNK and not ended:
                self._chunk(start, length)
            elif opcode == Opcode.MESSAGE_INDEX and not ended:
                self._index(length)
            elif opcode == Opcode.DATA_END:
                ended = True
            elif opcode == Opcode.FOOTER and ended:
                closed = True
            elif opcode == 0 or opcode in (Opcode.MESSAGE, Opcode.CHUNK, Opcode.FOOTER):
                raise self._damage_error(f"a record of the kind {opcode} at byte {start}")
            else:
                self._describe(opcode, length)
        self._check_end(at)
        return self._layout_found()

    def _head(self, at: int) -> tuple[int, int]:
        self.stream.seek(at)
        head = self.stream.read(RECORD_HEAD)
        if len(head) < RECORD_HEAD:
            raise self._cut_off("the next record")
        return _HEAD.unpack(head)

    def _loose(self, start: int, length: int) -> None:
        """Takes a message outside chunks."""
        if length < _MESSAGE.size - RECORD_HEAD:
            raise self._damage_error(f"a message of {length} bytes at byte {start}")
        if length > CHUNK_LIMIT:
            raise LimitError(
                f"a message of {length} bytes",
                where=str(self.path),
                fix=f"at most {CHUNK_LIMIT} are read",
            )
        if self.run_counts and start - self.run_at > _RUN:
            self._end_run(start)
        if not self.run_counts:
            self.run_at = start
        self.run_counts[int.from_bytes(self.stream.read(2), "little")] += 1

    def _end_run(self, end: int) -> None:
        if self.run_counts:
            counts, self.run_counts = dict(self.run_counts), Counter()
            self.blocks.append(
                Block(at=self.run_at, length=end - self.run_at, chunk=False, counts=counts)
            )

    def _chunk(self, start: int, length: int) -> None:
        if length < CHUNK_HEAD - RECORD_HEAD:
            raise self._damage_error(f"a chunk of {length} bytes at byte {start}")
        *_, size, _, compression = _CHUNK.unpack(self.stream.read(_CHUNK.size))
        if compression:
            check_stated(size, where=str(self.path))
        if max(length, size) > CHUNK_LIMIT:
            fix = f"at most {CHUNK_LIMIT} are read at once: write smaller chunks"
            raise LimitError(
                f"a chunk has {max(length, size)} bytes", where=str(self.path), fix=fix
            )
        self.blocks.append(Block(at=start, length=RECORD_HEAD + length, chunk=True, counts=None))

    def _index(self, length: int) -> None:
        """Takes the index of one channel's messages in the chunk before."""
        if length < _INDEX.size or not self.blocks or not self.blocks[-1].chunk:
            return
        channel, entries = _INDEX.unpack(self.stream.read(_INDEX.size))
        last = self.blocks[-1]
        counts = {**(last.counts or {}), channel: entries // _INDEX_ENTRY}
        self.blocks[-1] = Block(at=last.at, length=last.length, chunk=True, counts=counts)

    def _describe(self, opcode: int, length: int) -> None:
        where = str(self.path)
        if opcode == Opcode.HEADER:
            self.profile = parse(Header.read, self.stream.read(length), where=where).profile
        elif opcode in _DEFINED:
            self._define(opcode, self.stream.read(length))
        elif opcode == Opcode.STATISTICS:
            self.announced = dict(
                parse(Statistics.read, self.stream.read(length), where=where).channel_message_counts
            )

    def _define(self, opcode: int, record: bytes | memoryview) -> None:
        """Take the definition of a schema or channel.

        Raises:
            CorruptError: it was defined as something else before.
        """
        where = str(self.path)
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema.read, bytes(record), where=where)
            first_schema = self.schemas.setdefault(schema.id, schema)
            same, noun = (
                (first_schema.name, first_schema.data) == (schema.name, schema.data),
                f"schema {schema.id}",
            )
        else:
            channel = parse(Channel.read, bytes(record), where=where)
            first_channel = self.channels.setdefault(channel.id, channel)
            same, noun = (
                (first_channel.topic, first_channel.schema_id)
                == (channel.topic, channel.schema_id),
                f"channel {channel.id}",
            )
        if not same:
            raise CorruptError(
                f"{noun} is defined twice, as different things",
                where=where,
                fix="write the files that it was made of again, each by itself, or merge them: "
                "mcap merge",
            )

    def _check_end(self, end: int) -> None:
        self.stream.seek(end)
        if self.stream.read(len(MCAP)) != MCAP:
            raise self._cut_off("its last bytes")
        end += len(MCAP)
        rest = self.size - end
        if not rest:
            return
        cut = f"{command_line('head', '-c', end, self.path)} > first.mcap"
        if self.stream.read(len(MCAP)) == MCAP:
            raise CorruptError(
                f"a second MCAP file begins at byte {end}: files were written one behind another",
                where=str(self.path),
                fix=f"cut them apart: {cut}; {command_line('tail', '-c', rest, self.path)} > "
                "second.mcap",
            )
        raise CorruptError(
            f"{rest} bytes follow the end of the MCAP file",
            where=str(self.path),
            fix=f"cut it: {cut}",
        )

    def _layout_found(self) -> Layout:
        counts: Counter[int] = Counter()
        counted = True
        for block in self.blocks:
            counts.update(block.counts or {})
            counted &= block.counts is not None
        if not counted or counts.keys() - self.channels.keys():
            counts = self._count_messages()
        return Layout(
            path=self.path,
            profile=self.profile,
            schemas=self.schemas,
            channels=self.channels,
            blocks=tuple(self.blocks),
            counts=counts,
            announced=self.announced,
        )

    def _count_messages(self) -> Counter[int]:
        """Counts the messages by channel, one by one; definitions that stand only in chunks are
        taken on the way."""
        total: Counter[int] = Counter()
        for number, block in enumerate(self.blocks):
            of_block: Counter[int] = Counter()
            for opcode, _, record in split(
                read_block(self.stream, block, where=str(self.path)), where=str(self.path)
            ):
                if opcode in _DEFINED:
                    self._define(opcode, record)
                elif opcode == Opcode.MESSAGE:
                    of_block[int.from_bytes(record[:2], "little")] += 1
            self.blocks[number] = Block(
                at=block.at, length=block.length, chunk=block.chunk, counts=dict(of_block)
            )
            total += of_block
        return total

    def _cut_off(self, noun: str) -> CorruptError:
        return CorruptError(
            f"the MCAP file is damaged or cut off: it ends before the end of {noun}",
            where=str(self.path),
            fix=_RECOVER,
        )

    def _damage_error(self, noun: str) -> CorruptError:
        return CorruptError(f"the MCAP file is damaged: {noun}", where=str(self.path), fix=_RECOVER)


def read_block(stream: BinaryIO, block: Block, *, where: str) -> memoryview:
    """Reads the records of a block, unpacked.

    Raises:
        CorruptError: the file ends before, or the chunk does not unpack to what it states.
        LimitError: a chunk beyond the limit.
    """
    stream.seek(block.at)
    data = stream.read(block.length)
    if len(data) < block.length:
        raise CorruptError("the file ends within a message", where=where, fix=_RECOVER)
    if not block.chunk:
        return memoryview(data)
    return unpack_chunk(parse(Chunk.read, data[RECORD_HEAD:], where=where), where=where)


def split(records: memoryview, *, where: str) -> Iterator[tuple[int, int, memoryview]]:
    """Yields opcode, offset and content of each of some records.

    Raises:
        CorruptError: one reaches beyond their end.
    """
    at = 0
    while at < len(records):
        whole = at + RECORD_HEAD <= len(records)
        opcode, length = _HEAD.unpack_from(records, at) if whole else (0, 0)
        end = at + RECORD_HEAD + length
        if end > len(records):
            raise CorruptError("a record reaches beyond its chunk", where=where, fix=_RECOVER)
        yield opcode, at, records[at + RECORD_HEAD : end]
        at = end


class Messages:
    """The messages of a file, in its order or by their place; closed by its block."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._where = str(layout.path)
        self._stream = layout.path.open("rb")
        self._unpacked: OrderedDict[int, memoryview] = OrderedDict()

    def of(self, channels: Collection[int]) -> Iterator[Message]:
        """Yields the messages of some channels, in the order of the file.

        Raises:
            CorruptError: a chunk or record that is damaged; messages before it have been given.
        """
        for number, block in enumerate(self._layout.blocks):
            if block.counts is not None and not any(
                block.counts.get(channel) for channel in channels
            ):
                continue
            for opcode, at, record in split(self._block(number), where=self._where):
                if opcode == Opcode.MESSAGE and int.from_bytes(record[:2], "little") in channels:
                    yield self._message(number, at)

    def at(self, block: int, offset: int) -> Message:
        """Reads the message at a place."""
        return self._message(block, offset)

    def _message(self, block: int, offset: int) -> Message:
        records = self._block(block)
        channel = log_time = 0
        try:
            _, length, channel, _, log_time, _ = _MESSAGE.unpack_from(records, offset)
        except struct.error:
            length = 0
        if length < _MESSAGE.size - RECORD_HEAD:
            raise CorruptError("a message ends within its head", where=self._where, fix=_RECOVER)
        data = bytes(records[offset + _MESSAGE.size : offset + RECORD_HEAD + length])
        return Message(block=block, offset=offset, channel=channel, log_time=log_time, data=data)

    def _block(self, number: int) -> memoryview:
        if number in self._unpacked:
            self._unpacked.move_to_end(number)
            return self._unpacked[number]
        records = read_block(self._stream, self._layout.blocks[number], where=self._where)
        self._unpacked[number] = records
        while len(self._unpacked) > 1 and sum(map(len, self._unpacked.values())) > _KEPT:
            self._unpacked.popitem(last=False)
        return records

    def close(self) -> None:
        self._unpacked.clear()
        self._stream.close()
