"""Attachments of a record packed as they are read, piece by piece."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from flagdata.errors import ConflictError, InputError

PIECE = 1 << 20
"""Bytes read at a time."""
QUICK_ABOVE = 8 << 20
"""Bytes from which an attachment is packed for speed: zlib's level 1 takes a quarter of level 9's time on a log."""
_GZIP = 31  # wbits of zlib for a gzip stream, whose header then holds neither name nor time


def pieces_of(path: Path, size: int) -> Iterator[bytes]:
    """The content of a file of `size` bytes.

    Raises:
        InputError: it cannot be read.
        ConflictError: it has another size by now.
    """
    done = 0
    try:
        with path.open("rb") as stream:
            while piece := stream.read(PIECE):
                done += len(piece)
                yield piece
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", where=str(path), fix="check its permissions") from None
    if done != size:
        raise ConflictError(
            f"the file had {size} bytes and then {done}", where=str(path), fix="ingest it when it is complete"
        )


def packed(data: Iterable[bytes], size: int) -> list[bytes] | None:
    """`data` of `size` bytes gzipped, in pieces; `None` where that is not smaller."""
    level = 1 if size > QUICK_ABOVE else 9
    coder = zlib.compressobj(level, zlib.DEFLATED, _GZIP)
    out = [coder.compress(piece) for piece in data]
    out.append(coder.flush())
    kept = [piece for piece in out if piece]
    return kept if sum(map(len, kept)) < size else None
