"""Leases and locks of a lake in a bucket, where no kernel drops a lock of a process that ends.

Each is an object in `staging/` that its holder writes anew every few seconds; the store's own clock says when it was
written last. One that was not for `life` seconds is void. A process that finds one made on its own machine by a process
that has ended need not wait for that.

    staging/collect       the exclusive lock: taken by `create`, or from a dead holder by a conditional put
    staging/shared/ID     a holder of the shared lock
    staging/ID/lease      a running transaction: its owner, and the objects it holds, a line each

Who wants the shared lock puts an object and then looks for the exclusive one; who wants that puts it and then looks for
shared ones. A store answers each read with what was put before, so of two that come at once at least one sees the
other, and the one who shares withdraws. A transaction that relies on an object puts its lease so, and then waits until
nobody has the exclusive lock: a collection that begins later sees the lease.

A holder that could not write for half of `life` does not publish and deletes nothing more: see `Held.check`.
"""

from __future__ import annotations

import json
import logging
import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from flagdata.documents import from_json
from flagdata.errors import ConflictError
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
COLLECT = "collect"
MADE = "made"
"""What the process put that made the lake."""
SHARED = "shared"
_ENDED = ("Z", "X")  # states of a process whose parent has not asked for its result yet


def owner() -> dict[str, Any]:
    """Who writes: for people, and for other processes of this machine."""
    return {
        "pid": os.getpid(),
        "host": socket.gethostname(),
        "since": datetime.now(UTC).isoformat(),
        "life": LIFE,
        "machine": _machine(),
        "started": _started(os.getpid()),
    }


class Held:
    """An object that is written anew until it is closed.

    Args:
        place: of the object.
        e_tag: its version, if only that may be replaced: then it is lost where another has replaced it.
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
        """Whether others still see this.

        Raises:
            ConflictError: it may not be so, since it could not be written for long.
        """
        if self._lost or _now() - self._written > LIFE / 2:
            raise ConflictError(
                "the store could not be reached for so long that others may take this process for dead",
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
            tag = _replaced(self.place, self._e_tag, data)
            self._lost = tag is None
            self._e_tag = tag or self._e_tag
        self._written = begun


@contextmanager
def sharing(staging: RemotePath) -> Iterator[Held]:
    """Nobody collects during the block."""
    text = _line(owner())
    for _ in _pauses(staging):
        held = Held(_put(staging / SHARED / uuid.uuid4().hex, text), text)
        try:
            if _living(staging / COLLECT, staging) is None:
                yield held
                return
        finally:
            held.close()


@contextmanager
def alone(staging: RemotePath) -> Iterator[Held]:
    """Nobody else has the shared or the exclusive lock during the block."""
    place = staging / COLLECT
    text = _line({**owner(), "id": uuid.uuid4().hex})
    tag = next(tag for _ in _pauses(staging) if (tag := _taken(place, text, staging)) is not None)
    held = Held(place, text, e_tag=tag)
    try:
        next(None for _ in _pauses(staging) if not _sharers(staging))
        held.check()
        yield held
    finally:
        held.close()


def claimed(staging: RemotePath, *, done: Place) -> bool:
    """Whether this process makes the lake: nobody did, or who did was killed before `done` was there."""
    text = _line({**owner(), "id": uuid.uuid4().hex})
    if (staging / MADE).create(text.encode()):
        return True
    return unfinished(staging, done=done) and _taken(staging / MADE, text, staging) is not None


def unfinished(staging: RemotePath, *, done: Place) -> bool:
    """Whether a process began to make the lake and was killed before `done` was there."""
    return (staging / MADE).exists() and _living(staging / MADE, staging) is None and not done.exists()


def _taken(place: RemotePath, text: str, staging: RemotePath) -> str | None:
    """The version of the exclusive lock if it is this process's now: it was free, or its holder is dead."""
    data = text.encode()
    with suppress(FileNotFoundError):  # somebody gives it up in this moment
        if place.create(data):
            return place.stat().e_tag
        tag = place.stat().e_tag
        if _living(place, staging) is None:
            return _replaced(place, tag, data)
    return None


def _replaced(place: RemotePath, tag: str | None, data: bytes) -> str | None:
    """The new version of an object that is replaced if it has that version; `None` where it had another one.

    A request that is sent again because its first answer was lost finds what itself has put, and counts as done.
    """
    if (new := place.replace_if(tag, data)) is not None:
        return new
    with suppress(FileNotFoundError):
        now = place.stat().e_tag
        if place.read_bytes() == data:
            return now
    return None


def _sharers(staging: RemotePath) -> bool:
    """Whether anybody has the shared lock; what dead processes left of it is deleted."""
    living = False
    for place in (staging / SHARED).rglob("*"):
        if _living(place, staging) is not None:
            living = True
        else:
            place.unlink()
    return living


def await_collectors(staging: RemotePath) -> None:
    """Wait until nobody collects who may have read the leases before."""
    next(None for _ in _pauses(staging) if _living(staging / COLLECT, staging) is None)


def _pauses(staging: RemotePath) -> Iterator[None]:
    """Endless tries, the first at once, with waits between them that grow; a wait that becomes long is reported."""
    wait, begun, said = _FIRST_WAIT, _now(), False
    while True:
        yield
        time.sleep(wait)
        wait = min(2 * wait, _LONGEST_WAIT)
        if not said and _now() - begun > _SILENT:
            said = True
            _LOG.warning(
                "flagdata: waiting for another process that uses the lake: it collects, names a version or commits\n"
                "  where: %s\n  fix:   none needed; if it was killed on another machine, its lock is void after %.0f s",
                staging,
                LIFE,
            )


def lease_lines(folder: RemotePath) -> tuple[list[str], bool]:
    """The lines of the lease in a transaction's folder, and whether its owner lives.

    Raises:
        FileNotFoundError: there is none.
    """
    lease = folder / LEASE
    living = _living(lease, folder.parent)
    return lease.read_bytes().decode(errors="replace").splitlines(), living is not None


def new_lease(staging: RemotePath) -> Held:
    """The lease of a transaction that begins."""
    text = _line(owner())
    return Held(_put(staging / uuid.uuid4().hex / LEASE, text), text)


def _put(place: RemotePath, text: str) -> RemotePath:
    place.write_bytes(text.encode())
    return place


def _line(content: dict[str, Any]) -> str:
    return json.dumps(content) + "\n"


def _living(place: RemotePath, staging: RemotePath) -> dict[str, Any] | None:
    """The owner of a lock or lease if it counts; None where it is not there, void, or its process has ended."""
    try:
        content = from_json(place.read_bytes().decode().split("\n")[0])
        life, machine, pid, started = float(content["life"]), content["machine"], content["pid"], content["started"]
        life = min(_LONGEST_LIFE, life)  # also of what is not a number
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        content, life, machine, pid, started = {}, LIFE, None, 0, None
    if machine is not None and machine == _machine() and _started(pid) != started:
        return None
    with suppress(FileNotFoundError):
        written = RemotePath(place.bucket, place.key).stat().st_mtime
        if staging.now() - written <= life:
            return content
    return None


def _now() -> float:
    """Seconds that go on while the machine sleeps: by CLOCK_BOOTTIME, or by CLOCK_MONOTONIC where there is none.

    The latter goes on in sleep on macOS. Where it does not, a machine that slept while it published may publish after
    others took it for dead; then a collection may have deleted an object of its commit, which `doctor` reports.
    """
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


@cache
def _machine() -> str | None:
    """This machine since it was started, and the processes that it numbers together; None where it does not say."""
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot} {Path('/proc/self/ns/pid').readlink()}"
    return None


def _started(pid: int) -> int | None:
    """When a process was started, in ticks since this machine was; None if it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return None if fields[0] in _ENDED else int(fields[19])
    except (OSError, ValueError, IndexError):
        return None
