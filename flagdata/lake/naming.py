"""What a user means who names an artifact: by its id or the beginning of it, its name, or the file it came from."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import PurePath
from typing import Any

import pyarrow.compute as pc

from flagdata.lake.revisions import superseded
from flagdata.schema import Kind

COLUMNS = ("artifact", "kind", "name", "parents", "source_name")
"""Columns that are looked at."""
OF_RESULTS = (*COLUMNS, "recipe", "created")
"""The same where measurements, verdicts and their models may be meant: which of them are superseded."""


def condition(wanted: str) -> pc.Expression:
    """What all rows meet that `meant` may choose."""
    file = PurePath(wanted).name
    begins = pc.starts_with(pc.field("artifact"), wanted)  # type: ignore[attr-defined]
    return begins | (pc.field("name") == wanted) | (pc.field("source_name") == file)


def meant(rows: Iterable[Mapping[str, Any]], wanted: str, *, kinds: Collection[Kind] = ()) -> list[Mapping[str, Any]]:
    """The artifacts that `wanted` may mean: one, or none, or several that nothing decides between.

    An id comes first, then a name, then the file that was ingested, then the beginning of an id. Of several of one
    name those of `kinds` come first; then a clip is not meant beside its recording, nor an artifact beside what was
    made from it: a film that was aligned has the name of its recording. Of versions of a result the newest is meant.

    Args:
        rows: of the catalog, with `COLUMNS`; with `OF_RESULTS` where results may be meant.
    """
    rows = [row for row in rows if wanted]
    file = PurePath(wanted).name
    named = [row for row in rows if row["artifact"] == wanted]
    named = named or [row for row in rows if row["name"] == wanted]
    named = named or [row for row in rows if row["source_name"] == file]
    if not named:
        return [row for row in rows if row["artifact"].startswith(wanted)]
    named = [row for row in named if row["kind"] in kinds] or named
    named = [row for row in named if row["kind"] != Kind.CLIP] or named
    if len(named) > 1 and "recipe" in named[0]:
        older = superseded(named)
        named = [row for row in named if row["artifact"] not in older]
    parents = {parent for row in named for parent in row["parents"] or ()}
    return [row for row in named if row["artifact"] not in parents]
