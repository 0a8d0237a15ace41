"""The checksums of a record: one for each frame, for each channel and for each metadata record.

The object's hash says whether a whole file is as it was written; these say it of the part that is
read, so that every reader can check what it uses. They are CRC-32 (ISO 3309, as in MCAP itself),
kept in the metadata record "flagdata.checksums": `content` is a JSON document and `crc32` its own
checksum in hexadecimal. It maps each topic to

    count      how many messages the channel has
    heads      over channel id, sequence number, log time and publish time of all its messages, in
               file order
    data       over the payloads of all its messages, in file order; not of frames
    messages   over the payload of each message, eight hexadecimal digits each, in file order; of
               frames only

and each metadata record's name to the checksum of its content. Attachments and the summary have
those of MCAP. Records that were written before there were checksums have none.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import IO, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from flagdata.core.json_values import json_values
from flagdata.core.schema import TOPIC_IMAGE
from flagdata.errors import CorruptError
from flagdata.record.mcap_file import McapFile, MessageBlock

CHECKSUMS = "flagdata.checksums"
"""Name of the metadata record."""
SCHEMA = "flagdata.checksums/1"
FIX = (
    "run flagdata verify: it lists all of a lake that is damaged, and what replaces it; or restore "
    "the record from a "
    "copy, or save the rest of it: flagdata recover"
)
_HEAD = struct.Struct("<HIQQ")
HEAD_BYTES = _HEAD.size
"""Bytes of a message's head that `heads` covers: all but the record's opcode and length."""


@dataclass(frozen=True, kw_only=True)
class ChannelChecksums:
    """The checksums of one channel.

    Attributes:
        count: messages of the channel.
        heads: of their heads.
        data: of their payloads together; `None` where each has its own.
        messages: (count,) uint32, of each payload; `None` where they have one together.
    """

    count: int
    heads: int
    data: int | None
    messages: NDArray[np.uint32] | None
    JSON_NAMES: ClassVar = ("count", "heads", "data", "messages=messages_hex")
    JSON_OPTIONAL: ClassVar = frozenset({"data", "messages"})

    @property
    def messages_hex(self) -> str | None:
        """The checksums of the messages, in the order of the wire."""
        return None if self.messages is None else self.messages.astype(">u4").tobytes().hex()


@dataclass(frozen=True, kw_only=True)
class Checksums:
    """All checksums of a record: channels by topic, metadata records by name."""

    channels: Mapping[str, ChannelChecksums]
    metadata: Mapping[str, int]

    @classmethod
    def parse(cls, stored: Mapping[str, str], *, where: str) -> Checksums:
        """Reads the checksums that a metadata record holds.

        Raises:
            CorruptError: they are damaged themselves.
        """
        try:
            content = stored["content"].encode()
            if zlib.crc32(content) != int(stored["crc32"], 16):
                raise ValueError("their own checksum is wrong")
            document = json.loads(content)
            if document["schema"] != SCHEMA:
                raise ValueError(
                    f"they are of {document['schema']!r}, which this version does not know"
                )
            channels = {topic: _channel(entry) for topic, entry in document["channels"].items()}
            metadata = {name: int(value) for name, value in document["metadata"].items()}
        except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
            raise CorruptError(
                f"the record's checksums cannot be read: {error}", where=where, fix=FIX
            ) from None
        return cls(channels=channels, metadata=metadata)


def _channel(entry: Mapping[str, Any]) -> ChannelChecksums:
    messages = None
    if "messages" in entry:
        messages = np.frombuffer(bytes.fromhex(entry["messages"]), dtype=">u4").astype(np.uint32)
        if len(messages) != entry["count"]:
            raise ValueError(f"{len(messages)} checksums of {entry['count']} messages")
    return ChannelChecksums(
        count=int(entry["count"]),
        heads=int(entry["heads"]),
        data=entry.get("data"),
        messages=messages,
    )


def metadata_checksum(values: Mapping[str, str]) -> int:
    """Computes the checksum of the content of a metadata record."""
    return zlib.crc32(json.dumps(values, sort_keys=True, ensure_ascii=True).encode())


class _Tally:
    """The checksums of a channel that is being written."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self._count = self._heads = self._data = 0
        self._messages: list[int] | None = [] if topic == TOPIC_IMAGE else None

    def add(self, head: bytes, data: bytes, count: int = 1) -> None:
        self._count += count
        self._heads = zlib.crc32(head, self._heads)
        if self._messages is None:
            self._data = zlib.crc32(data, self._data)
        else:
            self._messages.append(zlib.crc32(data))

    @property
    def checksums(self) -> ChannelChecksums:
        """Those of what was added so far."""
        listed = self._messages is not None
        return ChannelChecksums(
            count=self._count,
            heads=self._heads,
            data=None if listed else self._data,
            messages=np.array(self._messages, dtype=np.uint32) if listed else None,
        )


class ChecksummedFile(McapFile):
    """An MCAP file with the checksums of all that was written as its last metadata record."""

    def __init__(self, stream: IO[bytes], *, chunk_size: int, profile: str, library: str) -> None:
        self._tallies: dict[int, _Tally] = {}
        self._checksums: dict[str, int] = {}
        super().__init__(stream, chunk_size=chunk_size, profile=profile, library=library)

    def register_channel(
        self,
        *,
        topic: str,
        message_encoding: str,
        schema_id: int,
        metadata: Mapping[str, str] | None = None,
    ) -> int:
        """Registers a channel, see `McapFile`."""
        channel = super().register_channel(
            topic=topic, message_encoding=message_encoding, schema_id=schema_id, metadata=metadata
        )
        self._tallies[channel] = _Tally(topic)
        return channel

    def add_message(
        self, *, channel_id: int, log_time: int, publish_time: int, sequence: int, data: bytes
    ) -> None:
        """Adds a message, see `McapFile`."""
        super().add_message(
            channel_id=channel_id,
            log_time=log_time,
            publish_time=publish_time,
            sequence=sequence,
            data=data,
        )
        self._tallies[channel_id].add(
            _HEAD.pack(channel_id, sequence, log_time, publish_time), data
        )

    def add_messages(self, block: MessageBlock, *, channel_id: int, sequence: int) -> None:
        """Adds messages, see `McapFile`."""
        super().add_messages(block, channel_id=channel_id, sequence=sequence)
        count = len(block.log_time)
        heads = np.empty(
            count, dtype=[("ch", "<u2"), ("seq", "<u4"), ("log", "<u8"), ("pub", "<u8")]
        )
        heads["ch"], heads["seq"] = channel_id, np.arange(sequence, sequence + count)
        heads["log"], heads["pub"] = block.log_time, block.publish_time
        self._tallies[channel_id].add(heads.tobytes(), block.payload[block.used].tobytes(), count)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Adds metadata, see `McapFile`."""
        super().add_metadata(name, values)
        self._checksums[name] = metadata_checksum(values)

    def finish(self) -> None:
        """Finishes the file, see `McapFile`."""
        document = {
            "schema": SCHEMA,
            "channels": {
                tally.topic: json_values(tally.checksums) for tally in self._tallies.values()
            },
            "metadata": self._checksums,
        }
        content = json.dumps(document, sort_keys=True)
        super().add_metadata(
            CHECKSUMS, {"content": content, "crc32": f"{zlib.crc32(content.encode()):08x}"}
        )
        super().finish()
