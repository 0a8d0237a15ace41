"""Deleting tags and branches: a commit notes what they showed, so that what was built on them is still resolved."""

from __future__ import annotations

import json

import pyarrow.compute as pc

from flagdata.errors import ConflictError, NotFoundError, UnknownNameError, UsageError
from flagdata.lake.catalog import persist
from flagdata.lake.durable import disk_errors
from flagdata.lake.leases import collecting
from flagdata.lake.lineage import noted_view
from flagdata.lake.refs import MAIN, View, as_json
from flagdata.lake.store import Store
from flagdata.lake.withdrawal import take_off

_NOUNS = {"tags": "tag", "branches": "branch"}


def delete(lake: Store, kind: str, name: str, message: str | None, *, discard: bool) -> int:
    """See `Lake.delete_tag` and `Lake.delete_branch`.

    Args:
        kind: "tags" or "branches".
    """
    noun = _NOUNS[kind]

    def attempt() -> int:
        head = lake.catalog.head()
        known = lake.refs.tags() if kind == "tags" else lake.refs.branches()
        if name not in known:
            raise NotFoundError(
                f"there is no {noun} {name!r}", where=str(lake.path), fix=UnknownNameError.of(noun, name, known).fix
            )
        shown = lake.table(known[name].view if kind == "tags" else lake.refs.view(name, head))
        if not discard:
            _check_elsewhere(lake, noun, name, set(shown["artifact"].to_pylist()))
        info = {"message": message or f"delete the {noun} {name}", "deleted": f"{noun} {name}"}
        info["view"] = json.dumps(as_json(known[name].view))
        if kind == "tags":
            return lake.catalog.append(shown.slice(0, 0), base=head, info=info)
        own = shown.filter(pc.field("branch") == name)["artifact"].to_pylist()
        info |= {"branch": name, "withdrawn": str(len(own))}
        return take_off(lake, own, branch=name, base=head, info=info)

    lake.check_writable()
    if name == MAIN:
        raise UsageError(f"{MAIN} cannot be deleted", fix="withdraw what is on it, or begin a new lake")
    with disk_errors(f"deleting the {noun} {name}", lake.path), collecting(lake.staging):
        version = persist(attempt, where=lake.catalog.path)
        lake.refs.remove(kind, name)
    return version


def _check_elsewhere(lake: Store, noun: str, name: str, shown: set[str]) -> None:
    """Whether other refs show all rows, too.

    Raises:
        ConflictError: some would be lost.
    """
    for ref in (MAIN, *lake.refs.branches(), *lake.refs.tags()):
        if ref != name:
            shown = shown - set(lake.rows(at=ref, columns=["artifact"])["artifact"].to_pylist())
    if shown:
        raise ConflictError(
            f"{len(shown)} artifacts are shown by this {noun} alone: without it, gc deletes them",
            where=f"{noun} {name}",
            fix="merge or tag them first, or add --discard to give them up",
        )


def check_reuse(lake: Store, name: str, view: View) -> None:
    """Whether a tag may have a name: one that was published and deleted never shows anything else.

    Raises:
        ConflictError: a deleted tag of that name showed other artifacts.
    """
    for entry in lake.catalog.history():
        if entry.get("deleted") == f"tag {name}" and _shown(lake, noted_view(entry)) != _shown(lake, view):
            raise ConflictError(
                f"a tag {name!r} showed other artifacts until it was deleted",
                where=str(lake.path),
                fix="choose another name; a tag never moves",
            )


def _shown(lake: Store, view: View) -> set[str]:
    return set(lake.table(view)["artifact"].to_pylist())
