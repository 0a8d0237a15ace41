"""The one commit: rows come and go, labels are put, tags and branches are made and deleted,
versions expire.

Whatever changes a lake states a `Change`, and `commit` publishes it: it works out what each branch
concerned shows afterwards, refuses what would not hold together, and writes the whole intent into
one entry of the log. What then remains to be done (bytes to delete) is read from there, see
`flagdata.lake.removal.find_unfinished`, so that a process which is killed leaves nothing half done
that nobody knows of.

What is checked of the branch after the commit:

- no identity is there twice, and each row finds what it was made from;
- each new row finds its object;
- labels are columns: no two names differ by capitals only, and no name has values of two types.
  What was so before, in a lake of an earlier version, is not refused.

The refs of an earlier version that only files state are entered into the log along with any commit.
"""

from __future__ import annotations

import json
import time
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import or_
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.schema import catalog_schema
from flagdata.errors import ConflictError, NotFoundError
from flagdata.lake.label_columns import Labels, check_labels
from flagdata.lake.lineage import HIDDEN_ON, LABELS, Lineage
from flagdata.lake.matching import made_from
from flagdata.lake.refs import DELETED, NOUNS, Key, Ref, Slice, note_made
from flagdata.lake.store import Store

_PARENTAGE = ["artifact", "kind", "name", "parents"]


@dataclass(frozen=True, kw_only=True)
class Change:
    """What one commit does to a lake.

    Attributes:
        message: why, in the user's words.
        branch: on which rows come and labels are put; `None` where none do.
        fresh: rows that come.
        held: names of objects that are known to be there, and stay.
        leaving: branch → ids of rows that it does not show any more.
        labels: artifact → name → value, `None` where it takes one off.
        made: refs, by kind and name.
        deleted: kind and name of a ref.
        notes: what else the entry states, by name.
    """

    message: str
    branch: str | None = None
    fresh: pa.Table = field(default_factory=lambda: catalog_schema().empty_table())
    held: Collection[str] = ()
    leaving: Mapping[str, Collection[str]] = field(default_factory=dict)
    labels: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    made: Mapping[Key, Ref] = field(default_factory=dict)
    deleted: Key | None = None
    notes: Mapping[str, str] = field(default_factory=dict)


def commit(lake: Store, change: Change, *, base: int) -> int:
    """Publishes a change as version `base + 1`, and returns that; see `Catalog.append` for how
    durable it is.

    Raises:
        Moved: `base` is no longer the newest version; nothing was published.
        ConflictError: what a branch would show does not hold together.
        NotFoundError: a new row would lack its object, or what it was made from.
    """
    stored = {
        branch: _rows_of_branch(lake, branch, ids, base) for branch, ids in change.leaving.items()
    }
    noted = _notes(lake, change, stored, base)
    for branch in _concerned_branches(change):
        _check_rows(lake, change, branch, base)
    if change.branch is not None:
        before, after = _labels_around(lake, change.branch, change, noted, base)
        check_labels(before, after, homes=_homes(lake, change, before, base))
    going = [
        (pc.field("branch") == branch)
        & pc.field("artifact").isin(pa.array(sorted(ids), pa.string()))
        for branch, ids in stored.items()
        if ids
    ]
    if not going:
        return lake.catalog.append(change.fresh, base=base, info=noted)
    return lake.catalog.drop(reduce(or_, going), fresh=change.fresh, base=base, info=noted)


def labels_after(
    lake: Store, branch: str, noted: Mapping[str, str], base: int
) -> dict[str, dict[str, Any]]:
    """Works out the labels of a branch after a commit with some notes, by artifact, with those that
    it does not show.

    Raises:
        CorruptError: what a commit notes cannot be read.
    """
    entry = {**noted, "version": base + 1, "timestamp": time.time_ns() // 1_000_000}
    forks = {name: ref.view for name, ref in lake.refs.branches().items()}
    return Lineage([entry, *lake.catalog.history()], forks).labels(
        Slice(branch=branch, version=base + 1)
    )


def _rows_of_branch(lake: Store, branch: str, ids: Collection[str], base: int) -> frozenset[str]:
    """Selects the rows that a branch has itself; the others are of its base, which goes on to have
    them."""
    return (
        lake.identities((Slice(branch=branch, version=base),)).intersection(ids)
        if ids
        else frozenset()
    )


def _notes(
    lake: Store, change: Change, stored: Mapping[str, frozenset[str]], base: int
) -> dict[str, str]:
    """Writes what the entry states."""
    noted = {"message": change.message, **change.notes}
    hidden = {branch: sorted(set(ids) - stored[branch]) for branch, ids in change.leaving.items()}
    first, *further = [*hidden] or [change.branch]
    if first is not None:
        noted["branch"] = first
    if change.leaving:
        noted["withdrawn"] = str(
            len({artifact for ids in change.leaving.values() for artifact in ids})
        )
    if first is not None and hidden.get(first):
        noted["hidden"] = json.dumps(hidden[first])
    if further:
        noted[HIDDEN_ON] = json.dumps(
            {branch: hidden[branch] for branch in further if branch is not None}
        )
    if change.labels:
        noted[LABELS] = json.dumps(
            {artifact: dict(labels) for artifact, labels in change.labels.items()},
            ensure_ascii=False,
            allow_nan=False,
        )
    if change.deleted is not None:
        kind, name = change.deleted
        noted[DELETED] = f"{NOUNS[kind]} {name}"
    older = {key: ref for key, ref in lake.refs.enterable(base).items() if key != change.deleted}
    return noted | note_made({**older, **change.made})


def _concerned_branches(change: Change) -> Iterable[str]:
    """Lists the branches that show other rows afterwards, without one that is deleted."""
    branches = {
        *change.leaving,
        *([change.branch] if change.branch and change.fresh.num_rows else []),
    }
    return sorted(branch for branch in branches if change.deleted != ("branches", branch))


def _check_rows(lake: Store, change: Change, branch: str, base: int) -> None:
    """Checks whether the rows that a branch shows afterwards hold together.

    Raises:
        ConflictError, NotFoundError: they do not.
    """
    leaving = frozenset(change.leaving.get(branch, ()))
    begun = change.made.get(("branches", branch))
    view = (
        lake.refs.view(branch, base)
        if begun is None
        else (Slice(branch=branch, version=base), *begun.view)
    )
    staying = lake.identities(view) - leaving
    fresh = change.fresh.to_pylist() if branch == change.branch else []
    after = staying | {row["artifact"] for row in fresh}
    if len(after) < len(staying) + len(fresh):
        raise ConflictError(
            "an artifact would be there twice",
            where=f"branch {branch}",
            fix="give the command again: it is there",
        )
    if leaving:
        made = made_from(lake.columns(view, _PARENTAGE), leaving).to_pylist()
        _check_parents([row for row in made if row["artifact"] in staying], after, branch)
    _check_parents(fresh, after, branch)
    for name in sorted(
        {row["object"] for row in fresh if row["object"] is not None}.difference(change.held)
    ):
        if not lake.objects.has(name):
            raise lake.objects.missing(name)


def _check_parents(rows: Iterable[Mapping[str, Any]], after: Collection[str], branch: str) -> None:
    for row in rows:
        for parent in row["parents"] or ():
            if parent not in after:
                raise NotFoundError(
                    f"{row['kind']} {row['name']!r} was made from {parent}, which would not be "
                    "there",
                    where=f"artifact {row['artifact']}, branch {branch}",
                    fix="add the parent too, or withdraw what was made from it along with it",
                )


def _homes(lake: Store, change: Change, before: Labels, base: int) -> dict[str, Labels]:
    """Maps the branches on which labels may be changed before the commit is tried again to the
    labels there."""
    branch = str(change.branch)
    if (merged := change.notes.get("merged")) is None:
        return {branch: before}
    return {merged: lake.lineage().labels(Slice(branch=merged, version=base)), branch: before}


def _labels_around(
    lake: Store, branch: str, change: Change, noted: Mapping[str, str], base: int
) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
    """Works out the labels of the artifacts that a branch shows before and after a commit; nothing
    where it changes none."""
    lineage = lake.lineage()
    before = lineage.labels(Slice(branch=branch, version=base))
    if not (LABELS in noted or "merged" in noted or (before and change.fresh.num_rows)):
        return {}, {}
    shown = lake.identities(lake.refs.view(branch, base))
    after = (shown - frozenset(change.leaving.get(branch, ()))) | set(
        change.fresh["artifact"].to_pylist()
    )
    return (
        {artifact: labels for artifact, labels in before.items() if artifact in shown},
        {
            artifact: labels
            for artifact, labels in labels_after(lake, branch, noted, base).items()
            if artifact in after
        },
    )
