"""Erasing artifacts everywhere: off every branch, their bytes deleted at once, also where a tag or an old version shows
them.

Rows of tags and of older versions stay, so that it stays known what they held; a commit notes what was erased and why.
Objects that other rows need stay. What a lake cannot reach is named: exports, clones, caches. The commit comes first: a
process that is killed before it has deleted the bytes, or a disk that refuses, leaves an erasure that the log knows,
see `unfinished`. The same command finishes it, and so does `gc`.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import timedelta

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.errors import CorruptError, FlagdataError, NotFoundError
from flagdata.findings import Severity
from flagdata.lake import naming
from flagdata.lake.catalog import persist
from flagdata.lake.durable import disk_errors
from flagdata.lake.leases import Check, collecting, leases
from flagdata.lake.lineage import noted_erased
from flagdata.lake.marking import mark
from flagdata.lake.refs import MAIN
from flagdata.lake.removals import erased as erased_objects
from flagdata.lake.store import Store
from flagdata.lake.withdrawal import check_leaving, clips_of, descendants, take_off

BEYOND = (
    "exports that were made of them",
    "clones and copies of this lake",
    "caches outside it, and backups",
    "older versions of its objects, where it lies in a bucket that keeps them",
    "the files that were ingested",
)
"""What holds the bytes where this lake does not reach."""
_GRACE = timedelta(days=1)
"""How long what was withdrawn is needed, as far as an erasure before it is concerned."""


@dataclass(frozen=True, kw_only=True)
class Erasure:
    """What was erased.

    Attributes:
        version: of the table after it.
        artifacts: ids, sorted, those of clips and of descendants among them.
        branches: that showed them.
        tags: that go on to list them, without data.
        objects: names of the objects whose bytes are gone.
        kept: object → why its bytes are still there.
    """

    version: int
    artifacts: tuple[str, ...]
    branches: tuple[str, ...]
    tags: tuple[str, ...]
    objects: tuple[str, ...]
    kept: dict[str, str]


def erase(lake: Store, artifacts: Collection[str], message: str, *, with_descendants: bool) -> Erasure:
    """See `Lake.erase`."""
    lake.check_writable()
    asked = frozenset(artifacts)
    with disk_errors("erasing", lake.path), collecting(lake.staging) as check:
        shown = {ref: lake.rows(at=ref) for ref in (MAIN, *lake.refs.branches(), *lake.refs.tags())}
        before = _Before.of(lake, asked)
        going = _all(shown, asked, erased=before.objects, with_descendants=with_descendants, where=str(lake.path))
        erased = {artifact: name for artifact, name in before.objects.items() if artifact in going} | {
            row["artifact"]: row["object"]
            for table in shown.values()
            for row in table.select(["artifact", "object"]).to_pylist()
            if row["artifact"] in going
        }
        concerned = [ref for ref, table in shown.items() if going.intersection(table["artifact"].to_pylist())]
        tags = frozenset(lake.refs.tags())
        branches = [ref for ref in concerned if ref not in tags]
        version = before.version
        for branch in branches or ([] if going <= before.objects.keys() else [MAIN]):
            version = persist(lambda b=branch: _off(lake, erased, message, branch=b), where=lake.catalog.path)
        names = {*erased.values(), *before.objects.values()} - {None}
        removed, kept = _delete(lake, names, check)  # type: ignore[arg-type]
    return Erasure(
        version=version,
        artifacts=tuple(sorted(erased)),
        branches=tuple(branches),
        tags=tuple(ref for ref in concerned if ref in tags),
        objects=removed,
        kept=kept,
    )


@dataclass(frozen=True, kw_only=True)
class _Before:
    """What earlier commits erased together with some artifacts, and what nothing that was committed since needs.

    Attributes:
        version: of the newest of these commits; 0 where there is none.
        objects: artifact → its object.
    """

    version: int
    objects: Mapping[str, str | None]

    @classmethod
    def of(cls, lake: Store, asked: frozenset[str]) -> _Before:
        entries = [entry for entry in lake.catalog.history() if asked & noted_erased(entry).keys()]
        if not entries:
            return cls(version=0, objects={})
        needed = mark(lake, grace=_GRACE).objects
        return cls(
            version=entries[0]["version"],
            objects={
                artifact: name
                for entry in entries
                for artifact, name in noted_erased(entry).items()
                if name not in needed
            },
        )


def unfinished(lake: Store, needed: Collection[str]) -> dict[str, tuple[int, str]]:
    """Object that is stored though all artifacts of it were erased → the version that erased it, and why.

    Args:
        needed: objects of other rows, and those that running transactions hold.
    """
    known = erased_objects(lake)
    stored = {stored.name for stored in lake.objects} if known else set()
    return {name: known[name] for name in sorted((known.keys() & stored) - set(needed))}


def erased_as(lake: Store, artifact: str) -> str | None:
    """The id of an artifact that was erased, by an id, its beginning, or the name that it had; `None` where there is
    none, or more than one."""
    for entry in lake.catalog.history():
        if gone := noted_erased(entry):
            rows = lake.catalog.rows(entry["version"] - 1).select(naming.COLUMNS)
            named = naming.meant(rows.filter(pc.field("artifact").isin(sorted(gone))).to_pylist(), artifact)
            found = {row["artifact"] for row in named} or {one for one in gone if one.startswith(artifact)}
            if found:
                return found.pop() if len(found) == 1 else None
    return None


def _all(
    shown: dict[str, pa.Table],
    asked: frozenset[str],
    *,
    erased: Collection[str],
    with_descendants: bool,
    where: str,
) -> frozenset[str]:
    """What goes: what was asked for, its clips and, if wanted, its descendants, wherever a ref shows them.

    Args:
        erased: those that were erased before, which no ref need show.

    Raises:
        NotFoundError: no ref shows one of them.
        ConflictError: on a branch, something made from them would stay.
    """
    going = set(asked)
    for table in shown.values():
        going |= clips_of(table, asked)
        if with_descendants:
            going |= descendants(table, asked)
    known = {artifact for table in shown.values() for artifact in table["artifact"].to_pylist()}
    if foreign := sorted(asked - known - set(erased)):
        raise NotFoundError(f"no ref shows {', '.join(foreign)}", where=where, fix="flagdata ls --at REF lists ids")
    for ref, table in shown.items():
        present = going.intersection(table["artifact"].to_pylist())
        check_leaving(table, present, branch=ref, where=where)
    return frozenset(going)


def _off(lake: Store, erased: Mapping[str, str | None], message: str, *, branch: str) -> int:
    head = lake.catalog.head()
    leaving = erased.keys() & set(lake.table(lake.refs.view(branch, head))["artifact"].to_pylist())
    noted = json.dumps(dict(erased), sort_keys=True)
    info = {"message": message, "branch": branch, "withdrawn": str(len(leaving)), "erased": noted}
    return take_off(lake, leaving, branch=branch, base=head, info=info)


def _delete(lake: Store, names: Collection[str], check: Check) -> tuple[tuple[str, ...], dict[str, str]]:
    """Delete the objects that nothing else needs; the lock that keeps transactions out is held, and checked.

    Raises:
        ConflictError: the lock may have been lost.
        CorruptError: a ref cannot be read, so what is needed is unknown; the rows are withdrawn.
        FlagdataError: the disk refuses to delete some; the others are gone.
    """
    marked = mark(lake, grace=timedelta(0))
    damage = [finding for finding in marked.findings if finding.severity is Severity.ERROR]
    if damage:
        raise CorruptError(
            f"which objects are needed is unknown, so none was deleted: {damage[0].what}",
            where=damage[0].where,
            fix="mend what flagdata doctor reports, and run the command again",
        )
    held = {name for state in leases(lake.staging) if state.alive for name in state.objects}
    kept = dict.fromkeys(sorted(set(names) & marked.objects), "another artifact has the same content")
    kept |= dict.fromkeys(sorted(set(names) & held - marked.objects), "a running transaction holds it")
    gone = sorted({stored.name for stored in lake.objects}.intersection(names) - kept.keys())
    refused: dict[str, OSError] = {}
    for name in gone:
        check()
        try:
            lake.objects.delete(name)
        except OSError as error:
            refused[name] = error
    if refused:
        name, error = next(iter(refused.items()))
        raise FlagdataError(
            f"the artifacts are erased from all refs, but the data of {len(refused)} of {len(gone)} objects are still "
            f"there, {name} among them: {error.strerror}",
            where=str(lake.objects.path(name)),
            fix="let its folder and what is in it be written, and run the same command again, or flagdata gc",
        )
    return tuple(gone), kept
