"""The packages that rest on flagdata, by name: it imports none of them, and asks for one when it is used."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from flagdata.extras import explained


def attribute(place: str) -> Any:
    """Returns what "module:attribute" names.

    Raises:
        MissingExtraError: it needs a package that is not installed.
    """
    module, _, name = place.partition(":")
    with explained():
        return getattr(import_module(module), name)


def call(place: str, *arguments: Any, **options: Any) -> Any:
    """What "module:attribute" names, called.

    Raises:
        MissingExtraError: it needs a package that is not installed.
    """
    module, _, name = place.partition(":")
    with explained():
        return getattr(import_module(module), name)(*arguments, **options)
