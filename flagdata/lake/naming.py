"""What a user means who names an artifact: by its id or the beginning of it, its name, or the file
it came from.

Which rows revise which, by what their recipes state: see `flagdata.lake.results`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from datetime import datetime
from pathlib import PurePath
from typing import Any

import pyarrow.compute as pc

from flagdata.core.schema import Kind
from flagdata.recipes.documents import column_json

COLUMNS = ("artifact", "kind", "name", "parents", "source_name")
"""Columns that are looked at."""
OF_RESULTS = (*COLUMNS, "recipe", "created")
"""The same where measurements, verdicts and their models may be meant: which of them are
superseded."""


def condition(wanted: str) -> pc.Expression:
    """Builds the condition that all rows meet that `meant` may choose."""
    file = PurePath(wanted).name
    begins = pc.starts_with(pc.field("artifact"), wanted)  # type: ignore[attr-defined]
    return begins | (pc.field("name") == wanted) | (pc.field("source_name") == file)


def meant(
    rows: Iterable[Mapping[str, Any]], wanted: str, *, kinds: Collection[Kind] = ()
) -> list[Mapping[str, Any]]:
    """Selects the artifacts that `wanted` may mean: one, or none, or several that nothing decides
    between.

    An id comes first, then a name, then the file that was ingested, then the beginning of an id. Of
    several of one name those of `kinds` come first; then a clip is not meant beside its recording,
    nor an artifact beside what was
    made from it: a film that was aligned has the name of its recording. Of versions of a result the
    newest is meant.

    Args:
        rows: of the catalog, with `COLUMNS`; with `OF_RESULTS` where results may be meant.
    """
    rows = [row for row in rows if wanted]
    file = PurePath(wanted).name
    matches = [row for row in rows if row["artifact"] == wanted]
    matches = matches or [row for row in rows if row["name"] == wanted]
    matches = matches or [row for row in rows if row["source_name"] == file]
    if not matches:
        return [row for row in rows if row["artifact"].startswith(wanted)]
    matches = [row for row in matches if row["kind"] in kinds] or matches
    matches = [row for row in matches if row["kind"] != Kind.CLIP] or matches
    if len(matches) > 1 and "recipe" in matches[0]:
        older = superseded_rows(matches)
        matches = [row for row in matches if row["artifact"] not in older]
    parents = {parent for row in matches for parent in row["parents"] or ()}
    return [row for row in matches if row["artifact"] not in parents]


REVISION = "revision"
"""Key of a later version's recipe: `of`, the id of the first version, and `code`, the version of
the code that inferred it. The models that a verdict left have that of the verdict."""


def first_revised(recipe: Mapping[str, Any]) -> str | None:
    """Returns the id of the first version of what a row revises; `None` where it revises
    nothing."""
    revision = recipe.get(REVISION)
    return revision.get("of") if isinstance(revision, Mapping) else None


def superseded_rows(rows: Iterable[Mapping[str, Any]]) -> set[str]:
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
            of = first_revised(column_json(recipe, "recipe", artifact=artifact))
        if of is not None:
            first[artifact] = of
            newest[of] = max(newest.get(of, row["created"]), row["created"])
    if not newest:
        return set()
    older: set[str] = set()
    for row in rows:
        artifact = row["artifact"]
        revised_ids = (
            (first[artifact],) if artifact in first else (artifact, *(row["parents"] or ()))
        )
        if any(newest[identity] > row["created"] for identity in revised_ids if identity in newest):
            older.add(artifact)
    return older
