"""The packages that rest on flagdata, by name: it imports none of them, and asks for one when it is used."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def attribute(place: str) -> Any:
    """What "module:attribute" names."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
