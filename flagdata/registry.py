"""Explicit tables of plug-ins: a name, and the "module:Attr" that is imported only when the name is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from flagdata.errors import UnknownNameError


class Registry(Mapping[str, Any]):
    """A read-only mapping from name to a lazily imported attribute.

    Args:
        noun: what the entries are, for error messages ("sensor format").
        table: name → "module:Attr".
        group: an entry-point group whose entries are added after the table's own; a name in both is an error at
            look-up, so that an installed package cannot replace a built-in silently.
    """

    def __init__(self, noun: str, table: Mapping[str, str], *, group: str | None = None) -> None:
        self._noun = noun
        self._own = dict(table)
        self._group = group
        self._resolved: dict[str, str] | None = None

    def _targets(self) -> dict[str, str]:
        if self._resolved is None:
            targets = dict(self._own)
            for entry in entry_points(group=self._group) if self._group else ():
                if entry.name in targets:
                    raise UnknownNameError(
                        f"{self._noun} {entry.name!r} is defined twice: built in and by {entry.value}",
                        fix="rename the entry point of the installed package",
                    )
                targets[entry.name] = entry.value
            self._resolved = targets
        return self._resolved

    def __getitem__(self, name: str) -> Any:
        targets = self._targets()
        if name not in targets:
            raise UnknownNameError.of(self._noun, name, targets)
        module, _, attribute = targets[name].partition(":")
        return getattr(import_module(module), attribute)

    def __contains__(self, name: object) -> bool:
        return name in self._targets()

    def __iter__(self) -> Iterator[str]:
        return iter(self._targets())

    def __len__(self) -> int:
        return len(self._targets())
