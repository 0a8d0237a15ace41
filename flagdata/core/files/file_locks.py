"""Locks of the kernel (flock): whether a disk keeps them, and folders that one process at a time
works in.

They belong to an open file, so two that one process opens compete as those of two processes do.
"""

from __future__ import annotations

import fcntl
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import IO, Any

from flagdata.core.files.durable import lacking, lacks

LOCK = "lock"
"""Name of the file in a folder that is locked while a process works there."""


def lock(file: IO[Any], mode: int, *, where: Path) -> bool:
    """Takes the lock of an open file, which lies `where`; false where another has it and `mode` (of
    `fcntl.flock`) does not wait.

    Raises:
        RefusedError: the disk has no locks.
        OSError: whatever else it refused.
    """
    try:
        fcntl.flock(file, mode)
    except BlockingIOError:
        return False
    except OSError as error:
        if not lacks(error, where):
            raise
        raise lacking("refuses locks", where, error=error) from error
    return True


@cache
def check_locks(folder: Path) -> None:
    """Takes one lock twice in a folder, as two processes would: once a process and folder.

    Raises:
        RefusedError: the disk refuses locks, or grants one to everybody.
        OSError: the folder cannot be written to.
    """
    path = folder / f".{uuid.uuid4().hex}"
    try:
        with path.open("wb") as first, path.open("wb") as second:
            taken = [
                lock(file, fcntl.LOCK_EX | fcntl.LOCK_NB, where=folder) for file in (first, second)
            ]
            if taken != [True, False]:
                message = (
                    "grants a lock to everybody, so that a process could delete what another one "
                    "has just written"
                )
                raise lacking(message, folder)
    finally:
        path.unlink(missing_ok=True)


@contextmanager
def alone_in(folder: Path, *, occupied: Callable[[], object]) -> Iterator[None]:
    """Allows work in a folder, made if it is missing, that no other process or thread works in by
    this function.

    Where one does, `occupied` is called, which raises, or says that its end is waited for. The lock
    (flock on the file `lock` in the folder) ends with the process, however that ends.

    Raises:
        RefusedError: the disk has no locks, or grants one to everybody.
        OSError: the folder cannot be written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    check_locks(folder)
    with (folder / LOCK).open("ab") as file:
        if not lock(file, fcntl.LOCK_EX | fcntl.LOCK_NB, where=folder):
            occupied()
            lock(file, fcntl.LOCK_EX, where=folder)
        yield
