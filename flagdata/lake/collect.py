"""Garbage collection: delete unreferenced files that no running transaction holds.

Kept are all objects that a branch or tag shows, that a row withdrawn less than the grace period ago points to, that a
living transaction has put or looked up, and whatever is younger than the grace period by the clock that gave it its
time. Unfinished uploads in parts to a bucket go by the same rules. What the log says was erased goes at any age: its
erasure was not finished. Staging folders go as soon as their owner is dead, which its lock proves; what lies there
without a lease, after the grace period. All files of the catalog that some version is made of stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta

from flagdata.errors import CorruptError
from flagdata.findings import Severity
from flagdata.lake.durable import disk_errors
from flagdata.lake.erasure import unfinished
from flagdata.lake.lake import Lake
from flagdata.lake.layout import check_own
from flagdata.lake.leases import LeaseState, collecting, last_written, leases, looking, unleased
from flagdata.lake.marking import Marked, catalog_files, mark
from flagdata.lake.objects import Objects, bytes_at, path_in_lake
from flagdata.storage import Place, RemotePath, StoreError
from flagdata.storage.uploads import Upload


@dataclass(frozen=True, kw_only=True)
class Garbage:
    """What can go.

    Attributes:
        objects: by name.
        leftovers: other paths: staging folders, unpublished files.
        size: of these and of the objects [B].
        uploads: to a bucket that were begun and not finished; no listing states the size of their parts.
        unlisted: why the store does not say which uploads there are; `None` where it does.
    """

    objects: tuple[str, ...]
    leftovers: tuple[Place, ...]
    size: int
    uploads: tuple[Upload, ...] = ()
    unlisted: StoreError | None = None


def garbage(lake: Lake, *, grace: timedelta) -> Garbage:
    """What `collect` would delete now.

    Raises:
        LinkError: a folder of the lake is not its own.
        CorruptError: a ref cannot be read or the catalog is damaged, so what it needs is unknown.
    """
    check_own(lake.path)
    with looking(lake.staging), disk_errors("looking for garbage", lake.path):
        return _find(lake, grace)


def collect(lake: Lake, *, grace: timedelta) -> Garbage:
    """Delete the garbage and say what it was. Transactions wait while it works; none loses anything.

    Raises:
        LinkError: a folder of the lake is not its own; nothing was deleted.
        CorruptError: a ref cannot be read or the catalog is damaged, so what it needs is unknown; nothing was deleted.
    """
    lake.check_writable()
    with collecting(lake.staging) as check, disk_errors("collecting", lake.path):
        found = _find(lake, grace)
        for name in found.objects:
            check()
            lake.objects.delete(name)
        for path in found.leftovers:
            check()
            Objects.remove(path)
        for upload in found.uploads:
            check()
            upload.abort()
    return found


def _find(lake: Lake, grace: timedelta) -> Garbage:
    states = leases(lake.staging)  # before the catalog: a lease that is gone by now has its rows committed
    marked = mark(lake, grace=grace)
    # Rows read from a changed file may name other objects than those they need, so files are re-hashed first.
    damage = [f for f in (*marked.findings, *catalog_files(lake)) if f.severity is Severity.ERROR]
    if damage:
        first = damage[0]
        raise CorruptError(
            f"which objects are needed is unknown: {first.what}",
            where=first.where,
            fix=first.fix or "run flagdata doctor",
        )
    found = unneeded(lake, marked, states, grace=grace)
    try:
        limit = lake.now() - grace.total_seconds()
        left = tuple(upload for upload in left_uploads(lake, states) if upload.begun <= limit)
    except StoreError as error:
        return replace(found, unlisted=error)
    return replace(found, uploads=left)


def left_uploads(lake: Lake, states: Sequence[LeaseState]) -> tuple[Upload, ...]:
    """Unfinished uploads to a lake in a bucket of which no living transaction has the object.

    Raises:
        StoreError: the store does not list them.
    """
    if not isinstance(lake.path, RemotePath):
        return ()
    held = {str(lake.path / path_in_lake(name)) for state in states if state.alive for name in state.objects}
    return tuple(one for one in lake.path.uploads() if not any(f"{one}/".startswith(f"{place}/") for place in held))


def unneeded(lake: Lake, marked: Marked, states: Sequence[LeaseState], *, grace: timedelta) -> Garbage:
    """What neither a marked row nor a living transaction needs, and what is older than the grace period.

    Args:
        marked: what is needed, read after `states`.
        states: of all staging folders. Without the lock of `collecting`, what a transaction has put since, and which is
            not younger than the grace period, may be among what is found.
    """
    needed = marked.objects.union(*(state.objects for state in states if state.alive))
    limit = lake.now() - grace.total_seconds()
    erased = unfinished(lake, needed)
    objects = [o for o in lake.objects if o.name not in needed and (o.modified <= limit or o.name in erased)]
    leftovers: list[Place] = [state.folder for state in states if state.leased and not state.alive]
    leftovers += [path for path in unleased(lake.staging) if last_written(path) <= limit]
    leftovers += [path for path in lake.unpublished_files() if path.lstat().st_mtime <= limit]
    return Garbage(
        objects=tuple(o.name for o in objects),
        leftovers=tuple(leftovers),
        size=sum(o.size for o in objects) + sum(bytes_at(path) for path in leftovers),
    )
