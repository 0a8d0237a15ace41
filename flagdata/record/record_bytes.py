"""Where the bytes of a record come from: a file of this machine, or ranges of an object in a
bucket."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from flagdata.core.files.object_ranges import ObjectRanges
from flagdata.errors import NotFoundError
from flagdata.storage import Place


class Bytes(Protocol):
    """Bytes that are read by offset; threads may read at once.

    Attributes:
        size: how many there are.
    """

    size: int

    def read(self, length: int, offset: int) -> bytes:
        """Reads at most `length` bytes at `offset`; fewer where the end, or the system, says so."""
        ...

    def prepare(self, spans: Sequence[tuple[int, int]]) -> None:
        """Spans, first byte and end each, will be read next: what lies apart may be fetched
        together."""
        ...

    def close(self) -> None: ...


class _FileBytes:
    def __init__(self, file: int) -> None:
        self._file = file
        self.size = os.fstat(file).st_size

    def read(self, length: int, offset: int) -> bytes:
        return os.pread(self._file, length, offset)

    def prepare(self, spans: Sequence[tuple[int, int]]) -> None:
        """Prepares nothing: the system reads ahead."""

    def close(self) -> None:
        os.close(self._file)


def open_bytes(path: Place) -> Bytes:
    """Opens the bytes of a record for reading by offset.

    Raises:
        NotFoundError: no such file or object.
    """
    try:
        if isinstance(path, Path):
            return _FileBytes(os.open(path, os.O_RDONLY | os.O_CLOEXEC))
        return ObjectRanges(path)
    except (FileNotFoundError, NotADirectoryError):
        raise NotFoundError(
            "there is no such record", where=str(path), fix="check the path, or run flagdata doctor"
        ) from None
