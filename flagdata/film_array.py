"""The address that `Frames` had in the last version; it is in `flagdata.ingest.films.film_array`
now."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    return getattr(import_module("flagdata.ingest.films.film_array"), name)
