"""What running transactions hold, so that garbage collection leaves it alone.

A transaction owns one folder in `staging/`. Its file `lease` is locked (flock) for as long as the process lives: the
kernel drops the lock when the process ends, however it ends, so a lock that can be taken proves that the owner is dead.
An object's name is written to the lease before the object is looked for or moved to its place. That step, a commit and
the making of a ref take the lock `staging/.collect` shared; a collection takes it exclusively while it reads leases,
then the catalog, and deletes. A collector therefore either sees the lease, or finds the row committed, or comes before
the transaction looked for the object.

Locks work between processes of one machine, and over file systems that carry flock between machines (NFS 4, Lustre).
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import socket
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from flagdata.documents import from_json
from flagdata.lake.durable import disk_errors
from flagdata.lake.layout import LinkError

_LEASE = "lease"
_COLLECT = ".collect"
_TURN = ".turn"


@dataclass(frozen=True, kw_only=True)
class LeaseState:
    """A staging folder as another process sees it: its owner, whether it lives, and the objects it holds.

    Attributes:
        leased: whether there is a lease at all; without, nothing proves that the process that made the folder is dead.
    """

    folder: Path
    leased: bool
    alive: bool
    owner: str
    objects: frozenset[str]


class Lease:
    """The staging folder of one running transaction."""

    def __init__(self, staging: Path) -> None:
        owner = {"pid": os.getpid(), "host": socket.gethostname(), "since": datetime.now(UTC).isoformat()}
        with keeping_collectors_out(staging):
            self.folder = staging / uuid.uuid4().hex
            self.folder.mkdir()
            self._file = (self.folder / _LEASE).open("wb", buffering=0)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX)
                self._line(json.dumps(owner))
            except OSError:
                self._remove()
                raise

    def hold(self, object_name: str) -> None:
        """Note that the transaction relies on the object; called while collectors are kept out."""
        self._line(object_name)

    @contextmanager
    def keeping_collectors_out(self) -> Iterator[None]:
        """No collection runs during the block."""
        with keeping_collectors_out(self.folder.parent):
            yield

    def close(self) -> None:
        """Give everything up and remove the folder; what cannot be removed is left to a collection."""
        with keeping_collectors_out(self.folder.parent):  # none sees the folder half removed
            self._remove()

    def _remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self._file.close()

    def _line(self, text: str) -> None:
        self._file.write(f"{text}\n".encode())


@contextmanager
def keeping_collectors_out(staging: Path) -> Iterator[None]:
    """No collection runs during the block; any number of writers may."""
    with _locked(staging, fcntl.LOCK_SH):
        yield


@contextmanager
def collecting(staging: Path) -> Iterator[None]:
    """No transaction starts, puts an object, commits or ends, and no ref is made, during the block."""
    with _locked(staging, fcntl.LOCK_EX):
        yield


def leases(staging: Path) -> list[LeaseState]:
    """All staging folders, by name."""
    states = []
    for folder in sorted(p for p in staging.iterdir() if _is_folder(p)):
        leased = True
        try:
            with _plain(folder / _LEASE) as file:
                alive = not _try_lock(file.fileno())
                lines = file.read().splitlines()
        except (FileNotFoundError, IsADirectoryError, LinkError):
            leased, alive, lines = False, False, []
            if not folder.exists():
                continue
        owner = _owner(lines[0]) if lines else "owner unknown"
        states.append(LeaseState(folder=folder, leased=leased, alive=alive, owner=owner, objects=frozenset(lines[1:])))
    return states


def unleased(staging: Path) -> list[Path]:
    """Entries of staging without a lease: folders without one, and files, by name."""
    folders = [state.folder for state in leases(staging) if not state.leased]
    files = [path for path in staging.iterdir() if not _is_folder(path) and path.name not in (_COLLECT, _TURN)]
    return sorted([*folders, *files])


def last_written(path: Path) -> float:
    """When a file, or anything in a folder, was written last [s since 1970]."""
    inside = path.rglob("*") if _is_folder(path) else ()
    return max(entry.lstat().st_mtime for entry in (path, *inside))


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _owner(line: str) -> str:
    try:
        owner = from_json(line)
        return f"process {owner['pid']} on {owner['host']} since {owner['since']}"
    except (ValueError, KeyError, TypeError):  # it died, or the disk was full, before the line was whole
        return "owner unknown"


def _try_lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def _locked(staging: Path, mode: int) -> Iterator[None]:
    """Take the lock behind a turnstile: a process that waits for it holds the turnstile, so that a stream of shared
    holders cannot keep an exclusive one out for ever. Not to be nested."""
    with ExitStack() as held:
        with _opened(staging / _TURN) as turn:
            fcntl.flock(turn, fcntl.LOCK_EX)
            lock = held.enter_context(_opened(staging / _COLLECT))
            fcntl.flock(lock, mode)
        yield


def _opened(path: Path) -> IO[str]:
    with disk_errors("locking the lake", path):
        if not os.path.lexists(path):
            path.parent.mkdir(exist_ok=True)  # copies of a lake may come without empty folders
            path.touch()
        return _plain(path)


def _plain(path: Path) -> IO[str]:
    """A file of staging, opened to read; a link is not followed, and a pipe not waited for.

    Raises:
        LinkError: a link.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError as error:
        if error.errno != errno.ELOOP:
            raise
        raise LinkError("a link where a lock of the lake belongs", where=str(path), fix="delete the link") from None
    return os.fdopen(descriptor, encoding="utf-8")
