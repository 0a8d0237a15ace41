"""MCAP subsets: each artifact as a record of its own, message by message as it was recorded.

A clip keeps its frames and the ten minutes of wind up to its end that its ground truth and its σ
were worked out from, so that both can be worked out again from the subset alone. Messages, schemas
and metadata are copied byte for byte; whole records as files. H.264 can be decoded from a key frame
only: a clip of it begins with the frames since that one, and says how many they are.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self

import numpy as np
import pyarrow.parquet as pq

from flagdata.core.schema import TOPIC_IMAGE, TOPIC_TRUTH, Kind
from flagdata.dataset.truth import HISTORY
from flagdata.errors import CorruptError
from flagdata.export.export_source import FILMED, Entry, ExportRows, label_units
from flagdata.record import Coding, messages
from flagdata.record.key_frames import is_key
from flagdata.record.mcap_container import (
    Messages,
    check_parts,
    read_exact,
    read_messages,
    read_summary,
)
from flagdata.record.metadata import ROWS, SAMPLE
from flagdata.record.record_bytes import open_bytes
from flagdata.record.record_checksums import ChecksummedFile
from flagdata.record.writer import PROFILE
from flagdata.timebase import NANOSECONDS

CHUNK_BYTES = 1 << 20  # uncompressed, as in committed records: readers reach a frame directly


@dataclass(frozen=True, kw_only=True)
class Mcap:
    """Files <artifact>.mcap, and their rows in `ROWS`."""

    kinds: ClassVar[frozenset[Kind]] = FILMED | {Kind.WIND}

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        frames = 0
        pq.write_table(source.rows, folder / ROWS, compression="zstd")
        with ExitStack() as stack:
            original: _Original | None = None
            for entry in source.entries():
                target = folder / f"{entry.key}.mcap"
                path = source.lake.object_path(entry.row["object"])
                if not entry.is_slice:
                    shutil.copyfile(path, target)
                else:
                    if original is None or original.path != path:
                        stack.close()
                        original = stack.enter_context(_Original(path))
                    _cut(entry, original, target)
                frames += entry.count
                advance(1)
        return {"records": len(source), "frames": frames, "units": label_units()}


class _Original:
    """A record that clips are cut from: its file and where each message lies. A context manager."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._where = str(path)
        self._file = open_bytes(path)
        self.summary = read_summary(self._file, where=self._where)
        self.messages: dict[str, Messages] = {
            topic: read_messages(self._file, self.summary, topic, where=self._where)
            for topic in sorted(self.summary.channels)
        }
        for topic, table in self.messages.items():
            if table.checksum is not None:
                parts = [self._read(topic, index) for index in range(len(table))]
                check_parts(parts, table, topic, first=0, where=self._where)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

    def decodable_from(self, frame: int) -> int:
        """Finds the last key frame up to `frame`, of a record in H.264.

        Raises:
            CorruptError: there is none.
        """
        field = messages.data_field(messages.CompressedVideo)
        for index in range(frame, -1, -1):
            if is_key(messages.payload(memoryview(self.data(TOPIC_IMAGE, index)), field=field)):
                return index
        raise CorruptError(
            f"there is no key frame up to frame {frame}",
            where=self._where,
            fix="run flagdata verify",
        )

    def data(self, topic: str, index: int) -> bytes:
        """Reads the payload of one message.

        Raises:
            CorruptError: it has changed since it was written.
        """
        part = self._read(topic, index)
        if self.messages[topic].checksums is not None:
            check_parts([part], self.messages[topic], topic, first=index, where=self._where)
        return part

    def _read(self, topic: str, index: int) -> bytes:
        table = self.messages[topic]
        return read_exact(
            self._file, int(table.length[index]), int(table.offset[index]), where=self._where
        )


def _cut(entry: Entry, original: _Original, target: Path) -> None:
    first = (
        original.decodable_from(entry.first) if entry.record.coding is Coding.H264 else entry.first
    )
    with target.open("xb") as sink:
        library = f"flagdata format {entry.row['format_version']}"
        writer = ChecksummedFile(sink, chunk_size=CHUNK_BYTES, profile=PROFILE, library=library)
        for name, values in entry.record.metadata.items():
            writer.add_metadata(name, values)
        writer.add_metadata(SAMPLE, _sample(entry, lead_in=entry.first - first))
        channels: dict[str, int] = {}
        for topic, index in _order(entry, original, first):
            if topic not in channels:
                channels[topic] = _register(writer, original, topic)
            table = original.messages[topic]
            writer.add_message(
                channel_id=channels[topic],
                log_time=int(table.log_time[index]),
                data=original.data(topic, index),
                publish_time=int(table.publish_time[index]),
                sequence=index,
            )
        writer.finish()


def _order(entry: Entry, original: _Original, first_frame: int) -> Iterator[tuple[str, int]]:
    """Yields topic and index of the messages of a clip: the parameters, then all others in order of
    log time."""
    begin, end = entry.wind_span
    begin = min(begin, end - round(HISTORY * NANOSECONDS))
    topics, indices, times = [], [], []
    for number, (topic, table) in enumerate(original.messages.items()):
        if topic == TOPIC_TRUTH:
            yield from ((topic, index) for index in range(len(table)))
            continue
        first, last = np.searchsorted(table.log_time, [begin, end + 1]).tolist()
        if topic == TOPIC_IMAGE:
            first, last = first_frame, entry.first + entry.count
        topics.append(np.full(last - first, number))
        indices.append(np.arange(first, last))
        times.append(table.log_time[first:last])
    names = list(original.messages)
    topic_of, index_of = np.concatenate(topics).tolist(), np.concatenate(indices).tolist()
    for k in np.argsort(np.concatenate(times), kind="stable").tolist():
        yield names[topic_of[k]], index_of[k]


def _register(writer: ChecksummedFile, original: _Original, topic: str) -> int:
    channel = original.summary.channels[topic]
    schema = original.summary.schemas.get(channel.schema_id)
    schema_id = (
        0
        if schema is None
        else writer.register_schema(name=schema.name, encoding=schema.encoding, data=schema.data)
    )
    return writer.register_channel(
        topic=topic,
        message_encoding=channel.message_encoding,
        schema_id=schema_id,
        metadata=channel.metadata,
    )


def _sample(entry: Entry, *, lead_in: int) -> dict[str, str]:
    return {
        "lead_in_frames": str(lead_in),
        "artifact": entry.key,
        "object": entry.row["object"],
        "parents": ",".join(entry.row["parents"]),
        "label": json.dumps(entry.label(), sort_keys=True, allow_nan=False, ensure_ascii=False),
        "attachments_left_out": json.dumps(sorted(entry.record.attachments), ensure_ascii=False),
    }
