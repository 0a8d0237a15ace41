"""What was understood of a log's file, as a part of the identity of the artifact that comes of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagdata.provenance import digest

READER = 1
"""Version of the readers of logs; raised whenever a file is read otherwise than before."""


def understood(format_name: str, recipe: str | None) -> Mapping[str, Any]:
    """The plan by which a log was read: its format, the digest of the recipe (TOML) if one was used, the reader."""
    return {"format": format_name, "recipe": None if recipe is None else digest(recipe), "reader": READER}
