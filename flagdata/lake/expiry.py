"""Expiring versions: the oldest versions give up what only they show, and the log keeps which they were and what went.

The rows of a version stay readable for as long as the lake exists. Its data stay while a branch, a tag or a version
that has not expired shows them. `gc` deletes what was withdrawn a day ago, without a trace of its own; this is the
deliberate way, at once, with a reason. What a branch or a tag shows does not change.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from flagdata.errors import ConflictError, CorruptError
from flagdata.findings import Severity
from flagdata.lake.catalog import persist
from flagdata.lake.durable import disk_errors
from flagdata.lake.leases import collecting, leases, looking
from flagdata.lake.lineage import EXPIRED
from flagdata.lake.marking import catalog_files, mark
from flagdata.lake.refs import View
from flagdata.lake.removals import expirations, lost
from flagdata.lake.store import Store
from flagdata.schema import catalog_schema


@dataclass(frozen=True, kw_only=True)
class Expiry:
    """What expires.

    Attributes:
        up_to: the newest version that expires, with all before it; −1 where none does.
        objects: names of the objects that go, sorted.
        size: of these [B].
        version: of the table after it; `None` where nothing was committed.
    """

    up_to: int
    objects: tuple[str, ...]
    size: int
    version: int | None = None


def last_version(lake: Store, *, older_than: timedelta | None, keep: int | None) -> int:
    """The newest version that expires: one that another replaced so long ago, and that is not among the newest `keep`;
    −1 where there is none. The head never expires."""
    history = lake.catalog.history()  # newest first
    last = history[0]["version"] - 1
    if keep is not None:
        last = min(last, history[0]["version"] - keep)
    if older_than is not None:
        limit = (datetime.now(UTC) - older_than).timestamp() * 1000
        later = [entry["version"] for entry in history if entry["timestamp"] > limit]
        last = min(last, min(later) - 2 if later else last)
    return max(last, -1)


def expire(lake: Store, up_to: int, message: str | None = None, *, dry_run: bool = False) -> Expiry:
    """Let the versions up to `up_to` expire: note it, and delete what no other version, branch or tag shows.

    Args:
        up_to: before the head.
        message: why.
        dry_run: find out only.

    Raises:
        CorruptError: a ref cannot be read or the catalog is damaged, so what is needed is unknown; nothing was deleted.
    """
    if not dry_run:
        lake.check_writable()
    with disk_errors("expiring versions", lake.path):
        if dry_run or up_to < 0:
            with looking(lake.staging):
                return _found(lake, up_to)
        return _expire(lake, up_to, message)


def _expire(lake: Store, up_to: int, message: str | None) -> Expiry:
    with collecting(lake.staging) as check:
        found = _found(lake, up_to)
        noted = json.dumps({"up_to": up_to, "objects": list(found.objects)})
        info = {"message": message or f"expire versions up to {up_to}", EXPIRED: noted}

        def attempt() -> int:
            return lake.catalog.append(catalog_schema().empty_table(), base=lake.catalog.head(), info=info)

        version = persist(attempt, where=lake.catalog.path)
        for name in found.objects:
            check()
            lake.objects.delete(name)
    return Expiry(up_to=up_to, objects=found.objects, size=found.size, version=version)


def _found(lake: Store, up_to: int) -> Expiry:
    """What goes with the versions up to one; transactions are kept out."""
    held = {name for state in leases(lake.staging) if state.alive for name in state.objects}
    marked = mark(lake, grace=timedelta(0), first=up_to + 1)
    # Rows read from a changed file may name other objects than those they need, so files are re-hashed first.
    damage = [found for found in (*marked.findings, *catalog_files(lake)) if found.severity is Severity.ERROR]
    if damage:
        raise CorruptError(
            f"which objects are needed is unknown: {damage[0].what}",
            where=damage[0].where,
            fix=damage[0].fix or "run flagdata doctor",
        )
    committed = lake.catalog.objects() - marked.objects - held
    going = [stored for stored in lake.objects if stored.name in committed]
    return Expiry(up_to=up_to, objects=tuple(sorted(one.name for one in going)), size=sum(one.size for one in going))


def check_whole(lake: Store, view: View) -> None:
    """Whether a new tag or branch may show a view: not that of an expired version whose data went.

    Raises:
        ConflictError: some of its data are not in the lake.
    """
    newest = max(part.version for part in view)
    if any(newest <= one.up_to for one in expirations(lake)):
        for why in lost(lake, lake.table(view)).values():
            raise ConflictError(why.what, where=str(lake.path), fix="choose a newer version, or one that a tag shows")
