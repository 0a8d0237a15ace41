"""The three-way merge: what a branch changed since it and the other last had the same, and nothing
else.

A row that both had and that the other has withdrawn since stays withdrawn; a row that both had and
that the branch has withdrawn is withdrawn. So it is where no merge is recorded (lakes of older
versions of flagdata, or the same source ingested on both): a withdrawal that is later than the
branch's own row stands. What is made anew on the branch after the other withdrew it comes back, and
is named. Labels are merged by `flagdata.lake.label_merging`. `difference` says what changed between
any two refs.
"""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import pyarrow as pa

from flagdata.core.provenance import code_version
from flagdata.core.schema import catalog_schema
from flagdata.core.shell import command_line
from flagdata.errors import ConflictError, NotFoundError, UsageError
from flagdata.lake.attempts import persist
from flagdata.lake.commits import Change, commit, labels_after
from flagdata.lake.label_merging import amended_labels, merge_labels
from flagdata.lake.lineage import removals
from flagdata.lake.matching import made_from, matching
from flagdata.lake.refs import Slice
from flagdata.lake.removal import left
from flagdata.lake.store import Store

_COLUMNS = ["artifact", "kind", "name", "parents"]


@dataclass(frozen=True, kw_only=True)
class MergeResult:
    """What a merge did; ids are sorted.

    Attributes:
        version: of the table after it; the head it found when the branch had nothing new.
        commit: commit id, `None` when the branch had nothing new.
        added: ids of rows that it brought.
        existing: ids of new rows of the branch that were there already.
        withdrawn: ids of rows that it took off, since the branch had withdrawn them.
        left_out: id of a row of the branch that stays withdrawn → the version that withdrew it.
        brought_back: id of a row that it brought, though it had been withdrawn → the version that
            withdrew it.
    """

    version: int
    commit: str | None
    added: tuple[str, ...] = ()
    existing: tuple[str, ...] = ()
    withdrawn: tuple[str, ...] = ()
    left_out: dict[str, int]
    brought_back: dict[str, int]


def merge(lake: Store, branch: str, message: str, *, into: str) -> MergeResult:
    """Merges a branch, see `Lake.merge`."""
    if not message.strip():
        raise UsageError("the commit has no message", fix="say in a few words what it brings in")
    lake.check_writable()
    if branch == into:
        raise UsageError(f"{branch!r} cannot be merged into itself", fix="name two branches")
    with lake.changing("merging"):
        return persist(
            lambda: _attempt(lake, branch, message, into),
            looks=lake.catalog.looks,
            where=lake.catalog.path,
        )


def _attempt(lake: Store, branch: str, message: str, into: str) -> MergeResult:
    head = lake.catalog.head()
    views = {name: lake.refs.view(name, head) for name in (into, branch)}
    mine, theirs_rows = (lake.columns(views[name], _COLUMNS) for name in (into, branch))
    ours, theirs = Slice(branch=into, version=head), Slice(branch=branch, version=head)
    lineage = lake.lineage()
    if lineage.knows(ours, theirs):
        return MergeResult(version=head, commit=None, left_out={}, brought_back={})
    base = lineage.merge_base(ours, theirs)
    before = lake.identities(lineage.view(base)) if base is not None else frozenset()
    ids_here, ids_there = _ids(mine), _ids(theirs_rows)
    new = ids_there - before
    left_out, brought_back = _decide_withdrawals(
        lake, ours, theirs, new - ids_here, since=-1 if base is None else base.version
    )
    added, withdrawn = new - ids_here - left_out.keys(), (before - ids_there) & ids_here
    fresh = lake.matching(views[branch], {"artifact": sorted(added)})
    _check_objects(lake, fresh)
    _check_parents(mine, theirs_rows, added=added, withdrawn=withdrawn, branch=branch, into=into)

    commit_id = f"c{secrets.token_hex(8)}"
    notes = {
        "commit": commit_id,
        "rows": str(len(added)),
        "merged": branch,
        "merged_version": str(head),
        "code_version": code_version(),
    }
    here = ids_here - withdrawn
    labels = merge_labels(lake, ours, theirs, base, here=here, there=ids_there)
    change = Change(
        message=message,
        branch=into,
        fresh=_published_rows(fresh, into),
        held=fresh["object"].drop_null().to_pylist(),
        leaving={into: withdrawn} if withdrawn else {},
        labels=amended_labels(
            labels_after(lake, into, {**notes, "branch": into}, head), labels, here | added
        ),
        notes=notes,
    )
    version = commit(lake, change, base=head)
    return MergeResult(
        version=version,
        commit=commit_id,
        added=tuple(sorted(added)),
        existing=tuple(sorted(new & ids_here)),
        withdrawn=tuple(sorted(withdrawn)),
        left_out=left_out,
        brought_back={
            artifact: version for artifact, version in brought_back.items() if artifact in added
        },
    )


def _ids(table: pa.Table) -> frozenset[str]:
    return frozenset(table["artifact"].to_pylist())


def _published_rows(rows: pa.Table, branch: str) -> pa.Table:
    """Rows as committed on a branch now."""
    changed = {"branch": branch, "created": datetime.now(UTC)}
    for name, value in changed.items():
        field = catalog_schema().field(name)
        column = pa.array([value] * rows.num_rows, type=field.type)
        rows = rows.set_column(rows.schema.get_field_index(name), field, column)
    return rows


def _decide_withdrawals(
    lake: Store, ours: Slice, theirs: Slice, candidates: frozenset[str], *, since: int
) -> tuple[dict[str, int], dict[str, int]]:
    """Decides on new rows of the branch that ours withdrew after `since`: those that stay
    withdrawn, since the branch had them when that was done, and those that are newer. Each with the
    version that withdrew it last."""
    lineage = lake.lineage()
    left_out: dict[str, int] = {}
    brought_back: dict[str, int] = {}
    first = max(since, lineage.life(ours)[1])
    for removal in reversed(removals(lake.catalog.history())):
        if not (
            candidates
            and removal.withdrawn
            and removal.version > first
            and ours.branch in removal.branches
        ):
            continue
        if removed := (left(lake, removal).keys() | removal.hidden(ours.branch)) & candidates:
            then = Slice(
                branch=theirs.branch, version=max(removal.version, lineage.life(theirs)[1])
            )
            had = removed & lake.identities(lineage.view(then))
            for artifact in removed:
                left_out.pop(artifact, None)
                brought_back.pop(artifact, None)
            left_out |= dict.fromkeys(had, removal.version)
            brought_back |= dict.fromkeys(removed - had, removal.version)
    return left_out, brought_back


def _check_objects(lake: Store, rows: pa.Table) -> None:
    for name in sorted(set(rows["object"].drop_null().to_pylist())):
        if not lake.objects.has(name):
            raise lake.objects.missing(name)


def _check_parents(
    mine: pa.Table,
    branch_rows: pa.Table,
    *,
    added: frozenset[str],
    withdrawn: frozenset[str],
    branch: str,
    into: str,
) -> None:
    """Checks whether each row finds what it was made from.

    Raises:
        ConflictError: one would lack a parent that was withdrawn on the other side.
        NotFoundError: one lacks a parent on its own branch already.
    """
    after = (_ids(mine) - withdrawn) | added
    ids_on_branch = _ids(branch_rows)
    for row in matching(branch_rows, {"artifact": list(added)}).to_pylist():
        for parent in row["parents"]:
            if parent not in after:
                message = (
                    f"{row['kind']} {row['name']!r} ({row['artifact']}) was made from {parent}"
                )
                if parent not in ids_on_branch:
                    raise NotFoundError(
                        f"{message}, a parent that is not there",
                        where=f"branch {branch}",
                        fix="run flagdata doctor",
                    )
                raise ConflictError(
                    f"{message}, which was withdrawn from {into!r}",
                    where=f"branch {branch}",
                    fix=_ways_to_agree(parent, gone=into, branch=branch),
                )
    for row in made_from(mine, withdrawn).to_pylist():
        for parent in row["parents"]:
            if parent in withdrawn and row["artifact"] in after:
                raise ConflictError(
                    f"{row['kind']} {row['name']!r} ({row['artifact']}) was made from {parent}, "
                    "which was withdrawn"
                    f" from {branch!r}",
                    where=f"branch {into}",
                    fix=_ways_to_agree(parent, gone=branch, branch=into),
                )


def _ways_to_agree(parent: str, *, gone: str, branch: str) -> str:
    """Explains how two branches agree again on an artifact that one withdrew and the other made
    something from."""
    return (
        command_line(
            "flagdata",
            "withdraw",
            parent,
            "--with-descendants",
            "--branch",
            branch,
            "-m",
            f"as on {gone}",
        )
        + f", or ingest its source again with {command_line('--branch', gone)}"
    )


@dataclass(frozen=True, kw_only=True)
class Difference:
    """From one ref to another.

    Attributes:
        added, removed: rows of the catalog, whole.
        objects_added, objects_removed: names, sorted; an object that several rows share counts when
            the last one goes.
    """

    added: pa.Table
    removed: pa.Table
    objects_added: tuple[str, ...]
    objects_removed: tuple[str, ...]


def difference(lake: Store, before: str | None, after: str | None) -> Difference:
    """Finds what `after` shows that `before` does not, and the other way round; rows are compared
    by identity.

    Raises:
        NotFoundError: no such ref.
    """
    old, new = lake.rows(at=before), lake.rows(at=after)
    old_objects, new_objects = _objects(old), _objects(new)
    return Difference(
        added=_without(new, old),
        removed=_without(old, new),
        objects_added=tuple(sorted(new_objects - old_objects)),
        objects_removed=tuple(sorted(old_objects - new_objects)),
    )


def added_since(lake: Store, branch: str) -> Callable[[], str]:
    """Returns a call that says what a branch has gained since, in words, such as "on branch main:
    camera 2, recording 1"; "" if nothing. For `flagdata.core.console.in_steps`.

    Raises:
        NotFoundError: no such branch.
    """
    before = lake.rows(at=branch, columns=["artifact", "kind"])

    def words() -> str:
        added = Counter(
            _without(lake.rows(at=branch, columns=["artifact", "kind"]), before)["kind"].to_pylist()
        )
        kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(added.items()))
        return f"on branch {branch}: {kinds}" if kinds else ""

    return words


def _without(table: pa.Table, other_table: pa.Table) -> pa.Table:
    identities = set(other_table["artifact"].to_pylist())
    return table.filter(
        pa.array(
            [identity not in identities for identity in table["artifact"].to_pylist()],
            type=pa.bool_(),
        )
    )


def _objects(table: pa.Table) -> set[str]:
    return set(table["object"].drop_null().to_pylist())
