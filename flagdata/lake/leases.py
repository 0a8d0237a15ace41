"""What running transactions hold, so that garbage collection leaves it alone.

A transaction owns one folder in `staging/`. Its file `lease` is locked (flock) for as long as the
process lives: the kernel drops the lock when the process ends, however it ends, so a lock that can
be taken proves that the owner is dead. An object's name is written to the lease before the object
is looked for or moved to its place. That step, a commit and the making of a ref take the lock
`staging/.collect` shared; a collection takes it exclusively while it reads leases, then the
catalog, and deletes. A collector therefore either sees the lease, or finds the row committed, or
comes before the transaction looked for the object.

So it is on a disk; in a bucket, `flagdata.lake.lake_locks` has locks and leases of the same
meaning.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.files.caches import user_cache
from flagdata.core.files.file_locks import check_locks
from flagdata.core.files.regular_files import is_beside
from flagdata.lake.lake_layout import LinkError
from flagdata.lake.lake_locks import OF_LOCKS, SHARED, Check, FileNote, locks_of
from flagdata.recipes.documents import from_json
from flagdata.storage import Place, RemotePath


@dataclass(frozen=True, kw_only=True)
class LeaseState:
    """A staging folder as another process sees it: its owner, whether it lives, and the objects it
    holds.

    Attributes:
        leased: whether there is a lease at all; without, nothing proves that the process that made
            the folder is dead.
    """

    folder: Place
    leased: bool
    alive: bool
    owner: str
    objects: frozenset[str]


class Lease:
    """The lease of one running transaction, and its folder on this machine."""

    def __init__(self, staging: Place) -> None:
        self._locks = locks_of(staging)
        self._local = Lease(_scratch()) if isinstance(staging, RemotePath) else None
        try:
            self._note = self._locks.note()
        except BaseException:
            if self._local is not None:
                self._local.close()
            raise

    @property
    def folder(self) -> Path:
        """Returns the folder in which the transaction writes."""
        if isinstance(self._note, FileNote):
            return self._note.folder
        return self._local.folder  # type: ignore[union-attr]

    def hold(self, object_name: str) -> None:
        """Notes that the transaction relies on the object; no collection that has not seen it runs
        afterwards."""
        self._note.append(object_name)

    @contextmanager
    def keeping_collectors_out(self) -> Iterator[Check]:
        """Keeps collections from running during the block; the check is of the lease, too."""
        with self._locks.sharing() as check:

            def check_both() -> None:
                check()
                self._note.check()

            yield check_both

    def close(self) -> None:
        """Give everything up and remove the folder; what cannot be removed is left to a
        collection."""
        self._note.close()
        if self._local is not None:
            self._local.close()


def _scratch() -> Path:
    """Returns where this machine's transactions write what goes into buckets; what those left that
    died is deleted."""
    folder = user_cache() / "staging"
    folder.mkdir(parents=True, exist_ok=True)
    check_locks(folder)
    with collecting(folder):
        for state in leases(folder):
            if state.leased and not state.alive:
                shutil.rmtree(state.folder, ignore_errors=True)  # type: ignore[arg-type]
    return folder


def keeping_collectors_out(staging: Place) -> AbstractContextManager[Check]:
    """Keeps collections from running during the block; any number of writers may."""
    return locks_of(staging).sharing()


def collecting(staging: Place) -> AbstractContextManager[Check]:
    """Keeps transactions from starting, putting an object, committing or ending, and refs from
    being made, during the block."""
    return locks_of(staging).alone()


def looking(staging: Place) -> AbstractContextManager[object]:
    """Allows a look at staging: on a disk, where folders appear before their leases do, none is
    being made meanwhile; in a bucket each entry shows whole, so that no lock is put for which the
    keys would have to permit writing."""
    return nullcontext() if isinstance(staging, RemotePath) else collecting(staging)


def leases(staging: Place) -> list[LeaseState]:
    """Lists all staging folders, by name."""
    states, locks = [], locks_of(staging)
    folders = (path for path in _entries(staging) if _is_folder(path))
    for folder in sorted(folders):  # type: ignore[type-var]
        if folder.name == SHARED or is_beside(folder.name):
            continue
        leased = True
        try:
            lines, alive = locks.lines(folder)
        except (FileNotFoundError, IsADirectoryError, LinkError):
            leased, alive, lines = False, False, []
            if not _is_folder(folder):
                continue
        owner = _owner(lines[0]) if lines else "owner unknown"
        states.append(
            LeaseState(
                folder=folder, leased=leased, alive=alive, owner=owner, objects=frozenset(lines[1:])
            )
        )
    return states


def unleased_entries(staging: Place) -> list[Place]:
    """Entries of staging without a lease: folders without one, and files, by name."""
    # The shared locks' folder in a bucket is gone with the last of them, which may be between two
    # requests.
    folders = [state.folder for state in leases(staging) if not state.leased]
    entries = [
        path for path in _entries(staging) if path.name not in OF_LOCKS and not is_beside(path.name)
    ]
    files = [path for path in entries if not _is_folder(path)]
    return sorted([*folders, *files])  # type: ignore[type-var]


def _entries(staging: Place) -> list[Place]:
    """Lists what lies in staging; nothing in a copy of a lake that came without its empty
    folders."""
    try:
        return list(staging.iterdir())
    except FileNotFoundError:
        return []


def last_written(path: Place) -> float:
    """Returns when a file, or anything in a folder, was written last [s since 1970]."""
    inside = path.rglob("*") if _is_folder(path) else ()
    itself = () if isinstance(path, RemotePath) and inside else (path,)
    return max(
        (entry.lstat().st_mtime for entry in (*itself, *inside)), default=0.0
    )  # its owner has just removed it


def _is_folder(path: Place) -> bool:
    return path.is_dir() and not path.is_symlink()


def _owner(line: str) -> str:
    try:
        owner = from_json(line)
        return f"process {owner['pid']} on {owner['host']} since {owner['since']}"
    except (
        ValueError,
        KeyError,
        TypeError,
    ):  # it died, or the disk was full, before the line was whole
        return "owner unknown"
