"""Messages of a damaged record that have a right checksum of their own, whatever lies around them.

A record states a checksum of each frame, one of all payloads of any other channel, and one of all
heads of a channel, see `flagdata.record.record_checksums`. So where a chunk's own checksum is
wrong, it is known which of its messages are as they were written.
"""

from __future__ import annotations

import zlib
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np
from mcap.records import Message

from flagdata.errors import FlagdataError
from flagdata.record.mcap_container import (
    MESSAGE_HEAD,
    Messages,
    Summary,
    message_count,
    read_messages,
)
from flagdata.record.record_bytes import open_bytes


class SoundMessages:
    """The messages of the record at `path`, found by its summary; of a record without a sound
    summary, none."""

    def __init__(self, path: Path, summary: Summary | None) -> None:
        self._path = path
        self._summary = summary

    def between(self, start: int, end: int) -> list[Message | None] | None:
        """Finds messages that begin between two bytes of the file, in file order, and a `None` for
        each that is lost: damaged itself, or of a channel without checksums or with changed heads,
        so that no instant of it is certain.

        `None` instead of all where no summary states what was there.
        """
        if self._summary is None:
            return None
        messages: dict[int, Message | None] = {}
        for channel, table in self._tables.items():
            for row in np.flatnonzero((table.offset >= start) & (table.offset < end)).tolist():
                messages[int(table.offset[row])] = self._message(channel, table, row)
        unknown = sum(
            message_count(chunk, channel)
            for chunk in self._summary.chunks
            if start <= chunk.chunk_start_offset < end
            for channel in chunk.message_index_offsets.keys() - self._tables.keys()
        )
        return [messages[offset] for offset in sorted(messages)] + [None] * unknown

    def _message(self, channel: int, table: Messages, row: int) -> Message | None:
        offset, length = int(table.offset[row]), int(table.length[row])
        head = self._read(offset - MESSAGE_HEAD, MESSAGE_HEAD)
        data = self._read(offset, length)
        right = (
            self._are_right[channel]
            if table.checksums is None
            else zlib.crc32(data) == table.checksums[row]
        )
        if not right:
            return None
        return Message(
            channel_id=channel,
            log_time=int(table.log_time[row]),
            publish_time=int(table.publish_time[row]),
            sequence=int.from_bytes(head[11:15], "little"),
            data=data,
        )

    def _read(self, offset: int, length: int) -> bytes:
        with self._path.open("rb") as stream:
            stream.seek(offset)
            return stream.read(length)

    @cached_property
    def _tables(self) -> dict[int, Messages]:
        """Channel → where its messages are, of channels whose heads have a right checksum."""
        tables: dict[int, Messages] = {}
        if self._summary is None or self._summary.checksums is None:
            return tables
        file = open_bytes(self._path)
        try:
            for topic, channel in self._summary.channels.items():
                with suppress(FlagdataError):
                    tables[channel.id] = read_messages(
                        file, self._summary, topic, where=str(self._path)
                    )
        finally:
            file.close()
        return tables

    @cached_property
    def _are_right(self) -> dict[int, bool]:
        """Channel with one checksum of all its payloads → whether it is right."""
        are_right: dict[int, bool] = {}
        for channel, table in self._tables.items():
            if table.checksums is None:
                total = 0
                for row in np.argsort(table.offset, kind="stable").tolist():
                    total = zlib.crc32(
                        self._read(int(table.offset[row]), int(table.length[row])), total
                    )
                are_right[channel] = total == table.checksum
        return are_right
