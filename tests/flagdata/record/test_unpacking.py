"""What a compressed chunk unpacks to is bounded by what it states, and that by a limit; memory
follows."""

from __future__ import annotations

import struct
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.records import Chunk
from mcap.writer import CompressionType, Writer

from flagdata.errors import CorruptError, LimitError
from flagdata.ingest import messages, topics
from flagdata.record import salvage, unpack_chunk, unpacking
from flagdata.record.mcap_container import MESSAGE_HEAD

BOMB = 96 << 20
"""Bytes that a lying chunk unpacks to."""
BOUND = 12 << 20
"""Memory that is enough to find it out: of pieces of 1 MiB, and of the sound chunk before it."""
PACKERS = {"lz4": lz4.frame.compress, "zstd": zstandard.compress}
PACKINGS = {"lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}


def _peak(act: Callable[[], object]) -> int:
    tracemalloc.start()
    try:
        act()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _chunk(compression: str, data: bytes, stated: int, crc: int = 0) -> Chunk:
    return Chunk(
        compression=compression,
        data=data,
        message_start_time=0,
        message_end_time=0,
        uncompressed_crc=crc,
        uncompressed_size=stated,
    )


def _lying(path: Path, packing: str, *, stated: int) -> Path:
    """A file with one small message, and one of `BOMB` zeros in a last chunk, which states another
    size."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=PACKINGS[packing], chunk_size=1 << 20)
        writer.start()
        channel = writer.register_channel(topic="/a", message_encoding="json", schema_id=0)
        writer.add_message(
            channel, log_time=1, publish_time=1, data=b'{"x": "' + b"0" * (1 << 20) + b'"}'
        )
        writer.add_message(channel, log_time=2, publish_time=2, data=bytes(BOMB))
        writer.finish()
    true = struct.pack("<Q", BOMB + MESSAGE_HEAD)
    data = bytearray(path.read_bytes())
    for at in (data.index(true), data.rindex(true)):  # in the chunk and in its index
        struct.pack_into("<Q", data, at, stated)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("packing", PACKERS)
@pytest.mark.parametrize("stated", [0, 1000, BOMB - 1])
def test_a_chunk_unpacks_to_no_more_than_it_states(packing: str, stated: int) -> None:
    lie = _chunk(packing, PACKERS[packing](bytes(BOMB)), stated)

    def refused() -> None:
        with pytest.raises(CorruptError, match=f"more than the {stated} bytes"):
            unpack_chunk(lie)

    assert _peak(refused) < stated * 1.2 + BOUND  # a growing buffer may be an eighth too large


@pytest.mark.parametrize("packing", PACKERS)
def test_a_chunk_that_is_cut_off_or_damaged_is_corrupt(packing: str) -> None:
    data = PACKERS[packing](bytes(range(256)) * 100)
    assert bytes(unpack_chunk(_chunk(packing, data, 25_600))) == bytes(range(256)) * 100
    for wrong in (data[:-20], data[:3], b"", b"\xff" * 40, data[:10] + b"\xff" * 20 + data[30:]):
        with pytest.raises(CorruptError):
            unpack_chunk(_chunk(packing, wrong, 25_600))
    with pytest.raises(CorruptError, match="checksum"):
        unpack_chunk(_chunk(packing, data, 25_600, crc=1))
    with pytest.raises(CorruptError, match="compression is 'bz2'"):
        unpack_chunk(_chunk("bz2", data, 25_600))


def test_a_chunk_that_states_more_than_the_limit_is_not_unpacked() -> None:
    with pytest.raises(LimitError, match="claims to unpack"):
        unpack_chunk(_chunk("lz4", b"", unpacking.UNPACKED_LIMIT + 1))


@pytest.mark.parametrize("packing", PACKERS)
def test_reading_a_topic_of_a_chunk_that_lies_takes_no_memory_for_it(
    tmp_path: Path, packing: str
) -> None:
    path = _lying(tmp_path / "bomb.mcap", packing, stated=1000)

    def read() -> None:
        assert [topic.name for topic in topics(path)] == ["/a"]
        with pytest.raises(CorruptError, match="more than the 1000 bytes"):
            list(messages(path, "/a"))

    assert _peak(read) < BOUND


@pytest.mark.parametrize("packing", PACKERS)
def test_recovery_leaves_a_chunk_out_that_lies_and_takes_no_memory_for_it(
    tmp_path: Path, packing: str
) -> None:
    path = _lying(tmp_path / "bomb.mcap", packing, stated=1000)
    found: list[str] = []
    assert _peak(lambda: found.extend(f.what for f in salvage(path, tmp_path / "out.mcap"))) < BOUND
    assert any("the chunk unpacks to more than the 1000 bytes" in what for what in found)
    assert any(what.startswith("1 messages") for what in found)


def test_a_file_of_nothing_but_heads_of_chunks_is_looked_through_in_bounded_time(
    tmp_path: Path,
) -> None:
    """Each head states a chunk to the end of the file, whose checksum is wrong: a comparison of all
    takes a day."""
    head, count = 49, 100_000
    total = 17 + head * count
    heads = (
        struct.pack(
            "<BQQQQIIQ", 6, total - at - 9, 1, 1, total - at - head, 7, 0, total - at - head
        )
        for at in range(17, total, head)
    )
    path = tmp_path / "heads.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + bytes(9) + b"".join(heads))
    begun = time.process_time()
    with pytest.raises(CorruptError, match="no whole message"):
        salvage(path, tmp_path / "out.mcap")
    assert time.process_time() - begun < 30  # s; it takes one
