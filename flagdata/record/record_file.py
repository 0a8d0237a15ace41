"""The file a record is written to: what the disk refuses is a clear error, whichever write meets
it."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from flagdata.core.files.durable import disk_errors
from flagdata.errors import ConflictError


class Output(io.BufferedWriter):
    """A new file, buffered.

    Args:
        path: it must not exist.

    Raises:
        ConflictError: `path` exists.
        FlagdataError: no space, no permission, a file too large; of every method, `close` too.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with _clear_errors(path):
            try:
                raw = io.FileIO(path, "xb")
            except FileExistsError:
                raise ConflictError(
                    "the record exists already", where=str(path), fix="choose another path"
                ) from None
        super().__init__(raw)

    def write(self, buffer: Any, /) -> int:
        with _clear_errors(self._path):
            return super().write(buffer)

    def flush(self) -> None:
        with _clear_errors(self._path):
            super().flush()

    def sync(self) -> None:
        """Forces all that was written to the disk."""
        self.flush()
        with _clear_errors(self._path):
            os.fsync(self.fileno())

    def close(self) -> None:
        with _clear_errors(self._path):
            super().close()


@contextmanager
def _clear_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError:
        with disk_errors("writing a record", path):
            raise
