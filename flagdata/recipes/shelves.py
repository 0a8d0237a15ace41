"""Recipes by name or by path: where the text of one is found. Its content is parsed by the module
that knows its form.

Each kind of recipe has a folder of `catalogs` with files NAME.toml. Wherever one is named, a path
that ends in .toml names the user's own file in its place. Installed packages add recipes to some
kinds by entry points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from flagdata.core.files.addresses import local_path
from flagdata.core.files.plain_text import plain_text
from flagdata.core.files.regular_files import check_input
from flagdata.errors import InputError, LimitError, UnknownNameError
from flagdata.recipes.documents import SIZE_LIMIT, LimitsError, from_toml
from flagdata.recipes.registry import Registry

_SUFFIX = ".toml"
NAME_LIMIT = 100
"""Longest name of a recipe [characters]: files and artifacts are called after it."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """A recipe that was found, not parsed yet.

    Attributes:
        name: in the catalog, or of the file without its suffix.
        data: what the file holds.
        folder: to which paths inside the recipe are relative; the working directory for recipes of
            the catalog.
        where: for error messages.
    """

    name: str
    data: bytes
    folder: Path
    where: str

    @property
    def text(self) -> str:
        """The file's text.

        Raises:
            InputError: it is not UTF-8, and no byte-order mark says what else.
        """
        return plain_text(self.data, noun="recipe", where=self.where)


@dataclass(frozen=True, kw_only=True)
class Shelf:
    """Finds the recipes of one kind: in the catalog, in installed packages, or in a user's file.

    Args:
        folder: of `catalogs`.
        noun: what one is called in error messages ("data set").
        group: an entry-point group by which installed packages add recipes; each entry leads to the
            path of a file.
    """

    folder: str
    noun: str
    group: str | None = None

    @cached_property
    def registry(self) -> Registry:
        """The names of the catalog and of installed packages; looking up a name of an installed
        package gives its path, names of the catalog cannot be looked up."""
        entries = (entry.name for entry in self.place().iterdir())
        names = sorted(name.removesuffix(_SUFFIX) for name in entries if name.endswith(_SUFFIX))
        return Registry(
            self.noun, dict.fromkeys(names, ""), group=self.group, accepts=_is_recipe_path
        )

    def place(self) -> Traversable:
        """Returns the folder in which the files of the catalog are."""
        return files("catalogs") / self.folder

    def names(self) -> tuple[str, ...]:
        """Returns the recipes of the catalog and of installed packages, sorted."""
        return tuple(sorted(self.registry))

    def title(self, name: str) -> str:
        """Returns what a recipe is, one line."""
        table = parse_recipe(self.named(name).text, where=name)
        return str(table.get("title") or table["about"])

    def named(self, name: str, *, where: str | None = None) -> Found:
        """Returns the recipe of that name in the catalog or in an installed package.

        Args:
            where: the place in which the name was written, for the error message.

        Raises:
            UnknownNameError: no such name; the nearest is suggested.
            PlugInError: an installed package adds the name, and it cannot be used.
        """
        if name not in self.registry:
            raise UnknownNameError.of(self.noun, name, self.names(), where=where)
        if self.registry.package(name) is not None:
            return replace(read_recipe(self.registry[name]), name=name)
        data = (self.place() / f"{name}{_SUFFIX}").read_bytes()
        return Found(name=name, data=data, folder=Path(), where=f"{self.noun} {name!r}")

    def find(self, source: str) -> Found:
        """Finds the recipe of that name in the catalog, or the file of that path, which ends in
        .toml.

        Raises:
            UnknownNameError: no such name; the nearest is suggested.
            UsageError: an address, not a path.
            NotFoundError: no such file.
            InputError: it cannot be read, or its name cannot be that of an artifact.
            LimitError: it is larger than any recipe.
        """
        path = local_path(source)
        if not source.endswith(_SUFFIX):
            return self.named(source)
        if not is_name(path.stem):
            raise InputError(
                f"a {self.noun} cannot be called {path.stem!r}",
                where=source,
                fix=f"rename the file: 1 to {NAME_LIMIT} printable characters",
            )
        return read_recipe(path)


def read_recipe(path: Path) -> Found:
    """Reads the recipe in a file.

    Raises:
        NotFoundError: no such file.
        InputError: it cannot be read, or is empty.
        LimitError: larger than `SIZE_LIMIT` characters can be.
    """
    check_input(path, noun="recipe file", limit=4 * SIZE_LIMIT)  # bytes of a character of UTF-8
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"the recipe cannot be read: {error.strerror}", where=str(path), fix="check it"
        ) from None
    return Found(name=path.stem, data=data, folder=path.parent, where=str(path))


def _is_recipe_path(entry: object) -> bool:
    """Returns whether what an entry point leads to is the path of a recipe."""
    return isinstance(entry, Path) and entry.suffix == _SUFFIX


def is_name(value: object) -> bool:
    """Checks whether a recipe, and what is made by it, can be called so: text of printable
    characters, not too long."""
    return (
        isinstance(value, str)
        and bool(value.strip())
        and value.isprintable()
        and len(value) <= NAME_LIMIT
    )


def parse_recipe(text: str, *, where: str) -> dict[str, Any]:
    """Parses the tables of a recipe's text.

    Raises:
        InputError: it is not TOML, or holds a number that is not finite or of thousands of digits.
        LimitError: larger or nested deeper than the limits of `flagdata.recipes.documents`.
    """
    try:
        return from_toml(text)
    except LimitsError as error:
        raise LimitError(
            str(error), where=where, fix="shorten the file or nest less: no recipe needs more"
        ) from None
    except ValueError as error:
        raise InputError(str(error), where=where, fix="correct the file") from None
