"""Where what can be made again is kept for this user."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from flagdata.storage import Place


def user_cache() -> Path:
    """Returns FLAGDATA_CACHE, or `flagdata` in the user's cache folder."""
    if chosen := os.environ.get("FLAGDATA_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flagdata"


def beside(lake: Place, suffix: str) -> Path:
    """Returns a folder for what was made of a lake: beside its folder, or in the user's cache where
    it is in a bucket."""
    if isinstance(lake, Path):
        absolute = lake.absolute()
        return absolute.with_name(absolute.name + suffix)
    address = hashlib.sha256(str(lake).encode()).hexdigest()[
        :12
    ]  # "a/b-c" and "a/b/c" would have one name without
    return user_cache() / f"{lake.bucket}-{lake.key.replace('/', '-')}-{address}{suffix}"
