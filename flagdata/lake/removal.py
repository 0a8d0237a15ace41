"""Rows go, for a reason: withdrawn from a branch, erased everywhere, with versions that expire, or
with a branch or tag that is deleted, see `flagdata.lake.ref_commits`. All go by one commit, see
`flagdata.lake.commits`, whose notes say which rows and why.

*Withdrawn*: the branch's rows leave the table; rows of its base, which its parent goes on to show,
are hidden by a note, see `flagdata.lake.lineage`. `gc` deletes their data after the grace period.

*Erased*: off every branch by one commit, the bytes deleted at once, also where a tag or an old
version shows them. Their rows stay in tags and older versions, which say what was erased and why.
Objects that other rows need stay. What a
lake cannot reach is named: exports, clones, caches. The commit comes first: a process that is
killed before it has deleted the bytes, or a disk that refuses, leaves an erasure that the log
knows, see `find_unfinished`. The same command finishes it, and so does `gc`.

*Expired*: the oldest versions give up the data that only they show, at once. Their rows stay
readable, and what a branch or a tag shows does not change. What a process that is killed has not
deleted, `gc` does.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.files.durable import disk_errors
from flagdata.core.schema import Kind
from flagdata.core.shell import command_line
from flagdata.errors import ConflictError, FlagdataError, NotFoundError
from flagdata.lake import naming
from flagdata.lake.attempts import persist
from flagdata.lake.commits import Change, commit
from flagdata.lake.lake_locks import Check
from flagdata.lake.leases import leases, looking
from flagdata.lake.lineage import Removal, removals
from flagdata.lake.marking import catalog_files, mark
from flagdata.lake.matching import made_from, matching
from flagdata.lake.refs import MAIN
from flagdata.lake.store import Store

BEYOND = (
    "exports that were made of them",
    "clones and copies of this lake",
    "caches outside it, and backups",
    "older versions of its objects, where it lies in a bucket that keeps them",
    "the files that were ingested",
)
"""What holds the bytes of what is erased where this lake does not reach."""
_GRACE = timedelta(days=1)
"""How long what was withdrawn is needed, as far as an erasure before it is concerned."""
CLIP_COLUMNS = ["artifact", "branch", "kind", "name", "object", "parents"]
"""Columns that `clips_of` reads."""
_RESTORE = "the version of flagdata that ingested the source restores it by ingesting it again"
_LEAVE_OUT = "leave its artifact out by --where; no version has its data any more"


@dataclass(frozen=True, kw_only=True)
class Withdrawal:
    """What a withdrawal did.

    Attributes:
        version: of the table after it.
        asked: ids that were named, sorted.
        clips: ids of the clips of these that went along, sorted.
    """

    version: int
    asked: tuple[str, ...]
    clips: tuple[str, ...]


def withdraw(lake: Store, artifacts: Collection[str], message: str, *, branch: str) -> Withdrawal:
    """Withdraws artifacts, see `Lake.withdraw`."""
    asked = frozenset(artifacts)

    def attempt() -> Withdrawal:
        head = lake.catalog.head()
        rows = lake.columns(lake.refs.view(branch, head), CLIP_COLUMNS)
        clips = clips_of(rows, asked)
        leaving = asked | clips
        check_leaving(rows, leaving, branch=branch, where=str(lake.path))
        version = commit(lake, Change(message=message, leaving={branch: leaving}), base=head)
        return Withdrawal(version=version, asked=tuple(sorted(asked)), clips=tuple(sorted(clips)))

    with lake.changing("withdrawing"):
        return persist(attempt, looks=lake.catalog.looks, where=lake.catalog.path)


def clips_of(rows: pa.Table, artifacts: Collection[str]) -> frozenset[str]:
    """Ids of the clips that are slices of the objects of `artifacts` themselves, so that they mean
    nothing without."""
    parents = matching(rows, {"artifact": list(artifacts)}).select(CLIP_COLUMNS).to_pylist()
    objects = {row["artifact"]: row["object"] for row in parents}
    clips = matching(made_from(rows, objects), {"kind": Kind.CLIP}).select(CLIP_COLUMNS).to_pylist()
    return frozenset(
        row["artifact"]
        for row in clips
        if row["object"] is not None
        and any(objects.get(parent) == row["object"] for parent in row["parents"])
    ) - frozenset(artifacts)


def descendants(rows: pa.Table, artifacts: Collection[str]) -> frozenset[str]:
    """Ids of all rows that were made from `artifacts`, or from what was made from them; without
    `artifacts`."""
    reached, newest = set(artifacts), set(artifacts)
    while newest:
        newest = set(made_from(rows, newest)["artifact"].to_pylist()) - reached
        reached |= newest
    return frozenset(reached - set(artifacts))


def check_leaving(rows: pa.Table, leaving: Collection[str], *, branch: str, where: str) -> None:
    """Checks whether the rows `leaving` can go.

    Raises:
        NotFoundError: one that the branch does not show.
        ConflictError: a row that stays on the branch was made from one of them.
    """
    present = matching(rows, {"artifact": list(leaving)})["artifact"].to_pylist()
    if foreign := set(leaving) - set(present):
        raise NotFoundError(
            f"{', '.join(sorted(foreign))} is not on branch {branch!r}",
            where=where,
            fix=f"give ids of rows that {command_line('flagdata', 'ls', '--at', branch)} shows",
        )
    made_from_leaving = made_from(rows, leaving).select(CLIP_COLUMNS).to_pylist()
    staying = [row for row in made_from_leaving if row["artifact"] not in leaving]
    if staying:
        first = f"{staying[0]['kind']} {staying[0]['name']!r} ({staying[0]['artifact']})"
        further = f", and {len(staying) - 1} more," if len(staying) > 1 else ""
        raise ConflictError(
            f"{first}{further} would stay, made from what would be withdrawn",
            where=where,
            fix="withdraw all that was made from it too: flagdata withdraw --with-descendants",
        )


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


def erase(
    lake: Store, artifacts: Collection[str], message: str, *, with_descendants: bool
) -> Erasure:
    """Erases artifacts, see `Lake.erase`."""
    asked = frozenset(artifacts)
    with lake.changing("erasing", alone=True) as check:
        tags = lake.refs.tags()
        rows_of_refs = {ref: lake.rows(at=ref) for ref in (MAIN, *lake.refs.branches(), *tags)}
        version, before = _erased_with(lake, asked)
        going = _all(
            rows_of_refs,
            asked,
            erased=before,
            with_descendants=with_descendants,
            where=str(lake.path),
        )
        erased = {artifact: name for artifact, name in before.items() if artifact in going} | {
            row["artifact"]: row["object"]
            for table in rows_of_refs.values()
            for row in table.select(["artifact", "object"]).to_pylist()
            if row["artifact"] in going
        }
        concerned = [
            ref
            for ref, table in rows_of_refs.items()
            if going.intersection(table["artifact"].to_pylist())
        ]
        branches = [ref for ref in concerned if ref not in tags]

        def attempt() -> int:
            head = lake.catalog.head()
            leaving = {
                branch: erased.keys() & lake.identities(lake.refs.view(branch, head))
                for branch in branches
            }
            notes = {"erased": json.dumps(erased, sort_keys=True)}
            return commit(
                lake, Change(message=message, leaving=leaving or {MAIN: ()}, notes=notes), base=head
            )

        if branches or not going <= before.keys():
            version = persist(attempt, looks=lake.catalog.looks, where=lake.catalog.path)
        objects = {name for name in (*erased.values(), *before.values()) if name is not None}
        removed, kept_objects = _delete(lake, objects, check)
    return Erasure(
        version=version,
        artifacts=tuple(sorted(erased)),
        branches=tuple(branches),
        tags=tuple(ref for ref in concerned if ref in tags),
        objects=removed,
        kept=kept_objects,
    )


def _erased_with(lake: Store, asked: frozenset[str]) -> tuple[int, dict[str, str | None]]:
    """Returns the newest version that erased some artifacts before, 0 where there is none, and what
    these versions erased, artifact by object, that nothing which was committed since needs."""
    earlier = [
        removal for removal in removals(lake.catalog.history()) if asked & removal.erased.keys()
    ]
    if not earlier:
        return 0, {}
    needed = mark(lake, grace=_GRACE).objects
    erased = (item for removal in earlier for item in removal.erased.items())
    return earlier[0].version, {artifact: name for artifact, name in erased if name not in needed}


def erased_objects(lake: Store) -> dict[str, tuple[int, str]]:
    """Returns, for each object of which an artifact was erased from all refs, the newest version
    that did so and why."""
    return {
        name: (removal.version, removal.reason)
        for removal in reversed(removals(lake.catalog.history()))
        for name in removal.erased.values()
        if name is not None
    }


@dataclass(frozen=True, kw_only=True)
class Unfinished:
    """An object that a commit gave up, and that is stored all the same: the process was killed, or
    the disk refused.

    Attributes:
        name: of the object.
        kind: "erasure" or "expiry".
        version: of the commit.
        reason: its message.
    """

    name: str
    kind: str
    version: int
    reason: str


def find_unfinished(lake: Store, needed: Collection[str]) -> list[Unfinished]:
    """Finds what commits left to be done: objects that are stored though all artifacts of them were
    erased, or though they went with versions that expired; by name. Nothing else asks the log for
    that.

    Args:
        needed: objects of other rows, and those that running transactions hold.
    """
    given_up: dict[str, Unfinished] = {}
    for removal in reversed(removals(lake.catalog.history())):
        facts = {"version": removal.version, "reason": removal.reason}
        for name in removal.expired[1]:
            given_up[name] = Unfinished(name=name, kind="expiry", **facts)
        for name in removal.erased.values():
            if name is not None:
                given_up[name] = Unfinished(name=name, kind="erasure", **facts)
    stored = {stored.name for stored in lake.objects} if given_up else set()
    return [given_up[name] for name in sorted((given_up.keys() & stored) - set(needed))]


def erased_as(lake: Store, artifact: str) -> str | None:
    """Finds the id of an artifact that was erased, by an id, its beginning, or the name that it
    had; `None` where there is none, or more than one."""
    for removal in removals(lake.catalog.history()):
        if gone := removal.erased:
            rows = lake.catalog.rows(removal.version - 1).select(naming.COLUMNS)
            matches = naming.meant(
                rows.filter(pc.field("artifact").isin(sorted(gone))).to_pylist(), artifact
            )
            identities = {row["artifact"] for row in matches} or {
                identity for identity in gone if identity.startswith(artifact)
            }
            if identities:
                return identities.pop() if len(identities) == 1 else None
    return None


def _all(
    rows_of_refs: dict[str, pa.Table],
    asked: frozenset[str],
    *,
    erased: Collection[str],
    with_descendants: bool,
    where: str,
) -> frozenset[str]:
    """Lists what goes: what was asked for, its clips and, if wanted, its descendants, wherever a
    ref shows them.

    Args:
        erased: those that were erased before, which no ref need show.

    Raises:
        NotFoundError: no ref shows one of them.
        ConflictError: on a branch, something made from them would stay.
    """
    going = set(asked)
    for table in rows_of_refs.values():
        going |= clips_of(table, asked)
        if with_descendants:
            going |= descendants(table, asked)
    identities = {
        artifact for table in rows_of_refs.values() for artifact in table["artifact"].to_pylist()
    }
    if foreign := sorted(asked - identities - set(erased)):
        raise NotFoundError(
            f"no ref shows {', '.join(foreign)}", where=where, fix="flagdata ls --at REF lists ids"
        )
    for ref, table in rows_of_refs.items():
        present = going.intersection(table["artifact"].to_pylist())
        check_leaving(table, present, branch=ref, where=where)
    return frozenset(going)


def _delete(
    lake: Store, names: Collection[str], check: Check
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Deletes the objects that nothing else needs; the lock that keeps transactions out is held,
    and checked.

    Raises:
        ConflictError: the lock may have been lost.
        CorruptError: a ref cannot be read, so what is needed is unknown; the rows are withdrawn.
        FlagdataError: the disk refuses to delete some; the others are gone.
    """
    marked = mark(lake, grace=timedelta(0))
    marked.check(
        outcome=", so none was deleted",
        fix="mend what flagdata doctor reports, and run the command again",
    )
    in_use = _in_use(lake)
    reasons_kept = dict.fromkeys(
        sorted(set(names) & marked.objects), "another artifact has the same content"
    )
    reasons_kept |= dict.fromkeys(
        sorted(set(names) & in_use - marked.objects), "a running transaction holds it"
    )
    gone = sorted(
        {stored.name for stored in lake.objects}.intersection(names) - reasons_kept.keys()
    )
    refused = lake.objects.delete_all(gone, check)
    if refused:
        name, error = next(iter(refused.items()))
        raise FlagdataError(
            f"the artifacts are erased from all refs, but the data of {len(refused)} of "
            f"{len(gone)} objects are still "
            f"there, {name} among them: {error.strerror}",
            where=str(lake.objects.path(name)),
            fix="let its folder and what is in it be written, and run the same command again, or "
            "flagdata gc",
        )
    return tuple(gone), reasons_kept


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
    """Finds the newest version that expires: one that another replaced so long ago, and that is not
    among the newest `keep`; −1 where there is none. The head never expires."""
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
    """Let the versions up to `up_to` expire: note it, and delete what no other version, branch or
    tag shows.

    Args:
        up_to: before the head.
        message: why.
        dry_run: find out only.

    Raises:
        CorruptError: a ref cannot be read or the catalog is damaged, so what is needed is unknown;
            nothing was deleted.
    """
    if dry_run or up_to < 0:
        if not dry_run:
            lake.check_writable()
        with disk_errors("expiring versions", lake.path), looking(lake.staging):
            return _expiring(lake, up_to)
    with lake.changing("expiring versions", alone=True) as check:
        going = _expiring(lake, up_to)
        noted = json.dumps({"up_to": up_to, "objects": list(going.objects)})
        change = Change(
            message=message or f"expire versions up to {up_to}", notes={"expired": noted}
        )
        version = persist(
            lambda: commit(lake, change, base=lake.catalog.head()),
            looks=lake.catalog.looks,
            where=lake.catalog.path,
        )
        for error in lake.objects.delete_all(going.objects, check).values():
            raise error
    return replace(going, version=version)


def _expiring(lake: Store, up_to: int) -> Expiry:
    """Returns what goes with the versions up to one; transactions are kept out."""
    in_use = _in_use(lake)
    marked = mark(lake, grace=timedelta(0), first=up_to + 1)
    # Rows read from a changed file may name other objects than those they need, so files are
    # re-hashed first.
    marked.check(*catalog_files(lake))
    committed = lake.catalog.objects() - marked.objects - in_use
    going = [stored for stored in lake.objects if stored.name in committed]
    return Expiry(
        up_to=up_to,
        objects=tuple(sorted(stored.name for stored in going)),
        size=sum(stored.size for stored in going),
    )


def _in_use(lake: Store) -> set[str]:
    """Returns the names of the objects that running transactions hold."""
    return {name for state in leases(lake.staging) if state.alive for name in state.objects}


def left(lake: Store, removal: Removal) -> dict[str, str | None]:
    """Returns the rows that left the table by a removal, id by object; later versions do not show
    them, unless another branch does or they came again."""
    if not removal.withdrawn:
        return {}
    before, after = (
        _stored_rows(lake, version) for version in (removal.version - 1, removal.version)
    )
    gone = pc.invert(pc.is_in(_keys(before), value_set=_keys(after)))  # type: ignore[attr-defined]
    return {row["artifact"]: row["object"] for row in before.filter(gone).to_pylist()}


def _stored_rows(lake: Store, version: int) -> pa.Table:
    columns = ["artifact", "branch", "object"]
    rows = lake.catalog.scan(version)
    return lake.catalog.rows(version).select(columns) if rows is None else rows.table(columns)


def _keys(rows: pa.Table) -> pa.ChunkedArray:
    """Returns what distinguishes rows: artifact and branch."""
    return pc.binary_join_element_wise(  # type: ignore[attr-defined]
        rows["artifact"], rows["branch"], "/"
    )


def explain_missing(lake: Store, name: str, missing: NotFoundError) -> NotFoundError:
    """Returns why an object is missing: it was erased, it went with versions that expired, or it
    was collected after a version withdrew it; `missing` where no version did, or where the catalog
    cannot be asked."""
    reasons = (
        (
            "was erased from all versions by version {0.version} ({0.reason})",
            lambda r: name in r.erased.values(),
        ),
        (
            "went when versions up to {0.expired[0]} expired, by version {0.version} ({0.reason})",
            lambda r: name in r.expired[1],
        ),
        (
            "was withdrawn by version {0.version} ({0.reason}), and gc has deleted it",
            lambda r: name in left(lake, r).values(),
        ),
    )
    try:
        if name in mark(lake, grace=timedelta(0)).objects:
            return missing
        gone = removals(lake.catalog.history())
        for message, went in reasons:
            for removal in filter(went, gone):
                restored = f"use a tag, or a version from {removal.version} on; {_RESTORE}"
                return NotFoundError(
                    f"{name} is gone: it {message.format(removal)}",
                    where=missing.where,
                    fix=_LEAVE_OUT if name in removal.erased.values() else restored,
                )
    except FlagdataError:
        return missing
    return missing


def lost(lake: Store, rows: pa.Table) -> dict[str, NotFoundError]:
    """Maps each object of some of the rows that is not in the lake to why."""
    errors: dict[str, NotFoundError] = {}
    for name in sorted(rows["object"].drop_null().unique().to_pylist()):
        if not lake.objects.has(name):
            errors[name] = explain_missing(lake, name, lake.objects.missing(name))
    return errors
