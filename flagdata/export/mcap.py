"""MCAP subsets: each artifact as a record of its own, message by message as it was recorded.

A clip keeps its frames and the wind from a truth window before its first frame, so that its ground truth can be worked
out again from the subset alone. Messages, schemas and metadata are copied byte for byte; whole records as files.
"""

from __future__ import annotations

import heapq
import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, Writer

from flagdata.errors import CorruptError, UsageError
from flagdata.export.source import Entry, Source, label_units
from flagdata.record import Coding
from flagdata.schema import TOPIC_IMAGE, TOPIC_TRUTH, Kind

SAMPLE = "sample"
"""Metadata record of a subset: the artifact it is, the object it was cut from, and its label as JSON."""
CHUNK_BYTES = 1 << 20  # uncompressed, as in committed records: readers reach a frame directly

_Copied: TypeAlias = tuple[Schema | None, Channel, Message]


@dataclass(frozen=True, kw_only=True)
class Mcap:
    """Files <artifact>.mcap."""

    kinds: ClassVar[frozenset[Kind]] = frozenset({Kind.CLIP, Kind.RECORDING, Kind.CAMERA, Kind.WIND})

    def write(self, source: Source, folder: Path, advance: Callable[[int], None]) -> Mapping[str, Any]:
        frames = 0
        for entry in source.entries():
            target = folder / f"{entry.key}.mcap"
            if entry.is_slice:
                if entry.record.coding is Coding.H264:
                    raise UsageError(
                        "a clip cut out of H.264 cannot be decoded without the frames before it",
                        where=entry.key,
                        fix="export it as mp4 or webdataset, or the whole recording as mcap",
                    )
                _cut(entry, target)
            else:
                shutil.copyfile(entry.path, target)
            frames += entry.count
            advance(1)
        return {"records": len(source), "frames": frames, "units": label_units()}


def _cut(entry: Entry, target: Path) -> None:
    with entry.path.open("rb") as stream, target.open("xb") as sink:
        reader = make_reader(stream, validate_crcs=True)
        writer = Writer(sink, chunk_size=CHUNK_BYTES, compression=CompressionType.NONE, enable_data_crcs=True)
        try:
            writer.start(profile=reader.get_header().profile, library=reader.get_header().library)
            _copy_metadata(reader, writer, entry)
            copied = _Copier(writer)
            for schema, channel, message in _messages(reader, entry):
                copied.add(schema, channel, message)
        except McapError as error:
            raise CorruptError(
                f"the record cannot be read: {error}", where=entry.key, fix="run flagdata verify"
            ) from None
        writer.finish()


def _messages(reader: McapReader, entry: Entry) -> Iterator[_Copied]:
    """Parameters first, then frames and all other topics in order of log time."""
    summary = reader.get_summary()
    topics = {channel.topic for channel in summary.channels.values()} if summary else set()
    yield from _between(reader, topics & {TOPIC_TRUTH}, None, None)
    times = entry.frame_times
    begin, end = entry.wind_span
    yield from heapq.merge(
        _between(reader, topics - {TOPIC_TRUTH, TOPIC_IMAGE}, begin, end + 1),
        _between(reader, topics & {TOPIC_IMAGE}, int(times[0]), end + 1),
        key=lambda copied: copied[2].log_time,
    )


def _between(reader: McapReader, topics: set[str], begin: int | None, end: int | None) -> Iterator[_Copied]:
    return reader.iter_messages(topics=sorted(topics), starting_at=begin, ending_before=end) if topics else iter(())


def _copy_metadata(reader: McapReader, writer: Writer, entry: Entry) -> None:
    for metadata in reader.iter_metadata():
        writer.add_metadata(metadata.name, dict(metadata.metadata))
    left_out = sorted(entry.record.attachments)
    label = json.dumps(entry.label(), sort_keys=True, allow_nan=False, ensure_ascii=False)
    writer.add_metadata(
        SAMPLE,
        {
            "artifact": entry.key,
            "object": entry.row["object"],
            "parents": ",".join(entry.row["parents"]),
            "label": label,
            "attachments_left_out": json.dumps(left_out, ensure_ascii=False),
        },
    )


class _Copier:
    """Writes messages of one file into another, with their schemas and channels."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}

    def add(self, schema: Schema | None, channel: Channel, message: Message) -> None:
        if channel.id not in self._channels:
            if schema is not None and schema.id not in self._schemas:
                self._schemas[schema.id] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            self._channels[channel.id] = self._writer.register_channel(
                channel.topic, channel.message_encoding, self._schemas[channel.schema_id], dict(channel.metadata)
            )
        self._writer.add_message(
            self._channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
        )
