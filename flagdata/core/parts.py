"""The packages that rest on flagdata, by name: it imports none of them, and asks for one when it is
used."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from flagdata.core.extras import explaining_missing


def attribute(reference: str) -> Any:
    """Returns what "module:attribute" names.

    Raises:
        MissingExtraError: it needs a package that is not installed.
    """
    module, _, name = reference.partition(":")
    with explaining_missing():
        return getattr(import_module(module), name)


def call(reference: str, *arguments: Any, **options: Any) -> Any:
    """Calls what "module:attribute" names.

    Raises:
        MissingExtraError: it needs a package that is not installed.
    """
    module, _, name = reference.partition(":")
    with explaining_missing():
        return getattr(import_module(module), name)(*arguments, **options)
