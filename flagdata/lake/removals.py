"""Commits that took rows or data off: withdrawals, merges that carry them over, deletions of branches, expirations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.errors import FlagdataError, NotFoundError
from flagdata.lake.lineage import EXPIRED, noted_erased, noted_expired, noted_hidden
from flagdata.lake.marking import mark
from flagdata.lake.refs import MAIN
from flagdata.lake.store import Store

_RESTORE = "the version of flagdata that ingested the source restores it by ingesting it again"


@dataclass(frozen=True, kw_only=True)
class Removal:
    """One such commit.

    Attributes:
        artifacts: ids of the rows that its branch does not show any more.
        objects: id of each row that left the table → its object's name; later versions do not show it, unless another
            branch does or it came again.
    """

    version: int
    branch: str
    message: str
    artifacts: frozenset[str]
    objects: dict[str, str]


def removals(lake: Store, *, since: int = -1, branch: str | None = None) -> Iterator[Removal]:
    """Those after the version `since`, of one branch or of all, newest first; each is read when it is asked for."""
    for entry in lake.catalog.history():
        if "withdrawn" in entry and entry["version"] > since and branch in (None, entry.get("branch")):
            before, after = (_stored(lake, version) for version in (entry["version"] - 1, entry["version"]))
            gone = pc.invert(pc.is_in(_keys(before), value_set=_keys(after)))  # type: ignore[attr-defined]
            left = {row["artifact"]: row["object"] for row in before.filter(gone).to_pylist()}
            yield Removal(
                version=entry["version"],
                branch=entry.get("branch", MAIN),
                message=entry.get("message", ""),
                artifacts=frozenset(left) | noted_hidden(entry),
                objects={artifact: name for artifact, name in left.items() if name is not None},
            )


def _stored(lake: Store, version: int) -> pa.Table:
    columns = ["artifact", "branch", "object"]
    rows = lake.catalog.scan(version)
    return lake.catalog.rows(version).select(columns) if rows is None else rows.table(columns)


def _keys(rows: pa.Table) -> pa.ChunkedArray:
    """What distinguishes rows: artifact and branch."""
    return pc.binary_join_element_wise(rows["artifact"], rows["branch"], "/")  # type: ignore[attr-defined]


def erased(lake: Store) -> dict[str, tuple[int, str]]:
    """Object → the newest version that erased an artifact of it from all refs, and why."""
    return {
        name: (entry["version"], entry.get("message", ""))
        for entry in reversed(lake.catalog.history())
        for name in noted_erased(entry).values()
        if isinstance(name, str)
    }


@dataclass(frozen=True, kw_only=True)
class Expiration:
    """A commit that let the versions up to one expire: which, why, and the objects that went."""

    version: int
    up_to: int
    message: str
    objects: frozenset[str]


def expirations(lake: Store) -> list[Expiration]:
    """The commits that let versions expire, newest first."""
    found = []
    for entry in lake.catalog.history():
        if EXPIRED in entry:
            up_to, objects = noted_expired(entry)
            message = entry.get("message", "")
            found.append(Expiration(version=entry["version"], up_to=up_to, message=message, objects=objects))
    return found


def explained(lake: Store, name: str, missing: NotFoundError) -> NotFoundError:
    """Why an object is missing: it was erased, it went with versions that expired, or it was collected after a version
    withdrew what it held; `missing` where no version did, or where the catalog cannot be asked."""
    try:
        if name in mark(lake, grace=timedelta(0)).objects:
            return missing
        if name in (known := erased(lake)):
            version, message = known[name]
            return NotFoundError(
                f"{name} was erased from all versions by version {version} ({message})",
                where=missing.where,
                fix="leave its artifact out by --where; no version has its data any more",
            )
        for one in expirations(lake):
            if name in one.objects:
                return NotFoundError(
                    f"{name} went when versions up to {one.up_to} expired, by version {one.version} ({one.message})",
                    where=missing.where,
                    fix=f"use a tag, or a version from {one.version} on; {_RESTORE}",
                )
        for removal in removals(lake):
            if name in removal.objects.values():
                return NotFoundError(
                    f"{name} was withdrawn by version {removal.version} ({removal.message}), and gc has deleted it",
                    where=missing.where,
                    fix=f"use a tag, or a version from {removal.version} on; {_RESTORE}",
                )
    except FlagdataError:
        return missing
    return missing


def lost(lake: Store, rows: pa.Table) -> dict[str, NotFoundError]:
    """Object of some of the rows that is not in the lake → why."""
    found: dict[str, NotFoundError] = {}
    for name in sorted(rows["object"].drop_null().unique().to_pylist()):
        if not lake.objects.has(name):
            found[name] = explained(lake, name, lake.objects.missing(name))
    return found
