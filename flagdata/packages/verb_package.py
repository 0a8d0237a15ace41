"""A package that is called as the verb of its name: `flagdata.ingest` holds readers,
`flagdata.ingest(...)` reads."""

from __future__ import annotations

import inspect
import textwrap
from importlib import import_module
from types import ModuleType
from typing import Any


class VerbPackage(ModuleType):
    """A package of flagdata whose `_VERB` says where its call is, as "module:attribute"."""

    @property
    def _call(self) -> Any:
        module, _, name = str(self._VERB).partition(":")
        return getattr(import_module(module), name)

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        """The call's docstring below its signature, which `help` shows of no module."""
        shown = f"{self.__name__}{inspect.signature(self)}"
        return (
            f"{textwrap.fill(shown, 92, subsequent_indent='    ')}\n\n{inspect.getdoc(self._call)}"
        )

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(self._call)

    @property
    def converts(self) -> frozenset[str]:
        """Parameters whose values become plain Python's, see `flagdata.core.arguments`."""
        return self._call.converts

    def __call__(self, *positional: Any, **named: Any) -> Any:
        return self._call(*positional, **named)
