"""Folders that one process at a time works in."""

from __future__ import annotations

import fcntl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

LOCK = "lock"
"""Name of the file in a folder that is locked while a process works there."""


@contextmanager
def alone_in(folder: Path, *, occupied: Callable[[], object]) -> Iterator[None]:
    """Allows work in a folder, made if it is missing, that no other process or thread works in by this function.

    Where one does, `occupied` is called, which raises, or says that its end is waited for. The lock (flock on the file
    `lock` in the folder) ends with the process, however that ends.

    Raises:
        OSError: the folder cannot be written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("ab") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            occupied()
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
