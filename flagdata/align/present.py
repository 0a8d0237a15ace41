"""What an alignment of two artifacts is known by: its parents and its recipe, in the catalog and in
its record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagdata.core.provenance import canonical, recipe_hash
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError
from flagdata.lake import Artifact, Lake
from flagdata.lake.remaking import ABSENT, Present, present


def find_made(
    lake: Lake,
    kind: Kind,
    parents: Mapping[str, Artifact],
    recipe: Mapping[str, Any],
    *,
    noun: str,
    name: str | None,
    session: str | None,
    branch: str,
) -> Present:
    """Finds what the branch has of the artifact that these parents and this recipe make.

    Args:
        parents: in their order, by what each is.
        noun: the artifact is, for messages.
        name, session: asked for; `None` takes any.

    Raises:
        ConflictError: it is there under another name or session than the one asked for.
    """
    wanted = [parent.id for parent in parents.values()]
    rows = lake.rows({"kind": kind, "recipe_hash": recipe_hash(recipe)}, at=branch).to_pylist()
    for row in rows:
        if list(row["parents"]) != wanted:
            continue
        artifact = Artifact.from_row(row)
        for label, asked, value in (
            ("name", name, artifact.name),
            ("session", session, artifact.session),
        ):
            if asked is not None and asked != value:
                raise ConflictError(
                    f"the {noun} is there already with the {label} {value!r}",
                    where=artifact.id,
                    fix=f"leave out --{label}, or take the old one off with flagdata withdraw "
                    "first",
                )
        return present(lake, artifact)
    return ABSENT


def provenance(
    parents: Mapping[str, Artifact], recipe: Mapping[str, Any], *, code: str
) -> dict[str, str]:
    """Returns what a record says of where it comes from.

    Args:
        code: version of the code that made it.
    """
    return {role: parent.id for role, parent in parents.items()} | {
        "recipe": canonical(recipe),
        "recipe_hash": recipe_hash(recipe),
        "code_version": code,
    }
