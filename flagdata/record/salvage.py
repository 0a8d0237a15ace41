"""Recovers what a cut-off or damaged MCAP file still holds, in one pass from its start, into a whole record.

A crash, a full disk or a pulled cable leaves a file without the summary that readers by offset need. Everything before
the break is sound: whole chunks are checked by their CRC-32, and whole messages of a last, partial, uncompressed chunk
are kept too, named as unchecked. Nothing is invented: every message written is byte for byte one that was read.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Message, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import CompressionType, Writer

from flagdata.errors import ConflictError, CorruptError, FlagdataError, NotFoundError
from flagdata.findings import Finding, Severity
from flagdata.record import messages
from flagdata.record.container import CHUNK_HEAD, MAGIC, MESSAGE_HEAD, RECORD_HEAD, parse
from flagdata.record.metadata import SALVAGE
from flagdata.record.writer import CHUNK_BYTES, PROFILE, Chunking, library_name
from flagdata.timebase import iso

CHUNK_LIMIT = 1 << 30
"""No chunk, packed or not, is taken to be larger than this [B]; a longer one is a damaged length."""
_DATA_OPCODES = frozenset(Opcode) - {Opcode.FOOTER}
_CHUNK_FIELDS = struct.Struct("<QQQII")
_KNOWN: dict[str, Any] = {
    kind.DESCRIPTOR.full_name: kind
    for kind in (
        messages.CompressedImage, messages.CompressedVideo, messages.WindSample, messages.WindMean,
        messages.TruthParameters,
    )
}  # fmt: skip


def salvage(source: Path, target: Path) -> tuple[Finding, ...]:
    """Write all that can be read of the record `source` into the new record `target`.

    Returns:
        what was found: where the file breaks off ("cut-off"), chunks left out because their checksum is wrong
        ("damaged-chunk", "damaged-attachment", "damaged-record"), where no record can be found any more
        ("unreadable"), messages kept without a checksum ("unchecked-messages"), messages of channels whose
        definition is lost ("unknown-channel"), and how much was recovered ("recovered").

    Raises:
        NotFoundError: no `source`.
        ConflictError: `target` exists.
        CorruptError: `source` is not MCAP, or holds no whole message; no `target` is left then.
    """
    try:
        stream = source.open("rb")
    except FileNotFoundError:
        raise NotFoundError("no such record", where=str(source), fix="check the path") from None
    with stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise CorruptError("not an MCAP record", where=str(source), fix="check that it is the right file")
        try:
            out = target.open("xb")
        except FileExistsError:
            raise ConflictError("the target exists", where=str(target), fix="choose another path") from None
        try:
            with out:
                copy = _Copy(out)
                _Pass(stream, size=source.stat().st_size, where=str(source), copy=copy).run()
                if not copy.counts:
                    raise CorruptError("no whole message is left in the record", where=str(source), fix="it is lost")
                copy.finish()
        except BaseException:
            target.unlink()
            raise
    return tuple(copy.findings)


class _Copy:
    """The record being written, and what is known of the channels so far."""

    def __init__(self, out: IO[bytes]) -> None:
        self.findings: list[Finding] = []
        self.counts: Counter[str] = Counter()
        self._times: list[int] = []
        self._schemas: dict[int, tuple[Schema, int]] = {}
        self._channels: dict[int, tuple[Channel, int]] = {}
        self._unknown = 0
        self._salvaged = 0
        self._writer = Writer(
            out, chunk_size=CHUNK_BYTES[Chunking.COMMITTED], compression=CompressionType.NONE, enable_data_crcs=True
        )
        self._writer.start(profile=PROFILE, library=library_name())

    def find(self, kind: str, severity: Severity, what: str, *, where: str | None = None, count: int = 1) -> None:
        self.findings.append(Finding(kind=kind, severity=severity, what=what, where=where, count=count))

    def schema(self, schema: Schema) -> None:
        if schema.id not in self._schemas:
            written = self._writer.register_schema(name=schema.name, encoding=schema.encoding, data=schema.data)
            self._schemas[schema.id] = (schema, written)

    def channel(self, channel: Channel) -> None:
        if channel.id in self._channels or (channel.schema_id and channel.schema_id not in self._schemas):
            return
        written = self._writer.register_channel(
            topic=channel.topic,
            message_encoding=channel.message_encoding,
            schema_id=self._schemas[channel.schema_id][1] if channel.schema_id else 0,
            metadata=channel.metadata,
        )
        self._channels[channel.id] = (channel, written)

    def schema_name(self, channel_id: int) -> str | None:
        """Of a known channel; `None` for a channel that is not known."""
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
            data=attachment.data,
        )

    def metadata(self, metadata: Metadata) -> None:
        self._salvaged += metadata.name.startswith(SALVAGE)
        self._writer.add_metadata(metadata.name, metadata.metadata)

    def finish(self) -> None:
        if self._unknown:
            self.find(
                "unknown-channel", Severity.ERROR,
                f"{self._unknown} messages left out: the definition of their channel is lost", count=self._unknown,
            )  # fmt: skip
        total = self.counts.total()
        parts = ", ".join(f"{count} on {topic}" for topic, count in sorted(self.counts.items()))
        self.find(
            "recovered", Severity.NOTE,
            f"{total} messages from {iso(self._times[0])} to {iso(self._times[1])}: {parts}", count=total,
        )  # fmt: skip
        losses = [finding.what for finding in self.findings if finding.severity is not Severity.NOTE]
        if losses:
            name = f"{SALVAGE}/{self._salvaged + 1}"
            self._writer.add_metadata(name, {str(i): what for i, what in enumerate(losses)})
        self._writer.finish()


class _Pass:
    """One pass through the damaged file."""

    def __init__(self, stream: IO[bytes], *, size: int, where: str, copy: _Copy) -> None:
        self._stream = stream
        self._size = size
        self._where = where
        self._copy = copy

    def run(self) -> None:
        while True:
            start = self._stream.tell()
            head = self._stream.read(RECORD_HEAD)
            if len(head) < RECORD_HEAD:
                return self._cut_off(start, "between two records" if not head else "inside a record's head")
            opcode, length = struct.unpack("<BQ", head)
            if opcode not in _DATA_OPCODES and opcode < 0x80:
                return self._damaged(start, f"no record begins at byte {start}")
            if start + RECORD_HEAD + length > self._size:
                return self._partial(opcode, length, start)
            if opcode == Opcode.DATA_END:
                return self._end(start + RECORD_HEAD + length)
            if length > CHUNK_LIMIT:
                return self._damaged(start, f"a record at byte {start} claims {length} bytes")
            self._record(opcode, self._stream.read(length), start)

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
            self._copy.find("damaged-record", Severity.ERROR, f"a record left out: {error.what}", where=f"byte {start}")

    def _chunk(self, content: bytes, start: int) -> None:
        chunk = parse(Chunk.read, content, where=self._where)
        if chunk.uncompressed_size > CHUNK_LIMIT:
            return self._damaged_chunk(start, f"it claims to unpack to {chunk.uncompressed_size} bytes")
        try:
            inside, length = get_chunk_data_stream(chunk)
            records = inside.read(length)
        except Exception as error:  # noqa: BLE001  mcap, zstandard and lz4 each raise errors of their own
            return self._damaged_chunk(start, f"it does not unpack: {error}")
        if chunk.uncompressed_crc and zlib.crc32(records) != chunk.uncompressed_crc:
            return self._damaged_chunk(start, "its checksum is wrong")
        for opcode, record in _whole_records(records):
            self._inner(opcode, record)
        return None

    def _inner(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            self._copy.schema(parse(Schema.read, content, where=self._where))
        elif opcode == Opcode.CHANNEL:
            self._copy.channel(parse(Channel.read, content, where=self._where))
        elif opcode == Opcode.MESSAGE:
            self._copy.message(parse(_read_message(len(content)), content, where=self._where))

    def _attachment(self, content: bytes, start: int) -> None:
        if zlib.crc32(content[:-4]) != int.from_bytes(content[-4:], "little"):
            self._copy.find(
                "damaged-attachment", Severity.ERROR, "an attachment left out: its checksum is wrong",
                where=f"byte {start}",
            )  # fmt: skip
            return
        self._copy.attachment(parse(Attachment.read, content, where=self._where))

    def _partial(self, opcode: int, length: int, start: int) -> None:
        """The file ends inside a record that claims `length` bytes: keep the whole messages of a plain chunk."""
        content = self._stream.read(CHUNK_LIMIT)
        kept = 0
        if opcode == Opcode.CHUNK and len(content) > CHUNK_HEAD - RECORD_HEAD and length <= CHUNK_LIMIT:
            first, last, _, _, name_length = _CHUNK_FIELDS.unpack_from(content)
            if name_length == 0:
                for inner, record in _whole_records(content[CHUNK_HEAD - RECORD_HEAD :]):
                    if inner == Opcode.MESSAGE:
                        message = parse(_read_message(len(record)), record, where=self._where)
                        if not first <= message.log_time <= last or not self._plausible(message):
                            break
                        kept += 1
                    self._inner(inner, record)
        if kept:
            self._copy.find(
                "unchecked-messages", Severity.WARNING,
                f"{kept} messages kept from a chunk whose end, and so its checksum, is missing",
                where=f"byte {start}", count=kept,
            )  # fmt: skip
        self._cut_off(start, f"inside a {_name(opcode)}")

    def _plausible(self, message: Message) -> bool:
        """Whether a message without a checksum decodes as what its channel says (a crash may leave zeros behind)."""
        kind = _KNOWN.get(self._copy.schema_name(message.channel_id) or "")
        if kind is None:
            return True
        try:
            decoded = kind.FromString(message.data)
        except DecodeError:
            return False
        return kind is not messages.CompressedImage or decoded.data.endswith(b"\xff\xd9")

    def _end(self, at: int) -> None:
        """All data was read; only the summary may be missing or damaged, and it is written anew."""
        self._stream.seek(max(self._size - len(MAGIC), at))
        if self._stream.read() != MAGIC:
            self._copy.find(
                "cut-off", Severity.NOTE, "all data is there; the summary at the end was cut off and is written anew",
                where=f"byte {self._size}",
            )  # fmt: skip

    def _cut_off(self, start: int, place: str) -> None:
        self._copy.find(
            "cut-off", Severity.WARNING, f"the file ends {place}, at byte {self._size}", where=f"byte {start}"
        )

    def _damaged(self, start: int, what: str) -> None:
        self._copy.find("unreadable", Severity.ERROR, f"{what}; nothing after it can be read", where=f"byte {start}")

    def _damaged_chunk(self, start: int, why: str) -> None:
        self._copy.find("damaged-chunk", Severity.ERROR, f"a chunk left out: {why}", where=f"byte {start}")


_IN_CHUNK = frozenset({Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE})


def _whole_records(body: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of the records that lie whole in `body`, up to the first that does not."""
    at = 0
    while at + RECORD_HEAD <= len(body):
        opcode, length = struct.unpack_from("<BQ", body, at)
        at += RECORD_HEAD
        if opcode not in _IN_CHUNK or at + length > len(body):
            return
        yield opcode, body[at : at + length]
        at += length


def _read_message(length: int) -> Callable[[Any], Message]:
    if length < MESSAGE_HEAD - RECORD_HEAD:
        raise CorruptError(f"a message of {length} bytes", fix="run `flagdata recover` on the file")
    return lambda stream: Message.read(stream, length)


def _name(opcode: int) -> str:
    return Opcode(opcode).name.lower().replace("_", " ") if opcode in set(Opcode) else "record"
