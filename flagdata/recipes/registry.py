"""Explicit tables of plug-ins: a name, and the "module:Attr" that is imported only when the name is
asked for."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from flagdata.errors import ErrorKind, FlagdataError, UnknownNameError

_LOG = logging.getLogger("flagdata")


class PlugInError(FlagdataError):
    """What an installed package adds by an entry point cannot be used."""

    kind = ErrorKind.PLUG_IN


class Registry(Mapping[str, Any]):
    """A read-only mapping from name to a lazily imported attribute.

    Looking up what an installed package adds raises a PlugInError that names the package, where it
    cannot be imported or is none of these. One that has a name of the table, or of another package,
    is not added: the name is refused, so that an installed package cannot replace another silently.

    Args:
        noun: what the entries are, for error messages ("sensor format").
        table: name → "module:Attr".
        group: an entry-point group whose entries are added after the table's own.
        accepts: whether what an entry point leads to is one of these.
    """

    def __init__(
        self,
        noun: str,
        table: Mapping[str, str],
        *,
        group: str | None = None,
        accepts: Callable[[Any], bool] = lambda entry: True,
    ) -> None:
        self._noun = noun
        self._own = dict(table)
        self._group = group
        self._accepts = accepts
        self._found: dict[str, list[EntryPoint]] | None = None
        self._left_out: set[str] = set()

    def _entry_points(self) -> dict[str, list[EntryPoint]]:
        """Lists the entry points of each name."""
        if self._found is None:
            self._found = {}
            self._left_out.clear()
            for entry in entry_points(group=self._group) if self._group else ():
                self._found.setdefault(entry.name, []).append(entry)
        return self._found

    def __getitem__(self, name: str) -> Any:
        added = self._entry_points().get(name, [])
        if len(added) + (name in self._own) > 1:
            by = [*(["flagdata"] if name in self._own else []), *map(_package, added)]
            raise PlugInError(
                f"the {self._noun} {name!r} is defined twice: by {' and by '.join(by)}",
                where=added[-1].value,
                fix="rename the entry point of the installed package, or uninstall it",
            )
        if added:
            return self._load_entry(added[0])
        if name not in self._own:
            raise UnknownNameError.of(self._noun, name, self)
        return _import_target(self._own[name])

    def _load_entry(self, entry: EntryPoint) -> Any:
        try:
            entry_value = _import_target(entry.value)
            why = (
                None
                if self._accepts(entry_value)
                else f"it is no {self._noun}, but {type(entry_value).__name__} {entry_value!r:.60}"
            )
        except (Exception, SystemExit) as error:  # noqa: BLE001  whatever code of others raises
            entry_value, why = None, f"{type(error).__name__}: {error}"
        if why is not None:
            raise PlugInError(
                f"the {self._noun} {entry.name!r} of {_package(entry)} cannot be used: {why}",
                where=entry.value,
                fix="repair the package, or uninstall it",
            )
        return entry_value

    def package(self, name: str) -> str | None:
        """Names the installed package that adds a name; `None` for those of the table."""
        added = self._entry_points().get(name)
        return _package(added[-1]) if added else None

    def usable(self, names: Iterable[str] | None = None) -> Iterator[tuple[str, Any]]:
        """Yields the entries that can be used, of some names or of all; a warning is logged of each
        that cannot, once."""
        for name in self if names is None else names:
            try:
                yield name, self[name]
            except PlugInError as error:
                if name in self._left_out:
                    continue
                self._left_out.add(name)
                _LOG.warning(
                    "warning: left out: %s\n  where: %s\n  fix:   %s",
                    error.what,
                    error.where,
                    error.fix,
                )

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._entry_points()

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys([*self._own, *self._entry_points()]))

    def __len__(self) -> int:
        return len(self._own.keys() | self._entry_points().keys())


def _package(entry: EntryPoint) -> str:
    return f"package {entry.dist.name}" if entry.dist is not None else "a package"


def _import_target(target: str) -> Any:
    module, _, attribute = target.partition(":")
    return getattr(import_module(module), attribute)
