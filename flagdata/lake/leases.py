"""What running transactions hold, so that garbage collection leaves it alone.

A transaction owns one folder in `staging/`. Its file `lease` is locked (flock) for as long as the process lives: the
kernel drops the lock when the process ends, however it ends, so a lock that can be taken proves that the owner is dead.
An object's name is written to the lease before the object is looked for or moved to its place. That step, a commit and
the making of a ref take the lock `staging/.collect` shared; a collection takes it exclusively while it reads leases,
then the catalog, and deletes. A collector therefore either sees the lease, or finds the row committed, or comes before
the transaction looked for the object.

Locks work between processes of one machine, and over file systems that carry flock between machines (NFS 4, Lustre).
For a lake in a bucket, `flagdata.lake.remote_leases` has locks and leases of the same meaning.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import socket
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from flagdata.caches import user_cache
from flagdata.documents import from_json
from flagdata.files import is_beside
from flagdata.lake import remote_leases
from flagdata.lake.durable import disk_errors
from flagdata.lake.layout import LinkError
from flagdata.storage import Place, RemotePath

_LEASE = "lease"
COLLECT = ".collect"
TURN = ".turn"


@dataclass(frozen=True, kw_only=True)
class LeaseState:
    """A staging folder as another process sees it: its owner, whether it lives, and the objects it holds.

    Attributes:
        leased: whether there is a lease at all; without, nothing proves that the process that made the folder is dead.
    """

    folder: Place
    leased: bool
    alive: bool
    owner: str
    objects: frozenset[str]


Check = Callable[[], None]
"""Raises ConflictError where a lock may have been lost meanwhile, which that of a disk never is."""


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
        """Note that the transaction relies on the object; no collection that has not seen it runs afterwards."""
        with self.keeping_collectors_out():
            self._line(object_name)

    @contextmanager
    def keeping_collectors_out(self) -> Iterator[Check]:
        """No collection runs during the block."""
        with keeping_collectors_out(self.folder.parent) as check:
            yield check

    def close(self) -> None:
        """Give everything up and remove the folder; what cannot be removed is left to a collection."""
        with keeping_collectors_out(self.folder.parent):  # none sees the folder half removed
            self._remove()

    def _remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self._file.close()

    def _line(self, text: str) -> None:
        self._file.write(f"{text}\n".encode())


class RemoteLease:
    """The lease of one running transaction of a lake in a bucket; its folder is on this machine."""

    def __init__(self, staging: RemotePath) -> None:
        self._staging = staging
        self._local = Lease(_scratch())
        self.folder = self._local.folder
        try:
            self._held = remote_leases.new_lease(staging)
        except BaseException:
            self._local.close()
            raise

    def hold(self, object_name: str) -> None:
        """Note that the transaction relies on the object; no collection that has not seen it runs afterwards."""
        self._held.append(object_name)
        remote_leases.await_collectors(self._staging)

    @contextmanager
    def keeping_collectors_out(self) -> Iterator[Check]:
        """As `Lease.keeping_collectors_out`; the check is of the lease, too."""
        with keeping_collectors_out(self._staging) as check:

            def check_both() -> None:
                check()
                self._held.check()

            yield check_both

    def close(self) -> None:
        """As `Lease.close`."""
        self._held.close()
        self._local.close()


def open_lease(staging: Place) -> Lease | RemoteLease:
    """The lease of a transaction that begins."""
    return RemoteLease(staging) if isinstance(staging, RemotePath) else Lease(staging)


def _scratch() -> Path:
    """Where this machine's transactions write what goes into buckets; what those left that died is deleted."""
    folder = user_cache() / "staging"
    folder.mkdir(parents=True, exist_ok=True)
    with collecting(folder):
        for state in leases(folder):
            if state.leased and not state.alive:
                shutil.rmtree(state.folder, ignore_errors=True)  # type: ignore[arg-type]
    return folder


@contextmanager
def keeping_collectors_out(staging: Place) -> Iterator[Check]:
    """No collection runs during the block; any number of writers may."""
    if isinstance(staging, RemotePath):
        with remote_leases.sharing(staging) as held:
            yield held.check
    else:
        with _locked(staging, fcntl.LOCK_SH):
            yield _sure


@contextmanager
def collecting(staging: Place) -> Iterator[Check]:
    """No transaction starts, puts an object, commits or ends, and no ref is made, during the block."""
    if isinstance(staging, RemotePath):
        with remote_leases.alone(staging) as held:
            yield held.check
    else:
        with _locked(staging, fcntl.LOCK_EX):
            yield _sure


@contextmanager
def looking(staging: Place) -> Iterator[None]:
    """Staging is looked at: on a disk, where folders appear before their leases do, none is being made meanwhile; in a
    bucket each entry shows whole, so that no lock is put for which the keys would have to permit writing."""
    if isinstance(staging, RemotePath):
        yield
    else:
        with collecting(staging):
            yield


def _sure() -> None:
    """The kernel keeps a lock until it is given up."""


def leases(staging: Place) -> list[LeaseState]:
    """All staging folders, by name."""
    states = []
    for folder in sorted(path for path in _entries(staging) if _is_folder(path)):  # type: ignore[type-var]
        if folder.name == remote_leases.SHARED or is_beside(folder.name):
            continue
        leased = True
        try:
            lines, alive = _lines_of(folder)
        except (FileNotFoundError, IsADirectoryError, LinkError):
            leased, alive, lines = False, False, []
            if not _is_folder(folder):
                continue
        owner = _owner(lines[0]) if lines else "owner unknown"
        states.append(LeaseState(folder=folder, leased=leased, alive=alive, owner=owner, objects=frozenset(lines[1:])))
    return states


def _lines_of(folder: Place) -> tuple[list[str], bool]:
    """The lines of a lease, and whether its owner lives."""
    if isinstance(folder, RemotePath):
        return remote_leases.lease_lines(folder)
    with _plain(folder / _LEASE) as file:
        alive = not _try_lock(file.fileno())
        return file.read().splitlines(), alive


def unleased(staging: Place) -> list[Place]:
    """Entries of staging without a lease: folders without one, and files, by name."""
    # The shared locks' folder in a bucket is gone with the last of them, which may be between two requests.
    own = (remote_leases.COLLECT, remote_leases.MADE, remote_leases.SHARED)
    folders = [state.folder for state in leases(staging) if not state.leased]
    entries = [path for path in _entries(staging) if path.name not in own and not is_beside(path.name)]
    files = [path for path in entries if not _is_folder(path)]
    return sorted([*folders, *files])  # type: ignore[type-var]


def _entries(staging: Place) -> list[Place]:
    """What lies in staging; nothing in a copy of a lake that came without its empty folders."""
    try:
        return list(staging.iterdir())
    except FileNotFoundError:
        return []


def last_written(path: Place) -> float:
    """When a file, or anything in a folder, was written last [s since 1970]."""
    inside = path.rglob("*") if _is_folder(path) else ()
    own = () if isinstance(path, RemotePath) and inside else (path,)
    return max((entry.lstat().st_mtime for entry in (*own, *inside)), default=0.0)  # its owner has just removed it


def _is_folder(path: Place) -> bool:
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
        with _opened(staging / TURN) as turn:
            fcntl.flock(turn, fcntl.LOCK_EX)
            lock = held.enter_context(_opened(staging / COLLECT))
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
