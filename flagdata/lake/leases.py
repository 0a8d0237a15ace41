"""What running transactions hold, so that garbage collection leaves it alone.

A transaction owns one folder in `staging/`. Its file `lease` is locked (flock) for as long as the process lives: the
kernel drops the lock when the process ends, however it ends, so a lock that can be taken proves that the owner is dead.
Object names are written to the lease before the object is looked for or moved to its place. That step and a
collection's "read leases, read catalog, delete" exclude each other by the lock `staging/.collect`, shared by the
former, exclusive for the latter. A collector therefore either sees the lease, or finds the row committed, or comes
before the transaction looked for the object.

Locks work between processes of one machine, and over file systems that carry flock between machines (NFS 4, Lustre).
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import socket
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

_LEASE = "lease"
_COLLECT = ".collect"


@dataclass(frozen=True, kw_only=True)
class LeaseState:
    """A staging folder as another process sees it: its owner, whether it lives, and the objects it holds."""

    folder: Path
    alive: bool
    owner: str
    objects: frozenset[str]


class Lease:
    """The staging folder of one running transaction."""

    def __init__(self, staging: Path) -> None:
        with _locked(staging / _COLLECT, fcntl.LOCK_SH):
            self.folder = staging / uuid.uuid4().hex
            self.folder.mkdir()
            self._file = (self.folder / _LEASE).open("w", encoding="utf-8")
            fcntl.flock(self._file, fcntl.LOCK_EX)
            owner = {"pid": os.getpid(), "host": socket.gethostname(), "since": datetime.now(UTC).isoformat()}
            self._line(json.dumps(owner))

    @contextmanager
    def holding(self, object_name: str) -> Iterator[None]:
        """Note that the transaction relies on the object, then keep collectors out during the block."""
        with _locked(self.folder.parent / _COLLECT, fcntl.LOCK_SH):
            self._line(object_name)
            yield

    def close(self) -> None:
        """Give everything up and remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self._file.close()

    def _line(self, text: str) -> None:
        self._file.write(text + "\n")
        self._file.flush()


@contextmanager
def collecting(staging: Path) -> Iterator[None]:
    """Keep transactions from starting or putting objects during the block."""
    with _locked(staging / _COLLECT, fcntl.LOCK_EX):
        yield


def leases(staging: Path) -> list[LeaseState]:
    """All staging folders, by name."""
    states = []
    for folder in sorted(p for p in staging.iterdir() if p.is_dir()):
        try:
            with (folder / _LEASE).open(encoding="utf-8") as file:
                alive = not _try_lock(file.fileno())
                lines = file.read().splitlines()
        except FileNotFoundError:
            alive, lines = False, []
            if not folder.exists():
                continue
        owner = json.loads(lines[0]) if lines else {}
        described = f"process {owner['pid']} on {owner['host']} since {owner['since']}" if owner else "unknown"
        states.append(LeaseState(folder=folder, alive=alive, owner=described, objects=frozenset(lines[1:])))
    return states


def _try_lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def _locked(path: Path, mode: int) -> Iterator[None]:
    with path.open("a") as file:
        fcntl.flock(file, mode)
        yield
