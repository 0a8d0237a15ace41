"""Locks and notes of the processes that use a lake, by the place of its `staging/`: `KernelLocks`
on a disk, `TimedLocks` in a bucket. `flagdata.lake.leases` says what they are for.

On a disk the kernel drops a lock when the process that has it ends, however it ends. Locks work
between processes of one machine, and over file systems that carry flock between machines (NFS 4,
Lustre).

    staging/.collect      the lock, taken shared or exclusively behind the turnstile staging/.turn
    staging/ID/lease      a running transaction, locked by it: its owner, and the objects it holds,
                          a line each

In a bucket no kernel does that. Each lock and note is an object that its holder writes anew every
few seconds; the store's own clock says when it was written last. One that was not for `LIFE`
seconds is void. A process that finds one made on its own machine by a process that has ended need
not wait for that.

    staging/collect       the exclusive lock: taken by `create`, or from a dead holder by a
                          conditional put
    staging/shared/ID     a holder of the shared lock
    staging/ID/lease      as on a disk

Who wants the shared lock puts an object and then looks for the exclusive one; who wants that puts
it and then looks for shared ones. A store answers each read with what was put before, so of two
that come at once at least one sees the other, and the one who shares withdraws. A transaction that
relies on an object puts its lease so, and then waits until
nobody has the exclusive lock: a collection that begins later sees the lease. A holder that could
not write for half of `LIFE` does not publish and deletes nothing more: see `Held.check`.
"""

from __future__ import annotations

import errno
import fcntl
import json
import logging
import os
import shutil
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import IO, Any, Protocol

from flagdata.core.files.durable import boot, disk_errors, make_folders
from flagdata.core.files.file_locks import lock
from flagdata.errors import ConflictError, FlagdataError
from flagdata.lake.lake_layout import LinkError
from flagdata.recipes.documents import from_json
from flagdata.storage import Place, RemotePath

LIFE = 240.0
"""How long what is not written anew counts [s]: longer than all retries of one request."""
_LONGEST_LIFE = 3600.0
"""After how long any lock is void, whatever it states [s]."""
_FIRST_WAIT = 0.02  # s
_LONGEST_WAIT = 1.0  # s
_SILENT = 10.0
"""How long is waited without a word [s]."""
_LOG = logging.getLogger("flagdata")
LEASE = "lease"
COLLECT = ".collect"
TURN = ".turn"
MADE = "made"
"""What the process put that made a lake in a bucket."""
SHARED = "shared"
_EXCLUSIVE = "collect"
OF_LOCKS = (_EXCLUSIVE, MADE, SHARED)
"""Entries of staging in a bucket that are no transaction's."""
_ENDED = ("Z", "X")  # states of a process whose parent has not asked for its result yet
Check = Callable[[], None]
"""Raises ConflictError where a lock may have been lost meanwhile, which that of a disk never is."""


class Locks(Protocol):
    """What the processes that use a lake know of each other."""

    def sharing(self) -> AbstractContextManager[Check]:
        """Keeps collections out during the block; any number of writers may be in one."""
        ...

    def alone(self) -> AbstractContextManager[Check]:
        """Keeps all others out during the block."""
        ...

    def note(self) -> FileNote | TimedNote:
        """Begins the lease of a transaction."""
        ...

    def lines(self, folder: Any) -> tuple[list[str], bool]:
        """Returns the lines of the lease in a transaction's folder, and whether its owner lives.

        Raises:
            FileNotFoundError: there is none.
        """
        ...


def locks_of(staging: Place) -> Locks:
    """Returns the locks of a lake."""
    return TimedLocks(staging) if isinstance(staging, RemotePath) else KernelLocks(staging)


class KernelLocks:
    """Locks of a lake in a folder."""

    def __init__(self, staging: Path) -> None:
        self.staging = staging

    @contextmanager
    def sharing(self) -> Iterator[Check]:
        """Shares the lock, see `Locks.sharing`."""
        with self._hold_lock(fcntl.LOCK_SH):
            yield _sure

    @contextmanager
    def alone(self) -> Iterator[Check]:
        """Takes the lock alone, see `Locks.alone`."""
        with self._hold_lock(fcntl.LOCK_EX):
            yield _sure

    def note(self) -> FileNote:
        """Makes a note, see `Locks.note`."""
        return FileNote(self)

    def lines(self, folder: Path) -> tuple[list[str], bool]:
        """Reads the lines of a note, see `Locks.lines`."""
        with _plain(folder / LEASE) as file:
            alive = not lock(file, fcntl.LOCK_SH | fcntl.LOCK_NB, where=folder)
            return file.read().splitlines(), alive

    @contextmanager
    def _hold_lock(self, mode: int) -> Iterator[None]:
        """Takes the lock behind a turnstile: a process that waits for it holds the turnstile, so
        that a stream of shared holders cannot keep an exclusive one out for ever. Not to be
        nested."""
        with ExitStack() as stack:
            with _open_lock(self.staging / TURN) as turn:
                lock(turn, fcntl.LOCK_EX, where=self.staging)
                lock(
                    stack.enter_context(_open_lock(self.staging / COLLECT)),
                    mode,
                    where=self.staging,
                )
            yield


class FileNote:
    """The lease of a transaction of a lake in a folder, in a folder of its own.

    Attributes:
        folder: that folder.
    """

    def __init__(self, locks: KernelLocks) -> None:
        self._locks = locks
        owner = {
            "pid": os.getpid(),
            "host": socket.gethostname(),
            "since": datetime.now(UTC).isoformat(),
        }
        with locks.sharing():
            self.folder = locks.staging / uuid.uuid4().hex
            self.folder.mkdir()
            self._file = (self.folder / LEASE).open("wb", buffering=0)
            try:
                lock(self._file, fcntl.LOCK_EX, where=self.folder)
                self._line(json.dumps(owner))
            except (OSError, FlagdataError):
                self._remove()
                raise

    def append(self, line: str) -> None:
        """Adds a line; no collection that has not seen it runs afterwards."""
        with self._locks.sharing():
            self._line(line)

    def check(self) -> None:
        """Checks nothing: the kernel keeps a lock until it is given up."""

    def close(self) -> None:
        """Takes the lease away, and its folder."""
        with self._locks.sharing():  # none sees the folder half removed
            self._remove()

    def _remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self._file.close()

    def _line(self, text: str) -> None:
        self._file.write(f"{text}\n".encode())


def _sure() -> None:
    """Checks nothing: the kernel keeps a lock until it is given up."""


def _open_lock(path: Path) -> IO[str]:
    with disk_errors("locking the lake", path):
        if not os.path.lexists(path):
            make_folders(path.parent)  # copies of a lake may come without empty folders
            path.touch()
        try:
            return _plain(path, os.O_RDWR)  # NFS locks for one alone only what that one may write
        except OSError as error:
            if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
                raise
        return _plain(path)  # of a reader


def _plain(path: Path, mode: int = os.O_RDONLY) -> IO[str]:
    """Opens a file of staging; a link is not followed, and a pipe not waited for.

    Raises:
        LinkError: a link.
    """
    try:
        descriptor = os.open(path, mode | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError as error:
        if error.errno != errno.ELOOP:
            raise
        raise LinkError(
            "there is a link where a lock of the lake belongs",
            where=str(path),
            fix="delete the link",
        ) from None
    return os.fdopen(descriptor, encoding="utf-8", errors="replace")


class TimedLocks:
    """Locks of a lake in a bucket."""

    def __init__(self, staging: RemotePath) -> None:
        self.staging = staging

    @contextmanager
    def sharing(self) -> Iterator[Check]:
        """Shares the lock, see `Locks.sharing`."""
        text = _line(owner())
        for _ in _pauses(self.staging):
            lock = Held(_put(self.staging / SHARED / uuid.uuid4().hex, text), text)
            try:
                if living(self.staging / _EXCLUSIVE, self.staging) is None:
                    yield lock.check
                    return
            finally:
                lock.close()

    @contextmanager
    def alone(self) -> Iterator[Check]:
        """Takes the lock alone, see `Locks.alone`."""
        target = self.staging / _EXCLUSIVE
        text = _line({**owner(), "id": uuid.uuid4().hex})
        tag = next(
            tag
            for _ in _pauses(self.staging)
            if (tag := _taken(target, text, self.staging)) is not None
        )
        lock = Held(target, text, e_tag=tag)
        try:
            next(None for _ in _pauses(self.staging) if not self._are_shared())
            lock.check()
            yield lock.check
        finally:
            lock.close()

    def note(self) -> TimedNote:
        """Makes a note, see `Locks.note`."""
        text = _line(owner())
        return TimedNote(_put(self.staging / uuid.uuid4().hex / LEASE, text), text)

    def lines(self, folder: RemotePath) -> tuple[list[str], bool]:
        """Reads the lines of a note, see `Locks.lines`."""
        lease = folder / LEASE
        alive = living(lease, self.staging) is not None
        return lease.read_bytes().decode(errors="replace").splitlines(), alive

    def is_claimed(self, *, done: Place) -> bool:
        """Returns whether this process makes the lake: nobody did, or who did was killed before
        `done` was there."""
        text = _line({**owner(), "id": uuid.uuid4().hex})
        if (self.staging / MADE).create(text.encode()):
            return True
        return (
            self.unfinished(done=done)
            and _taken(self.staging / MADE, text, self.staging) is not None
        )

    def unfinished(self, *, done: Place) -> bool:
        """Returns whether a process began to make the lake and was killed before `done` was
        there."""
        marker = self.staging / MADE
        return marker.exists() and living(marker, self.staging) is None and not done.exists()

    def _are_shared(self) -> bool:
        """Returns whether anybody has the shared lock; what dead processes left of it is
        deleted."""
        alive = False
        for shared in (self.staging / SHARED).rglob("*"):
            if living(shared, self.staging) is not None:
                alive = True
            else:
                shared.unlink()
        return alive


class Held:
    """An object that is written anew until it is closed.

    Args:
        place: of the object.
        e_tag: its version, if only that may be replaced: then it is lost where another has replaced
            it.
    """

    def __init__(self, place: RemotePath, text: str, *, e_tag: str | None = None) -> None:
        self.place = place
        self._text = text
        self._e_tag = e_tag
        self._written = _now()
        self._lost = False
        self._guard = threading.Lock()
        self._ended = threading.Event()
        threading.Thread(target=self._renew, name="flagdata lease", daemon=True).start()

    def append(self, line: str) -> None:
        """Add a line; it is there when this returns."""
        with self._guard:
            self._text += f"{line}\n"
            self._write()

    def check(self) -> None:
        """Checks whether others still see this.

        Raises:
            ConflictError: it may not be so, since it could not be written for long.
        """
        if self._lost or _now() - self._written > LIFE / 2:
            raise ConflictError(
                "the store could not be reached for so long that others may take this process for "
                "dead",
                where=str(self.place),
                fix="check the network, then do it again",
            )

    def close(self) -> None:
        """Take the object away, unless another has replaced it."""
        self._ended.set()
        with self._guard, suppress(OSError):  # what is left is void before long
            if self._e_tag is not None:
                self._write()
            if not self._lost:
                self.place.unlink()

    def _renew(self) -> None:
        while not self._ended.wait(LIFE / 12):
            with self._guard:
                if not self._ended.is_set():
                    with suppress(OSError):  # it is tried again; `check` counts the time
                        self._write()

    def _write(self) -> None:
        begun = _now()
        data = self._text.encode()
        if self._e_tag is None:
            self.place.write_bytes(data)
        else:
            tag = _replace_object(self.place, self._e_tag, data)
            self._lost = tag is None
            self._e_tag = tag or self._e_tag
        self._written = begun


class TimedNote(Held):
    """The lease of a transaction of a lake in a bucket."""

    def append(self, line: str) -> None:
        """Adds a line; no collection that has not seen it runs afterwards."""
        super().append(line)
        staging = self.place.parent.parent
        next(None for _ in _pauses(staging) if living(staging / _EXCLUSIVE, staging) is None)


def owner() -> dict[str, Any]:
    """Describes who writes: for people, and for other processes of this machine."""
    return {
        "pid": os.getpid(),
        "host": socket.gethostname(),
        "since": datetime.now(UTC).isoformat(),
        "life": LIFE,
        "machine": _machine(),
        "started": _start_of_process(os.getpid()),
    }


def _taken(lock: RemotePath, text: str, staging: RemotePath) -> str | None:
    """Returns the version of the exclusive lock if it is this process's now: it was free, or its
    holder is dead."""
    data = text.encode()
    with suppress(FileNotFoundError):  # somebody gives it up in this moment
        if lock.create(data):
            return lock.stat().e_tag
        tag = lock.stat().e_tag
        if living(lock, staging) is None:
            return _replace_object(lock, tag, data)
    return None


def _replace_object(lock: RemotePath, tag: str | None, data: bytes) -> str | None:
    """Replaces an object if it has that version, and returns its new one; `None` where it had
    another one.

    A request that is sent again because its first answer was lost finds what itself has put, and
    counts as done.
    """
    if (new := lock.replace_if(tag, data)) is not None:
        return new
    with suppress(FileNotFoundError):
        now = lock.stat().e_tag
        if lock.read_bytes() == data:
            return now
    return None


def _pauses(staging: RemotePath) -> Iterator[None]:
    """Yields endless tries, the first at once, with waits between them that grow; a wait that
    becomes long is reported."""
    wait, begun, is_reported = _FIRST_WAIT, _now(), False
    while True:
        yield
        time.sleep(wait)
        wait = min(2 * wait, _LONGEST_WAIT)
        if not is_reported and _now() - begun > _SILENT:
            is_reported = True
            _LOG.warning(
                "flagdata: waiting for another process that uses the lake: it collects, names a "
                "version or commits\n"
                "  where: %s\n  fix:   none needed; if it was killed on another machine, its lock "
                "is void after %.0f s",
                staging,
                LIFE,
            )


def _put(target: RemotePath, text: str) -> RemotePath:
    target.write_bytes(text.encode())
    return target


def _line(content: dict[str, Any]) -> str:
    return json.dumps(content) + "\n"


def living(lock: RemotePath, staging: RemotePath) -> dict[str, Any] | None:
    """Reads the owner of a lock or lease if it counts; None where it is not there, void, or its
    process has ended."""
    try:
        content = from_json(lock.read_bytes().decode().split("\n")[0])
        life, machine, pid, started = (
            float(content["life"]),
            content["machine"],
            content["pid"],
            content["started"],
        )
        life = min(_LONGEST_LIFE, life)  # also of what is not a number
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        content, life, machine, pid, started = {}, LIFE, None, 0, None
    if machine is not None and machine == _machine() and _start_of_process(pid) != started:
        return None
    with suppress(FileNotFoundError):
        written = RemotePath(lock.bucket, lock.key).stat().st_mtime
        if staging.now() - written <= life:
            return content
    return None


def _now() -> float:
    """Seconds that go on while the machine sleeps: by CLOCK_BOOTTIME, or by CLOCK_MONOTONIC where
    there is none.

    The latter goes on in sleep on macOS. Where it does not, a machine that slept while it published
    may publish after others took it for dead; then a collection may have deleted an object of its
    commit, which `doctor` reports.
    """
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


@cache
def _machine() -> str | None:
    """Identifies this machine since it was started, and the processes that it numbers together;
    None where it does not say."""
    if (since := boot()) is not None:
        with suppress(OSError):
            return f"{since} {Path('/proc/self/ns/pid').readlink()}"
    return None


def _start_of_process(pid: int) -> int | None:
    """Reads when a process was started, in ticks since this machine was; None if it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return None if fields[0] in _ENDED else int(fields[19])
    except (OSError, ValueError, IndexError):
        return None
