"""What was understood of a log's file, as a part of the identity of the artifact that comes of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagdata.provenance import digest

READER = 2
"""Version of the readers of logs: raised with each change of code after which a file that was read gives other times,
values or flags, or has other channels. What a TOML file says needs no raise: its digest is in the plan.

    2   formats of tables are TOML files; instruments' lines are read where they are whole and stamped
"""


def understood(format_name: str, recipe: str | None) -> Mapping[str, Any]:
    """The plan by which a log was read: its format, the digest of the recipe (TOML), of the user or of the catalog's
    format, if one was used, and the reader."""
    return {"format": format_name, "recipe": None if recipe is None else digest(recipe), "reader": READER}
