"""Erasing artifacts everywhere: off every branch, their bytes deleted at once, also where a tag or an old version shows
them.

Rows of tags and of older versions stay, so that it stays known what they held; a commit notes what was erased and why.
Objects that other rows need stay. What a lake cannot reach is named: exports, clones, caches.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import timedelta

import pyarrow as pa

from flagdata.errors import CorruptError, NotFoundError
from flagdata.findings import Severity
from flagdata.lake.catalog import persist
from flagdata.lake.durable import disk_errors
from flagdata.lake.leases import Check, collecting, leases
from flagdata.lake.marking import mark
from flagdata.lake.refs import MAIN
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
    with disk_errors("erasing", lake.path), collecting(lake.staging) as check:
        shown = {ref: lake.rows(at=ref) for ref in (MAIN, *lake.refs.branches(), *lake.refs.tags())}
        going = _all(shown, frozenset(artifacts), with_descendants=with_descendants, where=str(lake.path))
        erased = {
            row["artifact"]: row["object"]
            for table in shown.values()
            for row in table.select(["artifact", "object"]).to_pylist()
            if row["artifact"] in going
        }
        concerned = [ref for ref, table in shown.items() if going.intersection(table["artifact"].to_pylist())]
        tags = frozenset(lake.refs.tags())
        branches = [ref for ref in concerned if ref not in tags]
        version = 0
        for branch in branches or [MAIN]:
            version = persist(lambda b=branch: _off(lake, erased, message, branch=b), where=lake.catalog.path)
        removed, kept = _delete(lake, {name for name in erased.values() if name is not None}, check)
    return Erasure(
        version=version, artifacts=tuple(sorted(erased)), branches=tuple(branches),
        tags=tuple(ref for ref in concerned if ref in tags), objects=removed, kept=kept,
    )  # fmt: skip


def _all(shown: dict[str, pa.Table], asked: frozenset[str], *, with_descendants: bool, where: str) -> frozenset[str]:
    """What goes: what was asked for, its clips and, if wanted, its descendants, wherever a ref shows them.

    Raises:
        NotFoundError: no ref shows one of them.
        ConflictError: on a branch, something made from them would stay.
    """
    erased = set(asked)
    for table in shown.values():
        erased |= clips_of(table, asked)
        if with_descendants:
            erased |= descendants(table, asked)
    known = {artifact for table in shown.values() for artifact in table["artifact"].to_pylist()}
    if foreign := sorted(asked - known):
        raise NotFoundError(f"no ref shows {', '.join(foreign)}", where=where, fix="flagdata ls --at REF lists ids")
    for ref, table in shown.items():
        present = erased.intersection(table["artifact"].to_pylist())
        check_leaving(table, present, branch=ref, where=where)
    return frozenset(erased)


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
    """
    marked = mark(lake, grace=timedelta(0))
    damage = [finding for finding in marked.findings if finding.severity is Severity.ERROR]
    if damage:
        raise CorruptError(
            f"which objects are needed is unknown, so none was deleted: {damage[0].what}", where=damage[0].where,
            fix="mend what flagdata doctor reports, and run the command again",
        )  # fmt: skip
    held = {name for state in leases(lake.staging) if state.alive for name in state.objects}
    kept = dict.fromkeys(sorted(set(names) & marked.objects), "another artifact has the same content")
    kept |= dict.fromkeys(sorted(set(names) & held - marked.objects), "a running transaction holds it")
    gone = sorted(set(names) - kept.keys())
    for name in gone:
        check()
        lake.objects.remove(lake.objects.path(name))
    return tuple(gone), kept
