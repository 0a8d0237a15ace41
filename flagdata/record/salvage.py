"""Recovers what a cut-off or damaged MCAP file still holds, in one pass from its start, into a
whole record.

A crash, a full disk or a pulled cable leaves a file without the summary that readers by offset
need. Everything before the break is sound: whole chunks are checked by their CRC-32, and whole
messages of a last, partial, uncompressed chunk are kept too, named as unchecked. After a stretch
that cannot be read (a bad sector) the pass goes on at the next chunk whose checksum is right; where
the summary is sound, the messages between are kept that have a right checksum of their own. Nothing
is invented: every message written is byte for byte one that was read.
"""

from __future__ import annotations

import mmap
import os
import re
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Message, Metadata, Schema

from flagdata.core.findings import Finding, Severity
from flagdata.errors import CorruptError, FlagdataError, NotFoundError
from flagdata.record import messages
from flagdata.record.mcap_container import (
    CHUNK_HEAD,
    MAGIC,
    MESSAGE_HEAD,
    RECORD_HEAD,
    Summary,
    parse,
    read_summary,
)
from flagdata.record.metadata import SALVAGE
from flagdata.record.record_bytes import open_bytes
from flagdata.record.record_checksums import CHECKSUMS, ChecksummedFile
from flagdata.record.record_file import Output
from flagdata.record.sound_messages import SoundMessages
from flagdata.record.unpacking import unpack_chunk
from flagdata.record.writer import CHUNK_BYTES, PROFILE, Chunking, library_name
from flagdata.timebase import iso

CHUNK_LIMIT = 1 << 30
"""No record is taken to be longer than this in the file [B]; a longer one is a damaged length."""
_IN_CHUNK = frozenset({Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE})
_DATA_OPCODES = _IN_CHUNK | {
    Opcode.HEADER,
    Opcode.CHUNK,
    Opcode.MESSAGE_INDEX,
    Opcode.ATTACHMENT,
    Opcode.METADATA,
}
_FIRST_PRIVATE = 0x80
_DATA_END_BYTES = 4
_CHUNK_START = re.compile(
    rb"\x06.{3}[\x00-\x40]\x00{4}", re.DOTALL
)  # the opcode, and a length within CHUNK_LIMIT
_CHUNK_FIELDS = struct.Struct("<QQQII")
_LOOKS = 64
"""How often the bytes of a file are looked at, at most, for what may be a chunk behind damage."""
_LONGEST_NAME = 8  # bytes of the name of a compression
_KNOWN: dict[str, Any] = {
    kind.DESCRIPTOR.full_name: kind
    for kind in (
        messages.CompressedImage,
        messages.CompressedVideo,
        messages.WindSample,
        messages.WindMean,
        messages.TruthParameters,
    )
}


def salvage(source: Path, target: Path) -> tuple[Finding, ...]:
    """Write all that can be read of the record `source` into the new record `target`.

    Returns:
        what was found: where the file breaks off ("cut-off"), what was left out because its
            checksum or content is
        wrong ("damaged-chunk", "damaged-attachment", "damaged-record"), stretches without a record
            ("unreadable"),
        messages kept without a checksum ("unchecked-messages"), messages of channels whose
            definition is lost
        ("unknown-channel"), messages that the old summary counted and that are gone
            ("lost-messages"), and how much
        was recovered ("recovered").

    Raises:
        NotFoundError: no `source`.
        ConflictError: `target` exists.
        FlagdataError: the disk refuses `target`, of which nothing is left then.
        CorruptError: `source` is not MCAP, or holds no whole message; no `target` is left then.
    """
    try:
        stream = source.open("rb")
    except FileNotFoundError:
        raise NotFoundError(
            "there is no such record", where=str(source), fix="check the path"
        ) from None
    with stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise CorruptError(
                "this is no MCAP record", where=str(source), fix="check that it is the right file"
            )
        out = Output(target)
        try:
            with out:
                copy = _Copy(out)
                summary = _summary(source)
                if summary is not None:
                    copy.define(summary)
                sound = SoundMessages(source, summary)
                _Pass(
                    stream, size=source.stat().st_size, where=str(source), copy=copy, sound=sound
                ).run()
                if not copy.counts:
                    raise CorruptError(
                        "no whole message is left in the record",
                        where=str(source),
                        fix="it is lost",
                    )
                copy.finish()
        except BaseException:
            target.unlink()
            raise
    return tuple(copy.findings)


def _summary(source: Path) -> Summary | None:
    """Reads the record's summary, where it is sound."""
    file = open_bytes(source)
    try:
        return read_summary(file, where=str(source))
    except CorruptError:
        return None
    finally:
        file.close()


class _Copy:
    """The record being written, and the channels read so far."""

    def __init__(self, out: IO[bytes]) -> None:
        self.findings: list[Finding] = []
        self.counts: Counter[str] = Counter()
        self._times: list[int] = []
        self._schemas: dict[int, tuple[Schema, int]] = {}
        self._channels: dict[int, tuple[Channel, int]] = {}
        self._unknown = 0
        self._salvaged = 0
        self._writer = ChecksummedFile(
            out, chunk_size=CHUNK_BYTES[Chunking.COMMITTED], profile=PROFILE, library=library_name()
        )

    def define(self, summary: Summary) -> None:
        """Schemas and channels of a sound summary: the chunk that holds them first may be
        damaged."""
        for schema in summary.schemas.values():
            self.schema(schema)
        for channel in summary.channels.values():
            self.channel(channel)

    def find(
        self, kind: str, severity: Severity, text: str, *, where: str | None = None, count: int = 1
    ) -> None:
        self.findings.append(
            Finding(kind=kind, severity=severity, what=text, where=where, count=count)
        )

    def schema(self, schema: Schema) -> None:
        if schema.id not in self._schemas:
            written = self._writer.register_schema(
                name=schema.name, encoding=schema.encoding, data=schema.data
            )
            self._schemas[schema.id] = (schema, written)

    def channel(self, channel: Channel) -> None:
        if channel.id in self._channels or (
            channel.schema_id and channel.schema_id not in self._schemas
        ):
            return
        written = self._writer.register_channel(
            topic=channel.topic,
            message_encoding=channel.message_encoding,
            schema_id=self._schemas[channel.schema_id][1] if channel.schema_id else 0,
            metadata=channel.metadata,
        )
        self._channels[channel.id] = (channel, written)

    def schema_name(self, channel_id: int) -> str | None:
        """Returns the name of a channel's schema; `None` for a channel that is not known."""
        if channel_id not in self._channels:
            return None
        schema = self._schemas.get(self._channels[channel_id][0].schema_id)
        return schema[0].name if schema else ""

    def message(self, message: Message) -> None:
        if message.channel_id not in self._channels:
            self._unknown += 1
            return
        channel, written = self._channels[message.channel_id]
        self._writer.add_message(
            channel_id=written,
            log_time=message.log_time,
            data=message.data,
            publish_time=message.publish_time,
            sequence=message.sequence,
        )
        self.counts[channel.topic] += 1
        self._times = [min([message.log_time, *self._times]), max([message.log_time, *self._times])]

    def attachment(self, attachment: Attachment) -> None:
        self._writer.add_attachment(
            create_time=attachment.create_time,
            log_time=attachment.log_time,
            name=attachment.name,
            media_type=attachment.media_type,
            data=[attachment.data],
            size=len(attachment.data),
        )

    def metadata(self, metadata: Metadata) -> None:
        if metadata.name == CHECKSUMS:
            return  # of what was there; what is written has its own
        self._salvaged += metadata.name.startswith(SALVAGE)
        self._writer.add_metadata(metadata.name, metadata.metadata)

    def finish(self) -> None:
        if self._unknown:
            self.find(
                "unknown-channel",
                Severity.ERROR,
                f"{self._unknown} messages left out: the definition of their channel is lost",
                count=self._unknown,
            )
        total = self.counts.total()
        parts = ", ".join(f"{count} on {topic}" for topic, count in sorted(self.counts.items()))
        self.find(
            "recovered",
            Severity.NOTE,
            f"{total} messages from {iso(self._times[0])} to {iso(self._times[1])}: {parts}",
            count=total,
        )
        losses = [
            finding.what for finding in self.findings if finding.severity is not Severity.NOTE
        ]
        if losses:
            name = f"{SALVAGE}/{self._salvaged + 1}"
            self._writer.add_metadata(name, {str(i): message for i, message in enumerate(losses)})
        self._writer.finish()


class _Pass:
    """One pass through the damaged file."""

    def __init__(
        self, stream: IO[bytes], *, size: int, where: str, copy: _Copy, sound: SoundMessages
    ) -> None:
        self._stream = stream
        self._size = size
        self._where = where
        self._copy = copy
        self._sound = sound
        self._damaged: list[
            int
        ] = []  # which findings are of damage whose lost messages are not counted
        self._looked = 0  # bytes of chunks that were looked for
        self._lost = 0  # messages, in the findings that count them

    def run(self) -> None:
        while True:
            start = self._stream.tell()
            head = self._stream.read(RECORD_HEAD)
            if len(head) < RECORD_HEAD:
                return self._cut_off(
                    start, "inside a record's head" if head else "between two records"
                )
            opcode, length = struct.unpack("<BQ", head)
            if opcode == Opcode.DATA_END and length == _DATA_END_BYTES:
                self._stream.seek(length, os.SEEK_CUR)
                return self._end()
            is_known = opcode in _DATA_OPCODES or opcode >= _FIRST_PRIVATE
            if is_known and start + RECORD_HEAD + length <= self._size and length <= CHUNK_LIMIT:
                self._record(opcode, self._stream.read(length), start)
                continue
            following = self._next_chunk(start + 1)
            spared = self._spare_messages(start, self._size if following is None else following)
            if opcode == Opcode.CHUNK and spared is None:
                self._stream.seek(start + RECORD_HEAD)
                self._partial(start)
            if following is None:
                if is_known:
                    return self._cut_off(start, f"inside a {_name(opcode)}")
                return self._unreadable(start, self._size, spared)
            self._unreadable(start, following, spared)
            self._stream.seek(following)

    def _next_chunk(self, start: int) -> int | None:
        """Finds where the next chunk begins whose lengths fit and whose checksum is right, at or
        after `start`."""
        with mmap.mmap(self._stream.fileno(), 0, access=mmap.ACCESS_READ) as view:
            for start_match in _CHUNK_START.finditer(view, start):
                at = start_match.start()
                length = int.from_bytes(view[at + 1 : at + RECORD_HEAD], "little")
                end = at + RECORD_HEAD + length
                if end > self._size or length > CHUNK_LIMIT or not _is_chunk(view, at, length):
                    continue
                self._looked += length
                if self._looked > _LOOKS * self._size:
                    return None
                try:
                    chunk = parse(Chunk.read, view[at + RECORD_HEAD : end], where=self._where)
                    records = unpack_chunk(chunk)
                except (
                    FlagdataError
                ):  # anything may follow a byte that only looks like a chunk's first
                    continue
                if (
                    len(records) == chunk.uncompressed_size
                    and zlib.crc32(records) == chunk.uncompressed_crc
                ):
                    return at
        return None

    def _record(self, opcode: int, content: bytes, start: int) -> None:
        try:
            if opcode == Opcode.CHUNK:
                self._chunk(content, start)
            elif opcode == Opcode.ATTACHMENT:
                self._attachment(content, start)
            elif opcode == Opcode.METADATA:
                self._copy.metadata(parse(Metadata.read, content, where=self._where))
            elif opcode in _IN_CHUNK:
                self._inner(opcode, content)
        except FlagdataError as error:
            self._copy.find(
                "damaged-record",
                Severity.ERROR,
                f"a record left out: {error.what}",
                where=f"byte {start}",
            )

    def _spare_messages(self, start: int, end: int) -> tuple[int, int] | None:
        """Copies the messages of damaged bytes of the file that are sound by themselves: how many
        these are, and how many there were; `None` where the record does not state it."""
        messages = self._sound.between(start, end)
        if messages is None:
            return None
        for message in messages:
            if message is not None:
                self._copy.message(message)
        lost = sum(message is None for message in messages)
        self._lost += lost
        return len(messages) - lost, len(messages)

    def _chunk(self, content: bytes, start: int) -> None:
        chunk = parse(Chunk.read, content, where=self._where)
        end = start + RECORD_HEAD + len(content)
        try:
            records = unpack_chunk(chunk)
        except FlagdataError as error:
            return self._damaged_chunk(start, end, error.what)
        for opcode, record in _whole_records(records):
            self._inner(opcode, record)
        return None

    def _inner(self, opcode: int, content: bytes | memoryview) -> None:
        if opcode == Opcode.SCHEMA:
            self._copy.schema(parse(Schema.read, content, where=self._where))
        elif opcode == Opcode.CHANNEL:
            self._copy.channel(parse(Channel.read, content, where=self._where))
        elif opcode == Opcode.MESSAGE:
            self._copy.message(parse(_read_message(len(content)), content, where=self._where))

    def _attachment(self, content: bytes, start: int) -> None:
        if zlib.crc32(content[:-4]) != int.from_bytes(content[-4:], "little"):
            self._copy.find(
                "damaged-attachment",
                Severity.ERROR,
                "an attachment left out: its checksum is wrong",
                where=f"byte {start}",
            )
            return
        self._copy.attachment(parse(Attachment.read, content, where=self._where))

    def _rest(self) -> bytes:
        """Reads what follows in the file, up to what a chunk may hold; a read of more would take
        the memory first."""
        return self._stream.read(min(CHUNK_LIMIT, max(0, self._size - self._stream.tell())))

    def _partial(self, start: int) -> None:
        """Keep the whole messages of a plain chunk whose end is missing, or whose length is
        wrong."""
        content = self._rest()
        if len(content) <= CHUNK_HEAD - RECORD_HEAD:
            return
        first, last, _, _, name_length = _CHUNK_FIELDS.unpack_from(content)
        if name_length:
            return
        copied = 0
        for opcode, record in _whole_records(content[CHUNK_HEAD - RECORD_HEAD :]):
            try:
                if opcode == Opcode.MESSAGE:
                    message = parse(_read_message(len(record)), record, where=self._where)
                    if not first <= message.log_time <= last or not self._plausible(message):
                        break
                    copied += 1
                self._inner(opcode, record)
            except FlagdataError:
                break
        if copied:
            self._copy.find(
                "unchecked-messages",
                Severity.WARNING,
                f"{copied} messages kept from a chunk whose end, and so its checksum, is missing",
                where=f"byte {start}",
                count=copied,
            )

    def _plausible(self, message: Message) -> bool:
        """Checks whether a message without a checksum decodes as what its channel says (a crash may
        leave zeros behind)."""
        kind = _KNOWN.get(self._copy.schema_name(message.channel_id) or "")
        if kind is None:
            return True
        try:
            decoded = kind.FromString(message.data)
        except DecodeError:
            return False
        return kind is not messages.CompressedImage or decoded.data.endswith(b"\xff\xd9")

    def _end(self) -> None:
        """Ends the copy once all data was read. The summary is written anew; what is left of the
        old one says how much there was."""
        stated_count: int | None = None
        for opcode, record in _whole_records(self._rest(), among=frozenset(Opcode)):
            if opcode == Opcode.STATISTICS and len(record) >= 8:
                stated_count = int.from_bytes(record[:8], "little")
        lost = 0 if stated_count is None else stated_count - self._copy.counts.total() - self._lost
        if lost > 0 and len(self._damaged) == 1:
            (damage_index,) = self._damaged
            finding = self._copy.findings[damage_index]
            text = (
                f"{finding.what}; {lost} of the record's {stated_count} messages are lost with it"
            )
            self._copy.findings[damage_index] = replace(finding, what=text, count=lost)
        elif lost > 0:
            self._copy.find(
                "lost-messages",
                Severity.ERROR,
                f"{lost} of {stated_count} messages of the record are lost",
                count=lost,
            )
        self._stream.seek(self._size - len(MAGIC))
        if self._stream.read() != MAGIC:
            self._copy.find(
                "cut-off",
                Severity.NOTE,
                "all data is there; the summary at the end was cut off and is written anew",
                where=f"byte {self._size}",
            )

    def _cut_off(self, start: int, position: str) -> None:
        self._copy.find(
            "cut-off",
            Severity.WARNING,
            f"the file ends {position}, at byte {self._size}",
            where=f"byte {start}",
        )

    def _unreadable(self, start: int, end: int, spared: tuple[int, int] | None) -> None:
        if spared is None:
            self._damage(
                "unreadable", start, f"bytes {start} to {end} hold no record that can be read"
            )
        else:
            self._damage("unreadable", start, f"bytes {start} to {end} are damaged", spared)

    def _damaged_chunk(self, start: int, end: int, why: str) -> None:
        spared = self._spare_messages(start, end)
        self._damage(
            "damaged-chunk",
            start,
            ("a chunk left out: " if spared is None else "a chunk: ") + why,
            spared,
        )

    def _damage(
        self, kind: str, start: int, text: str, spared: tuple[int, int] | None = None
    ) -> None:
        """Reports damage at one place."""
        if spared is None:
            self._damaged.append(len(self._copy.findings))
            self._copy.find(kind, Severity.ERROR, text, where=f"byte {start}")
            return
        copied, present = spared
        if not present:
            self._copy.find(
                kind, Severity.WARNING, f"{text}; no message was there", where=f"byte {start}"
            )
            return
        self._copy.find(
            kind,
            Severity.ERROR,
            f"{text}; {present - copied} of its {present} messages are lost",
            where=f"byte {start}",
            count=present - copied,
        )


def _is_chunk(view: mmap.mmap, at: int, length: int) -> bool:
    """Checks whether the head of a chunk of that length lies there, by the lengths that it states:
    one read in place, since any byte may look like a chunk's first."""
    fields = view[at + RECORD_HEAD : at + CHUNK_HEAD]
    if len(fields) < CHUNK_HEAD - RECORD_HEAD:
        return False
    name_length = _CHUNK_FIELDS.unpack_from(fields)[-1]
    if name_length > _LONGEST_NAME:
        return False
    packed = int.from_bytes(
        view[at + CHUNK_HEAD - 8 + name_length : at + CHUNK_HEAD + name_length], "little"
    )
    return CHUNK_HEAD - RECORD_HEAD + name_length + packed == length


def _whole_records(
    body: bytes | memoryview, *, among: frozenset[Opcode] = _IN_CHUNK
) -> Iterator[tuple[int, memoryview]]:
    """Yields opcode and content of the records that lie whole in `body`, up to the first that does
    not or is not `among`."""
    at = 0
    body = memoryview(body)
    while at + RECORD_HEAD <= len(body):
        opcode, length = struct.unpack_from("<BQ", body, at)
        at += RECORD_HEAD
        if opcode not in among or at + length > len(body):
            return
        yield opcode, body[at : at + length]
        at += length


def _read_message(length: int) -> Callable[[Any], Message]:
    if length < MESSAGE_HEAD - RECORD_HEAD:
        raise CorruptError(
            f"a message has {length} bytes", fix="run `flagdata recover` on the file"
        )
    return lambda stream: Message.read(stream, length)


def _name(opcode: int) -> str:
    return Opcode(opcode).name.lower().replace("_", " ") if opcode in set(Opcode) else "record"
