"""The topics of MCAP files and their messages, decoded: field → number, text, bytes, list or
mapping.

A topic may be on several channels, each with a definition of its own: every message is decoded by
that of its channel. Messages of different types are topics of their own, whatever their topic's
name, since they are no one series.

Source: the MCAP specification and its registry of encodings, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import message as protobuf
from mcap.exceptions import McapError
from mcap.records import Channel, Schema
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding
from flagdata.core.shell import command_line
from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError, UnknownNameError
from flagdata.ingest.mcap import cdr
from flagdata.ingest.mcap.bags import is_described, parts_of
from flagdata.ingest.mcap.mcap_layout import Layout, Message, Messages, layout_of
from flagdata.ingest.mcap.message_instants import (
    Stamp,
    check_instant,
    clock_findings,
    few_without_date,
    order_of,
    stamp_of,
)
from flagdata.recipes.documents import from_stored_json
from flagdata.timebase import NANOSECONDS

STILL, MOVING, RAW = "compressed images", "compressed video", "plain pixels"
_PICTURES = {
    "foxglove.CompressedImage": STILL,
    "foxglove_msgs/CompressedImage": STILL,
    "sensor_msgs/CompressedImage": STILL,
    "foxglove.CompressedVideo": MOVING,
    "foxglove_msgs/CompressedVideo": MOVING,
    "foxglove.RawImage": RAW,
    "foxglove_msgs/RawImage": RAW,
    "sensor_msgs/Image": RAW,
}
"""Types of messages that are pictures, those of ROS 2 as ROS 1 names them → what kind."""
_UNREADABLE = (
    McapError,
    EOFError,
    ValueError,
    protobuf.DecodeError,
    struct.error,
    KeyError,
    TypeError,
)
"""What libraries raise on damaged records and messages."""
_OVERLAP = 2.5
"""s by which a part of a recording may begin before the end of the one before, by the log."""


@dataclass(frozen=True, kw_only=True)
class Topic:
    """The messages of one type on a topic.

    Attributes:
        name: of the topic; where messages of several types are on it, with the type behind a colon.
        plain: the topic's name alone.
        schema: name of the messages' type; "" where there is none.
        encoding: of its messages: "protobuf", "json", "cdr", …
        count: of its messages.
        channels: on which they are: number of the file, and of the channel within it.
    """

    name: str
    plain: str
    schema: str
    encoding: str
    count: int
    channels: frozenset[tuple[int, int]]

    @property
    def type(self) -> str:
        """Its messages' type; that of ROS 2 as ROS 1 names it: "sensor_msgs/Image" for
        "sensor_msgs/msg/Image"."""
        return self.schema.replace("/msg/", "/")

    @property
    def pictures(self) -> str | None:
        """What kind of pictures its messages are; `None` where they are none."""
        return _PICTURES.get(self.type)

    def __str__(self) -> str:
        return f"{self.name} ({self.count} of {self.schema or self.encoding})"


@dataclass(frozen=True, kw_only=True)
class Decoded:
    """A message.

    Attributes:
        position: number of its file, of its block there, and its offset in that.
        log_time: when it was recorded [UTC ns].
        values: of its fields.
        dated: its instant by its topic's `Index` [UTC ns]; `None` where that was not asked.
    """

    position: tuple[int, int, int] = (0, 0, 0)
    log_time: int
    dated: int | None = None
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def said(self) -> Stamp:
        """What it says of its instant.

        Raises:
            CorruptError: an instant beyond those that 64 bits hold.
        """
        return stamp_of(self.values)

    @property
    def stamp(self) -> int:
        """Its instant [UTC ns]: that of the measurement where it states one that is not zero, else
        the log's.

        Raises:
            CorruptError: an instant beyond those that 64 bits hold.
        """
        if self.dated is not None:
            return self.dated
        instant = self.said.instant
        return check_instant(self.log_time) if instant is None else instant


@dataclass(frozen=True, kw_only=True)
class Index:
    """The messages of a topic in the order in which they are to be read.

    Attributes:
        rows: (n,) number of each in the order of the file.
        places: (n, 3) as `Decoded.position`.
        stamps, logged: (n,) when each was measured and when it was logged [UTC ns].
        in_time: whether they are in the order of their instants, to within a slip where that of the
            file stands.
        findings: what to report of their order, their clocks and of those that are missing.
    """

    rows: NDArray[np.intp]
    places: IntArray
    stamps: IntArray
    logged: IntArray
    in_time: bool
    findings: tuple[Finding, ...]

    def part(self, first: int, end: int | None = None) -> Index:
        """Returns the messages from one place on, or up to another."""
        rows = slice(first, end)
        return replace(
            self,
            rows=self.rows[rows],
            places=self.places[rows],
            stamps=self.stamps[rows],
            logged=self.logged[rows],
        )


def profile(path: Path) -> str:
    """Reads what the header of an MCAP file, or of a folder's first, says its content is:
    "flagdata", "ros2", "" …

    Raises:
        CorruptError: it cannot be read.
    """
    return _layouts(path)[0].profile


def topics(path: Path) -> tuple[Topic, ...]:
    """Lists the topics that have messages, by name, of an MCAP file or of the parts of a folder.

    Raises:
        CorruptError: a file that was cut off or is damaged.
        LimitError: a chunk that would unpack to more than the limit.
    """
    layouts = _layouts(path)
    channels_by_topic: dict[tuple[str, str], dict[tuple[int, int], int]] = {}
    encodings: dict[tuple[str, str], str] = {}
    for part, layout in enumerate(layouts):
        for number, channel in layout.channels.items():
            count = layout.counts.get(number, 0)
            if not count and not layout.announced.get(number):
                continue
            schema = layout.schemas.get(channel.schema_id)
            key = (channel.topic, schema.name if schema is not None else "")
            channels_by_topic.setdefault(key, {})[part, number] = count
            encodings[key] = channel.message_encoding
    types = [plain for plain, _ in channels_by_topic]
    return tuple(
        Topic(
            name=plain
            if types.count(plain) == 1
            else f"{plain}:{schema or encodings[plain, schema]}",
            plain=plain,
            schema=schema,
            encoding=encodings[plain, schema],
            count=sum(channels.values()),
            channels=frozenset(channels),
        )
        for (plain, schema), channels in sorted(channels_by_topic.items())
    )


def choose(candidates: Sequence[Topic], wanted: str | None, *, where: str, noun: str) -> Topic:
    """Chooses the topic of a name, or the only one.

    Args:
        noun: what they hold ("pictures"), for messages.

    Raises:
        UnknownNameError: none of that name.
        InputError: none, or several and none is named; or messages of several types on the topic.
    """
    if wanted is not None:
        for topic in candidates:
            if topic.name == wanted:
                return topic
        typed = [topic for topic in candidates if topic.plain == wanted]
        if not typed:
            raise UnknownNameError.of(
                f"topic of {noun}", wanted, [topic.name for topic in candidates], where=where
            )
        message = (
            f"messages of several types are on {wanted}, which are no one series: "
            f"{', '.join(map(str, typed))}"
        )
        raise InputError(
            message,
            where=where,
            fix=f"choose one by its type: {command_line('--topic', typed[0].name)}",
        )
    if len(candidates) == 1:
        return candidates[0]
    listed = ", ".join(map(str, candidates))
    message = (
        f"{len(candidates)} topics hold {noun}: {listed}"
        if candidates
        else f"no topic holds {noun}"
    )
    raise InputError(
        message,
        where=where,
        fix="choose one: --topic NAME" if candidates else "see flagdata doctor FILE",
    )


def messages(path: Path, topic: str, *, picked: Index | None = None) -> Iterator[Decoded]:
    """Yields the messages of a topic in the order of the file, or those of an index in its.

    Args:
        topic: its name, as `topics` gives it.
        picked: the index; `None` for all.

    Raises:
        InputError: an encoding that is not read.
        CorruptError: a chunk or message that is damaged; those before it have been given.
    """
    layouts = _layouts(path)
    channels = {
        channel for present in topics(path) if present.name == topic for channel in present.channels
    }
    with ExitStack() as stack:
        opened = [stack.enter_context(closing(Messages(layout))) for layout in layouts]
        decoders: dict[tuple[int, int], Callable[[bytes], Mapping[str, Any]]] = {}

        def decode_message(part: int, message: Message) -> Decoded:
            key = (part, message.channel)
            if key not in decoders:
                channel = layouts[part].channels[message.channel]
                decoders[key] = _decoder(
                    layouts[part].path, layouts[part].schemas.get(channel.schema_id), channel
                )
            position = (part, message.block, message.offset)
            return Decoded(
                position=position, log_time=message.log_time, values=decoders[key](message.data)
            )

        if picked is not None:
            for (part, block, offset), dated in zip(
                picked.places.tolist(), picked.stamps.tolist(), strict=True
            ):
                with _readable(layouts[part].path):
                    read_message = decode_message(part, opened[part].at(block, offset))
                yield replace(read_message, dated=dated)
            return
        for part, file in enumerate(opened):
            walk = file.of({number for of_part, number in channels if of_part == part})
            while True:
                with _readable(layouts[part].path):
                    message = next(walk, None)
                    read_message = None if message is None else decode_message(part, message)
                if read_message is None:
                    break
                yield read_message


def index(
    path: Path,
    topic: str,
    *,
    limit: int | None = None,
    sort: bool = True,
    visit: Callable[[Decoded], object] | None = None,
) -> Index:
    """Indexes the messages of a topic in the order of their instants.

    Args:
        sort: whether to put messages in order that are a slip late; else they stay in that of the
            file or the log.
        visit: called with every message, in the order of the file.

    Raises:
        LimitError: more messages than `limit`, whatever the file's summary states.
        InputError, CorruptError: as `messages`; or an instant beyond those that 64 bits hold.
    """
    numbers = array("q")
    states_instant, has_field = bytearray(), bytearray()
    for message in messages(path, topic):
        if len(states_instant) == limit:
            raise LimitError(
                f"there are more than {limit} messages in {topic}",
                where=str(path),
                fix="cut the file, or raise the limit",
            )
        stamp, logged = message.said, check_instant(message.log_time)
        states_instant.append(stamp.instant is not None)
        has_field.append(stamp.field)
        numbers.extend(
            (*message.position, logged if stamp.instant is None else stamp.instant, logged)
        )
        if visit is not None:
            visit(message)
    table = np.array(numbers, dtype=np.int64).reshape(-1, 5)
    places, stamps, logged = table[:, :3], table[:, 3], table[:, 4]
    if not is_described(path):
        _check_successive(path, topic, places, logged)
    with_field = np.frombuffer(has_field, dtype=bool)
    by_log = ~np.frombuffer(states_instant, dtype=bool) | few_without_date(stamps, logged)
    stamps[by_log] = logged[by_log]
    order = order_of(stamps, logged, sort=sort, where=topic)
    findings = clock_findings(
        stamps,
        logged,
        unset=int((by_log & with_field).sum()),
        unstated=int((~with_field).sum()),
        where=topic,
    )
    return Index(
        rows=order.rows,
        places=places[order.rows],
        stamps=stamps[order.rows],
        logged=logged[order.rows],
        in_time=order.in_time,
        findings=(*_missing(path, topic), *order.findings, *findings),
    )


def _check_successive(path: Path, topic: str, places: IntArray, logged: IntArray) -> None:
    """Refuse the files of a folder that were recorded at the same time: their messages are no one
    series.

    Raises:
        InputError: one begins, by the log, before the end of another.
    """
    parts = parts_of(path)
    spans = []
    for part in range(len(parts)):
        instants = logged[places[:, 0] == part]
        if len(instants):
            spans.append((int(instants.min()), int(instants.max()), part))
    for before, after in pairwise(sorted(spans)):
        overlap = (before[1] - after[0]) / NANOSECONDS
        if overlap > _OVERLAP:
            raise InputError(
                f"{topic} begins there {overlap:.1f} s before its end in {parts[before[2]].name}: "
                "not successive parts "
                "of one recording",
                where=str(parts[after[2]]),
                fix=f"ingest each by itself: {command_line('flagdata', 'ingest', path)}/*.mcap",
            )


def _missing(path: Path, topic: str) -> Iterator[Finding]:
    """Findings of messages that are not where files say that they are."""
    layouts = _layouts(path)
    chosen = next(
        (present.channels for present in topics(path) if present.name == topic), frozenset()
    )
    lost = sum(layouts[part].missing([number]) for part, number in chosen)
    if lost:
        count = sum(layouts[part].counts.get(number, 0) for part, number in chosen)
        yield Finding.of(
            "messages-missing",
            f"the summary counts {count + lost} messages of {topic}, {count} are there: {lost} are "
            "lost",
            where=topic,
            count=lost,
            fix="copy the file again, or record it again",
        )
    for layout in layouts:
        yield from layout.undefined_findings()


def _layouts(path: Path) -> list[Layout]:
    layouts: list[Layout] = []
    for part in parts_of(path):
        with _readable(part):
            layouts.append(layout_of(part))
    return layouts


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Turn what libraries raise on damage of a file into `CorruptError`."""
    try:
        yield
    except FlagdataError:
        raise
    except _UNREADABLE as error:
        message = f"the MCAP file is damaged or cut off: {type(error).__name__} {error}".strip()
        raise CorruptError(
            message, where=str(path), fix="salvage what is whole: flagdata recover FILE NEW.mcap"
        ) from None


def _decoder(
    path: Path, schema: Schema | None, channel: Channel
) -> Callable[[bytes], Mapping[str, Any]]:
    encoding = channel.message_encoding
    if encoding == "protobuf" and schema is not None:
        decode = DecoderFactory().decoder_for(encoding, schema)
        if decode is not None:
            return lambda data: _values(decode(data))
    if encoding == "json":
        return _from_json
    if schema is not None and (encoding, schema.encoding) in (
        ("cdr", "ros2msg"),
        ("ros1", "ros1msg"),
    ):
        return cdr.decoder(
            schema.name, schema.data.decode(errors="replace"), ros1=encoding == "ros1"
        )
    described = f" described by {schema.encoding}" if schema is not None and schema.encoding else ""
    raise InputError(
        f"messages in the encoding {encoding or 'none'}{described} cannot be decoded",
        where=f"{path}, {channel.topic}",
        fix="record the topic in protobuf, JSON, ROS 2 (CDR with ros2msg) or ROS 1 (ros1msg)",
    )


def _from_json(data: bytes) -> Mapping[str, Any]:
    value = from_stored_json(data.decode())
    return value if isinstance(value, dict) else {"value": value}


def _values(message: protobuf.Message) -> dict[str, Any]:
    """Returns the fields of a protobuf message; those that may be absent and are, are not there."""
    values: dict[str, Any] = {}
    for descriptor in message.DESCRIPTOR.fields:
        value = getattr(message, descriptor.name)
        if descriptor.message_type is not None and descriptor.message_type.GetOptions().map_entry:
            continue
        if isinstance(value, Sequence) and not isinstance(value, str | bytes):
            values[descriptor.name] = [
                _values(part) if isinstance(part, protobuf.Message) else part for part in value
            ]
        elif isinstance(value, protobuf.Message):
            if message.HasField(descriptor.name):
                values[descriptor.name] = _values(value)
        elif not descriptor.has_presence or message.HasField(descriptor.name):
            values[descriptor.name] = value
    return values
