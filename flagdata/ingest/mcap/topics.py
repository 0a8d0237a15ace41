"""The topics of an MCAP file and their messages, decoded: field → number, text, bytes, list or mapping.

Source: the MCAP specification and its registry of encodings, https://mcap.dev/spec.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import zstandard
from google.protobuf.message import DecodeError, Message
from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.records import Channel, Schema
from mcap.summary import Summary
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray

from flagdata.documents import from_stored_json
from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError, UnknownNameError
from flagdata.files import check_input
from flagdata.ingest.mcap import cdr
from flagdata.record.salvage import CHUNK_LIMIT

STILL, MOVING, RAW = "compressed images", "compressed video", "plain pixels"
PICTURES = {
    "foxglove.CompressedImage": STILL, "foxglove_msgs/msg/CompressedImage": STILL,
    "sensor_msgs/msg/CompressedImage": STILL,
    "foxglove.CompressedVideo": MOVING, "foxglove_msgs/msg/CompressedVideo": MOVING,
    "foxglove.RawImage": RAW, "foxglove_msgs/msg/RawImage": RAW, "sensor_msgs/msg/Image": RAW,
}  # fmt: skip
"""Types of messages that are pictures → what kind."""
_UNREADABLE = (
    McapError, EOFError, ValueError, RuntimeError, DecodeError, zstandard.ZstdError, struct.error, KeyError, TypeError
)  # fmt: skip
"""What libraries raise on damaged chunks and messages; also those that decompress."""

_CHUNK_HEAD = struct.Struct("<BQQQQII")
"""Opcode and length of a chunk's record; first and last time, unpacked size, checksum, length of the compression's
name. The name, the length of the records (8 bytes) and the records follow."""


@dataclass(frozen=True, kw_only=True)
class Topic:
    """A topic of an MCAP file.

    Attributes:
        schema: name of its messages' type; "" where there is none.
        encoding: of its messages: "protobuf", "json", "cdr", …
        count: of its messages.
    """

    name: str
    schema: str
    encoding: str
    count: int

    def __str__(self) -> str:
        return f"{self.name} ({self.count} of {self.schema or self.encoding})"


@dataclass(frozen=True, kw_only=True)
class Decoded:
    """A message.

    Attributes:
        log_time: when it was recorded [UTC ns].
        values: of its fields.
    """

    log_time: int
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def stamp(self) -> int:
        """Its instant [UTC ns]: that of the measurement where it states one that is not zero, else the log's.

        Raises:
            CorruptError: an instant beyond those that 64 bits hold.
        """
        header = self.values.get("header")
        for holder in (self.values, header if isinstance(header, Mapping) else {}):
            for name in ("timestamp", "stamp"):
                instant = _instant(holder.get(name))
                if instant:
                    return _checked(instant)
        return _checked(self.log_time)


def profile(path: Path) -> str:
    """What an MCAP file's header says its content is: "flagdata", "ros2", "" …

    Raises:
        CorruptError: it cannot be read.
    """
    with _opened(path) as (reader, _):
        return reader.get_header().profile


def topics(path: Path) -> tuple[Topic, ...]:
    """The topics of a file that have messages, by name.

    Raises:
        CorruptError: a file that was cut off, or whose summary is damaged.
        LimitError: a chunk that would unpack to more than `CHUNK_LIMIT`.
    """
    with _opened(path) as (_, summary):
        return _topics(summary)


def choose(found: Sequence[Topic], wanted: str | None, *, where: str, noun: str) -> Topic:
    """The topic of a name, or the only one.

    Args:
        noun: what they hold ("pictures"), for messages.

    Raises:
        UnknownNameError: none of that name.
        InputError: none, or several and none is named.
    """
    if wanted is not None:
        for topic in found:
            if topic.name == wanted:
                return topic
        raise UnknownNameError.of(f"topic of {noun}", wanted, [topic.name for topic in found], where=where)
    if len(found) == 1:
        return found[0]
    listed = ", ".join(map(str, found))
    what = f"{len(found)} topics hold {noun}: {listed}" if found else f"no topic holds {noun}"
    raise InputError(what, where=where, fix="choose one: --topic NAME" if found else "see flagdata doctor FILE")


def messages(path: Path, topic: str, *, since: int = 0) -> Iterator[Decoded]:
    """The messages of a topic in order of log time, from an instant on [UTC ns].

    Raises:
        InputError: an encoding that is not read.
        CorruptError: a chunk or message that is damaged; those before it have been given.
    """
    with _opened(path) as (reader, _):
        decode: Callable[[bytes], Mapping[str, Any]] | None = None
        for schema, channel, message in reader.iter_messages(topics=[topic], starting_at=since or None):
            decode = decode or _decoder(schema, channel)
            yield Decoded(log_time=message.log_time, values=decode(message.data))


def instants(path: Path, topic: str, *, limit: int | None = None) -> NDArray[np.int64]:
    """(n, 2) when each message of a topic was measured and when it was logged [UTC ns], in order of logging.

    Raises:
        LimitError: more messages than `limit`, whatever the file's summary states.
        InputError, CorruptError: as `messages`; or an instant beyond those that 64 bits hold.
    """
    pairs: list[tuple[int, int]] = []
    for one in messages(path, topic):
        if len(pairs) == limit:
            raise LimitError(
                f"more than {limit} messages in {topic}", where=str(path), fix="cut the file, or raise the limit"
            )
        pairs.append((one.stamp, _checked(one.log_time)))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[McapReader, Summary]]:
    check_input(path)
    where = str(path)
    try:
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            if summary is None or summary.statistics is None:
                raise CorruptError(
                    "an MCAP file without a summary: it was cut off, or written by a program that adds none",
                    where=where, fix="write one: flagdata recover FILE NEW.mcap, or mcap recover",
                )  # fmt: skip
            _check_chunks(stream, summary, where=where)
            yield reader, summary
    except FlagdataError:
        raise
    except _UNREADABLE as error:
        what = f"the MCAP file is damaged or cut off: {type(error).__name__} {error}".strip()
        raise CorruptError(what, where=where, fix="salvage what is whole: flagdata recover FILE NEW.mcap") from None


def _check_chunks(stream: IO[bytes], summary: Summary, *, where: str) -> None:
    """Whether all chunks are small enough to be unpacked, by what they state and by what their zstd frames state.

    Raises:
        LimitError: one is not.
    """
    for index in summary.chunk_indexes:
        stream.seek(index.chunk_start_offset)
        head = stream.read(_CHUNK_HEAD.size)
        *_, size, _, named = _CHUNK_HEAD.unpack(head)
        if named == len("zstd") and stream.read(named) == b"zstd":
            stream.seek(8, os.SEEK_CUR)
            size = max(size, zstandard.frame_content_size(stream.read(18)))
        if size > CHUNK_LIMIT:
            raise LimitError(
                f"a chunk claims to unpack to {size} bytes", where=where,
                fix=f"at most {CHUNK_LIMIT} are unpacked at once: write smaller chunks",
            )  # fmt: skip


def _topics(summary: Summary) -> tuple[Topic, ...]:
    counts = summary.statistics.channel_message_counts if summary.statistics is not None else {}
    found: dict[str, Topic] = {}
    for number, channel in summary.channels.items():
        schema = summary.schemas.get(channel.schema_id)
        before = found[channel.topic].count if channel.topic in found else 0
        found[channel.topic] = Topic(
            name=channel.topic, schema=schema.name if schema is not None else "", encoding=channel.message_encoding,
            count=before + counts.get(number, 0),
        )  # fmt: skip
    return tuple(found[name] for name in sorted(found) if found[name].count)


def _decoder(schema: Schema | None, channel: Channel) -> Callable[[bytes], Mapping[str, Any]]:
    encoding = channel.message_encoding
    if encoding == "protobuf" and schema is not None:
        made = DecoderFactory().decoder_for(encoding, schema)
        if made is not None:
            return lambda data: _values(made(data))
    if encoding == "json":
        return _from_json
    if encoding == "cdr" and schema is not None and schema.encoding == "ros2msg":
        return cdr.decoder(schema.name, schema.data.decode(errors="replace"))
    described = f" described by {schema.encoding}" if schema is not None and schema.encoding else ""
    raise InputError(
        f"messages in {encoding}{described} are not read", where=channel.topic,
        fix="give protobuf, JSON or ROS 2 (CDR with ros2msg); ROS 1 bags: mcap convert, or rosbags-convert",
    )  # fmt: skip


def _from_json(data: bytes) -> Mapping[str, Any]:
    value = from_stored_json(data.decode())
    return value if isinstance(value, dict) else {"value": value}


def _values(message: Message) -> dict[str, Any]:
    """The fields of a protobuf message; those that may be absent and are, are not there."""
    found: dict[str, Any] = {}
    for one in message.DESCRIPTOR.fields:
        value = getattr(message, one.name)
        if one.message_type is not None and one.message_type.GetOptions().map_entry:
            continue
        if isinstance(value, Sequence) and not isinstance(value, str | bytes):
            found[one.name] = [_values(part) if isinstance(part, Message) else part for part in value]
        elif isinstance(value, Message):
            if message.HasField(one.name):
                found[one.name] = _values(value)
        elif not one.has_presence or message.HasField(one.name):
            found[one.name] = value
    return found


def _checked(instant: int) -> int:
    """An instant, unless 64 bits do not hold it.

    Raises:
        CorruptError: they do not.
    """
    if not -(1 << 63) <= instant < 1 << 63:
        raise CorruptError(f"a message states an instant of {instant} ns", fix="mend the recorder's clock")
    return instant


def _instant(stamp: object) -> int | None:
    """UTC nanoseconds of a time as protobuf, ROS 2 or Foxglove's JSON state it."""
    if isinstance(stamp, Mapping):
        seconds = stamp.get("seconds", stamp.get("sec"))
        part = stamp.get("nanos", stamp.get("nanosec", stamp.get("nsec")))
        if isinstance(seconds, int) and isinstance(part, int):
            return seconds * 1_000_000_000 + part
    return None
