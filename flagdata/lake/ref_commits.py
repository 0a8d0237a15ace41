"""Tags and branches are made and deleted, each by one commit that says what it shows.

A tag lists what was erased since the version that it names, without data, as every older tag does.
A branch hides it,
by the commit that begins the branch: what was erased is on no branch. Other data that went are no
longer to be had, so neither shows a version that lacks them.

A name is taken from the commit on, whatever becomes of files; one that was deleted may be used
again, for a tag if it shows the same artifacts. A process that is killed after the commit has made
or deleted the ref; the file that repeats it is written by the next `flagdata doctor`.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import UTC, datetime

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.files.durable import confirming
from flagdata.errors import ConflictError, NotFoundError, UnknownNameError, UsageError
from flagdata.lake.attempts import persist
from flagdata.lake.commits import Change, commit
from flagdata.lake.lineage import removals
from flagdata.lake.marking import rows_not_erased
from flagdata.lake.refs import ERASED, MAIN, NOUNS, Ref, View, as_json, check_name
from flagdata.lake.removal import descendants, lost
from flagdata.lake.store import Store

_MESSAGES = {"tags": "tag {0}", "branches": "begin the branch {0}"}
_NEWER = "choose a newer version, or one that a tag shows"
_WITH_DATA = ["artifact", "object"]


def make_ref(lake: Store, kind: str, name: str, *, at: str | None, notes: Mapping[str, str]) -> Ref:
    """Makes a tag or branch, see `Lake.tag` and `Lake.branch`.

    Args:
        kind: "tags" or "branches".
        notes: what else is stated of it, by name.
    """
    noun = NOUNS[kind]
    check_name(name, noun=noun)

    def attempt() -> Ref:
        head = lake.catalog.head()
        if name in (MAIN, *lake.refs.tags(), *lake.refs.branches()):
            raise ConflictError(
                f"there is a tag or branch {name!r} already",
                where=str(lake.path),
                fix="choose another name; a tag never moves"
                if kind == "tags"
                else "choose another name",
            )
        view = lake.view(at)
        erased = _check_whole(lake, view, head)
        change = Change(message=_MESSAGES[kind].format(name))
        noted = dict(notes)
        if kind == "tags":
            _check_reuse(lake, name, view)
        elif erased:
            _check_orphans(lake, view, erased)
            noted[ERASED] = str(len(erased))
            change = replace(change, leaving={name: erased})
        ref = Ref(
            name=name,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            view=view,
            notes=noted,
        )
        commit(lake, replace(change, made={(kind, name): ref}), base=head)
        return ref

    with lake.changing("naming a version"):
        ref = persist(attempt, looks=lake.catalog.looks, where=lake.catalog.path)
        with confirming(f"the {noun} {name}", lake.refs.root):
            lake.refs.cache(kind, ref)
    return ref


def _check_whole(lake: Store, view: View, head: int) -> frozenset[str]:
    """Checks whether a new tag or branch may show a view: not one that lacks data, unless they were
    erased. What a ref shows already is not looked for.

    Returns:
        ids of the rows that were erased since, and did not come again.

    Raises:
        ConflictError: some of its data went, with versions that expired or since gc collected them.
    """
    branches = lake.refs.views(head).values()
    if view in branches:
        return frozenset()
    rows = lake.columns(view, _WITH_DATA)
    whole = rows_not_erased(lake, rows, view)
    on_branches = [lake.columns(each, _WITH_DATA) for each in branches]
    of_tags = [
        rows_not_erased(lake, lake.columns(tag.view, _WITH_DATA), tag.view)
        for tag in lake.refs.tags().values()
    ]
    needed = {name for table in (*on_branches, *of_tags) for name in table["object"].to_pylist()}
    for why in lost(
        lake, whole.filter(~pc.field("object").isin(pa.array(needed, pa.string())))
    ).values():
        raise ConflictError(why.what, where=str(lake.path), fix=_NEWER)
    alive = {artifact for table in on_branches for artifact in table["artifact"].to_pylist()}
    return frozenset(rows["artifact"].to_pylist()) - set(whole["artifact"].to_pylist()) - alive


def _check_orphans(lake: Store, view: View, erased: Collection[str]) -> None:
    """Checks whether nothing that a branch would show was made from what it hides.

    Raises:
        ConflictError: something was.
    """
    rows = lake.columns(view, ["artifact", "kind", "name", "parents"])
    if orphans := descendants(rows, erased):
        first = rows.filter(pc.field("artifact").isin(sorted(orphans))).to_pylist()[0]
        raise ConflictError(
            f"{first['kind']} {first['name']!r} of that version was made from what was erased "
            "since",
            where=str(lake.path),
            fix=_NEWER,
        )


def _check_reuse(lake: Store, name: str, view: View) -> None:
    """Checks whether a tag may have a name: one that was published and deleted never shows anything
    else.

    Raises:
        ConflictError: a deleted tag of that name showed other artifacts.
    """
    for removal in removals(lake.catalog.history()):
        if removal.deleted == f"tag {name}" and lake.identities(removal.view) != lake.identities(
            view
        ):
            raise ConflictError(
                f"a tag {name!r} showed other artifacts until it was deleted",
                where=str(lake.path),
                fix="choose another name; a tag never moves",
            )


def delete_ref(lake: Store, kind: str, name: str, message: str | None, *, discard: bool) -> int:
    """Deletes a tag or branch, see `Lake.delete_tag` and `Lake.delete_branch`.

    Args:
        kind: "tags" or "branches".
    """
    noun = NOUNS[kind]

    def attempt() -> int:
        head = lake.catalog.head()
        refs = lake.refs.tags() if kind == "tags" else lake.refs.branches()
        if name not in refs:
            raise NotFoundError(
                f"there is no {noun} {name!r}",
                where=str(lake.path),
                fix=UnknownNameError.of(noun, name, refs).fix,
            )
        rows = lake.table(refs[name].view if kind == "tags" else lake.refs.view(name, head))
        if not discard:
            _check_elsewhere(lake, noun, name, set(rows["artifact"].to_pylist()))
        leaving = (
            {}
            if kind == "tags"
            else {name: rows.filter(pc.field("branch") == name)["artifact"].to_pylist()}
        )
        change = Change(
            message=message or f"delete the {noun} {name}",
            leaving=leaving,
            deleted=(kind, name),
            notes={"view": json.dumps(as_json(refs[name].view))},
        )
        return commit(lake, change, base=head)

    lake.check_writable()
    if name == MAIN:
        raise UsageError(
            f"{MAIN} cannot be deleted", fix="withdraw what is on it, or begin a new lake"
        )
    with lake.changing(f"deleting the {noun} {name}", alone=True):
        version = persist(attempt, looks=lake.catalog.looks, where=lake.catalog.path)
        with confirming(f"the deletion of the {noun} {name}", lake.refs.root):
            lake.refs.remove(kind, name)
    return version


def _check_elsewhere(lake: Store, noun: str, name: str, identities: set[str]) -> None:
    """Checks whether other refs show all rows, too.

    Raises:
        ConflictError: some would be lost.
    """
    for ref in (MAIN, *lake.refs.branches(), *lake.refs.tags()):
        if ref != name:
            identities = identities - set(
                lake.rows(at=ref, columns=["artifact"])["artifact"].to_pylist()
            )
    if identities:
        raise ConflictError(
            f"{len(identities)} artifacts are shown by this {noun} alone: without it, gc deletes "
            "them",
            where=f"{noun} {name}",
            fix="merge or tag them first, or add --discard to give them up",
        )
