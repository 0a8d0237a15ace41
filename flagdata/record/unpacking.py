"""Chunks of MCAP files unpacked piece by piece, never to more than they state or than
`UNPACKED_LIMIT` allows.

A few bytes of LZ4 or Zstandard may unpack to gigabytes, whatever a chunk states beside them.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator

import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.records import Chunk

from flagdata.errors import CorruptError, LimitError

UNPACKED_LIMIT = 128 << 20
"""No compressed chunk is unpacked to more than this [B]: it is held in memory whole."""
_FED = 64 << 10
"""Bytes given to LZ4 at a time: it keeps a copy of those that it has not used."""
_PIECE = 1 << 20
_FIX = "run `flagdata recover` on the file"


def unpack_chunk(chunk: Chunk, *, where: str | None = None) -> memoryview:
    """Unpacks the records of a chunk.

    Raises:
        LimitError: a compressed chunk that states more than `UNPACKED_LIMIT`.
        CorruptError: it does not unpack, unpacks to more than it states, or its checksum is wrong;
            or its compression is not of the MCAP specification.
    """
    if chunk.compression:
        check_stated(chunk.uncompressed_size, where=where)
        data: bytes | bytearray = _join_pieces(
            _pieces(chunk.compression, chunk.data, where=where),
            chunk.uncompressed_size,
            where=where,
        )
    else:
        data = chunk.data
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise CorruptError("the chunk's checksum is wrong", where=where, fix=_FIX)
    return memoryview(data)


def check_stated(size: int, *, where: str | None = None) -> None:
    """Refuse the size that a compressed chunk states, where it is beyond the limit.

    Raises:
        LimitError: it is.
    """
    if size > UNPACKED_LIMIT:
        raise LimitError(
            f"the chunk claims to unpack to {size} bytes",
            where=where,
            fix=f"at most {UNPACKED_LIMIT} are unpacked at once: write smaller chunks",
        )


def _join_pieces(pieces: Iterator[bytes], stated_size: int, *, where: str | None) -> bytearray:
    unpacked_bytes = bytearray()
    try:
        for piece in pieces:
            unpacked_bytes += piece
            if len(unpacked_bytes) > stated_size:
                message = f"the chunk unpacks to more than the {stated_size} bytes that it states"
                raise CorruptError(message, where=where, fix=_FIX)
    except (zstandard.ZstdError, RuntimeError) as error:  # the second is LZ4's
        raise CorruptError(f"the chunk does not unpack: {error}", where=where, fix=_FIX) from None
    if len(unpacked_bytes) < stated_size:
        message = (
            f"the chunk unpacks to {len(unpacked_bytes)} of the {stated_size} bytes that it states"
        )
        raise CorruptError(message, where=where, fix=_FIX)
    return unpacked_bytes


def _pieces(compression: str, data: bytes, *, where: str | None) -> Iterator[bytes]:
    if compression == "lz4":
        return _of_lz4(data)
    if compression == "zstd":
        return _of_zstd(data)
    raise CorruptError(
        f"the chunk's compression is {compression[:40]!r}",
        where=where,
        fix="MCAP has lz4, zstd and none: convert it with the program that wrote it",
    )


def _of_lz4(data: bytes) -> Iterator[bytes]:
    decoder = LZ4FrameDecompressor()
    view = memoryview(data)
    for at in range(0, len(view), _FED):
        yield decoder.decompress(view[at : at + _FED], max_length=_PIECE)
        while not (decoder.needs_input or decoder.eof):
            yield decoder.decompress(b"", max_length=_PIECE)
        if decoder.eof:
            return


def _of_zstd(data: bytes) -> Iterator[bytes]:
    with zstandard.ZstdDecompressor().stream_reader(data) as reader:
        while piece := reader.read(_PIECE):
            yield piece
