"""Which rows of the catalog revise which, by what their recipes state: see `flagdata.lake.results`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any

from flagdata.documents import column_json

REVISION = "revision"
"""Key of a later version's recipe: `of`, the id of the first version, and `code`, the version of the code that inferred
it. The models that a verdict left have that of the verdict."""


def revised(recipe: Mapping[str, Any]) -> str | None:
    """Id of the first version of what a row revises; `None` where it revises nothing."""
    stated = recipe.get(REVISION)
    return stated.get("of") if isinstance(stated, Mapping) else None


def superseded(rows: Iterable[Mapping[str, Any]]) -> set[str]:
    """Ids of rows that a later one revises: them, their first version, or what they were made from.

    Args:
        rows: of the catalog, with its columns `artifact`, `parents`, `recipe` and `created`.
    """
    rows = list(rows)
    first: dict[str, str] = {}
    newest: dict[str, datetime] = {}
    for row in rows:
        artifact, recipe = row["artifact"], row["recipe"]
        of = None
        if recipe and f'"{REVISION}"' in recipe:
            of = revised(column_json(recipe, "recipe", artifact=artifact))
        if of is not None:
            first[artifact] = of
            newest[of] = max(newest.get(of, row["created"]), row["created"])
    if not newest:
        return set()
    found: set[str] = set()
    for row in rows:
        artifact = row["artifact"]
        known = (first[artifact],) if artifact in first else (artifact, *(row["parents"] or ()))
        if any(newest[one] > row["created"] for one in known if one in newest):
            found.add(artifact)
    return found
