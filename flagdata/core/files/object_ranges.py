"""Ranges of an object in a bucket, read in blocks that are kept on this machine: see
`flagdata.core.files.object_cache`.

What lies within 1 MiB of each other is fetched by one request, and what is read from one end to the
other in pieces of 8 MiB. Nothing here knows whether the bytes are right: who reads them compares
them with checksums of their own.
"""

from __future__ import annotations

import threading
import zlib
from collections.abc import Iterable, Sequence
from itertools import pairwise

from flagdata.core.files import object_cache
from flagdata.storage.path import RemotePath

BLOCK = 256 << 10
"""Bytes of a block; the last one of an object is shorter."""
_GAP = 4
"""As many blocks that nobody asked for are fetched where that saves a request."""
_AHEAD = 32
"""Blocks of one request where an object is read from one end to the other."""


class ObjectRanges:
    """The bytes of an object of a lake.

    Args:
        place: of the object, `…/mcap/<sha256>.mcap`.

    Attributes:
        size: of the object [B].

    Raises:
        FileNotFoundError: there is none.
        StoreError: the store did not answer.
    """

    def __init__(self, remote: RemotePath) -> None:
        self._place = remote
        status = remote.stat()
        self.size = status.st_size
        self._name = f"{remote.parent.name}/{remote.stem}"
        self._version = (
            f"{zlib.crc32((status.e_tag or '').encode()):08x}"  # a damaged object may be put anew
        )
        self._prepared: dict[int, bytes] = {}
        self._fetched = -1  # the last block of the last request
        self._guard = threading.Lock()

    def read(self, length: int, offset: int) -> bytes:
        """Reads at most `length` bytes at `offset`, fewer at the end of the object.

        Raises:
            StoreError: the store did not answer.
        """
        end = min(offset + length, self.size)
        if end <= offset:
            return b""
        first = offset // BLOCK
        wanted = range(first, -(-end // BLOCK))
        with self._guard:
            blocks = self._prepared
            if any(number not in blocks for number in wanted):
                blocks = self._blocks(wanted, ahead=0 <= first - self._fetched <= _GAP)
                self._prepared = blocks
        data = b"".join([blocks[number] for number in wanted])
        return data[offset - first * BLOCK : end - first * BLOCK]

    def prepare(self, spans: Sequence[tuple[int, int]]) -> None:
        """Fetches spans, first byte and end each, that will be read next; those before them are
        kept on disk only."""
        wanted = {
            number
            for start, end in spans
            for number in range(max(start, 0) // BLOCK, -(-min(end, self.size) // BLOCK))
        }
        with self._guard:
            self._prepared = self._blocks(sorted(wanted), ahead=False)

    def close(self) -> None:
        """Forgets what is in memory."""
        self._prepared = {}

    def _blocks(self, wanted: Iterable[int], *, ahead: bool) -> dict[int, bytes]:
        """Maps the number of each block to its content; those that are not on this machine are
        fetched together.

        Args:
            ahead: the object is read in its order, so that what follows is fetched, too.
        """
        blocks: dict[int, bytes] = {}
        missing: list[int] = []
        for number in wanted:
            stored = object_cache.block_of(self._name, f"{self._version}-{number}")
            if stored is None:
                missing.append(number)
            else:
                blocks[number] = stored
        if not missing:
            return blocks
        if ahead:
            missing += range(missing[-1] + 1, min(missing[-1] + _AHEAD, -(-self.size // BLOCK)))
        runs = [[missing[0], missing[0]]]
        for before, number in pairwise(missing):
            if number - before > _GAP:
                runs.append([number, number])
            runs[-1][1] = number
        offsets = [first * BLOCK for first, _ in runs]
        lengths = [min((last + 1) * BLOCK, self.size) - first * BLOCK for first, last in runs]
        new: dict[int, bytes] = {}
        for (first, _), data in zip(runs, self._place.read_ranges(offsets, lengths), strict=True):
            new |= {first + at // BLOCK: data[at : at + BLOCK] for at in range(0, len(data), BLOCK)}
        self._fetched = max(new)
        object_cache.keep_blocks(
            self._name, {f"{self._version}-{number}": data for number, data in new.items()}
        )
        return blocks | new
