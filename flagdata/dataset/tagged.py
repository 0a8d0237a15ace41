"""A tag keeps how the clips of its version are divided, so that a side of it is the same for
good."""

from __future__ import annotations

import json
from typing import Any

import pyarrow.compute as pc

from flagdata.dataset.sides import Catalog, clips_of, hashed_sides, stated_sides
from flagdata.dataset.splits import HashedSplit
from flagdata.errors import CorruptError, UsageError
from flagdata.lake import Lake
from flagdata.lake.refs import Ref
from flagdata.recipes.documents import from_json

NOTE = "split"
"""Note of a tag that states how clips are divided, JSON: "stated" by data sets, and "hashed" where
they state nothing; each as in `Division.statement`."""


def tag(lake: Lake, name: str, *, at: str | None = None) -> Ref:
    """Names what `at` shows, for good, and notes how its clips are divided; raises as
    `Lake.tag`."""
    if at is None:
        at = str(lake.resolve(None))  # what is described is what is named
    divided = describe(lake.scan(lake.view(at)))
    # In their order: a hash takes its sides one after another.
    return lake.tag(
        name, at=at, notes={NOTE: json.dumps(divided, ensure_ascii=False)} if divided else {}
    )


def describe(catalog: Catalog) -> dict[str, Any]:
    """Describes how all clips of a version are divided. Relatives on two sides are refused where a
    side is asked for, not here."""
    clips = clips_of(catalog, None)
    stated = stated_sides(catalog, clips)
    others = clips.filter(pc.field("side").is_null())
    divided = {} if stated is None else {"stated": stated.statement}
    if others.num_rows:
        divided["hashed"] = hashed_sides(catalog, others, HashedSplit()).statement
    return divided


def hashed_split(lake: Lake, at: str | None) -> HashedSplit:
    """Returns the hashed split that the tag `at` keeps; the usual one where it keeps none, or is no
    tag.

    Raises:
        CorruptError: what it keeps is no split.
    """
    tags = {} if at is None else lake.refs.tags()
    if at not in tags or NOTE not in tags[at].notes:
        return HashedSplit()
    try:
        kept = from_json(tags[at].notes[NOTE]).get("hashed", {})
        return HashedSplit(**{name: kept[name] for name in ("salt", "fractions") if kept})
    except (ValueError, KeyError, TypeError, AttributeError, UsageError) as error:
        raise CorruptError(
            f"the split that the tag keeps cannot be read: {error}",
            where=f"tag {at}",
            fix="name its version by number: the usual split is that of a version",
        ) from None
