"""Where the packages beside flagdata are once it is installed: inside it, so that no file of a user
meets their names.

In a checkout `sim`, `models`, `measure` and `catalogs` lie beside `flagdata` and are imported so.
In a wheel they are `flagdata._packages.sim` and so on: `BuildPackages` moves them there and renames
them in import statements, and in texts that name one of their modules, as tables of lazily imported
attributes do.

A checkout, also one that is installed to be edited, keeps the short names unless a file of the user
has one of them: `step_aside` then loads each module by the name that it has in a wheel, renamed as
it is read.

The building of a wheel loads this file by itself, so it imports nothing of flagdata.
"""

from __future__ import annotations

import ast
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import decode_source, find_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    BuildPy: Any = object
elif "setuptools" in sys.modules:  # which builds a wheel
    from setuptools.command.build_py import build_py as BuildPy  # noqa: N812
else:
    BuildPy = object

BESIDE = ("catalogs", "measure", "models", "sim")
"""Packages that are beside flagdata in a checkout."""
FOLDER = "_packages"
PREFIX = f"flagdata.{FOLDER}."
_ABOUT = '"""The packages that lie beside flagdata in a checkout."""\n'
_HERE = Path(__file__).parents[1]
_ROOT = _HERE.parent
_NAME = re.compile(rf"(?P<module>(?:{'|'.join(BESIDE)})(?:\.\w+)*)(?::\w+)?")


def renaming() -> bool:
    """Returns whether the packages are imported as `flagdata._packages.sim` and so on, not as
    `sim`."""
    return (_HERE / FOLDER).is_dir() or any(isinstance(finder, _Finder) for finder in sys.meta_path)


def step_aside() -> None:
    """Gives a checkout the names of an installation, if a file or folder of the user is imported in
    place of a package.

    `import flagdata` calls it before any other module is loaded. A wheel has those names already.
    """
    if not renaming() and not all(map(_is_free, BESIDE)):
        sys.meta_path.insert(0, _Finder())


def _is_free(name: str) -> bool:
    """Returns whether importing a package's name leads to this checkout's package, or to nothing
    yet."""
    try:
        spec = find_spec(name)
    except ValueError:  # imported already, from no file
        return False
    if spec is None:
        return True
    return (
        spec.origin is not None
        and Path(spec.origin).resolve() == (_ROOT / name / "__init__.py").resolve()
    )


class _Finder:
    """Finds the modules of a checkout by their names in an installation."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: object = None
    ) -> ModuleSpec | None:
        """Returns what loads a module of flagdata or of the packages beside it; None for any
        other."""
        top, *parts = name.split(".")
        if top != "flagdata" or not parts:
            return None
        if parts == [FOLDER]:
            spec = ModuleSpec(name, None, is_package=True)
            spec.submodule_search_locations = []
            return spec
        location = _ROOT.joinpath(*parts[1:]) if parts[0] == FOLDER else _HERE.joinpath(*parts)
        package = location / "__init__.py"
        file, folders = (
            (package, [str(location)]) if package.is_file() else (location.with_suffix(".py"), None)
        )
        if not file.is_file():
            return None
        loader = _Loader(name, str(file))
        return spec_from_file_location(
            name, file, loader=loader, submodule_search_locations=folders
        )


class _Loader(SourceFileLoader):
    """Loads a module of a checkout with the names of an installation in its source."""

    def source_to_code(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, data: Any, path: Any, *, _optimize: int = -1
    ) -> Any:
        """Returns the code of the renamed source."""
        return compile(
            rename_packages(decode_source(data), _ROOT),
            path,
            "exec",
            dont_inherit=True,
            optimize=_optimize,
        )

    def path_stats(self, path: Any) -> Any:
        """Refuses to date the source, so that no byte code is read or kept: what is kept has the
        short names.

        Raises:
            OSError: always, which the import system takes for a source without a date.
        """
        raise OSError(path)


def rename_packages(source: str, root: Path) -> str:
    """Renames the packages in Python source as they are in an installation.

    Args:
        root: folder in which the packages lie: a text is a name where there is such a module.
    """
    lines = source.splitlines(keepends=True)
    for line, column in sorted(_places(ast.parse(source), root), reverse=True):
        row = lines[line - 1].encode()  # the parser counts bytes
        lines[line - 1] = (row[:column] + PREFIX.encode() + row[column:]).decode()
    return "".join(lines)


def _places(tree: ast.Module, root: Path) -> Iterator[tuple[int, int]]:
    """Yields (line, column [B]) where a name of the packages begins."""
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.ImportFrom)
            and node.level == 0
            and (node.module or "").partition(".")[0] in BESIDE
        ):
            yield node.lineno, node.col_offset + len("from ")
        elif isinstance(node, ast.Import):
            if any(alias.name.partition(".")[0] in BESIDE for alias in node.names):
                raise ValueError(
                    f"line {node.lineno}: write `from package import module`, which can be renamed"
                )
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and _is_name(node.value, root)
        ):
            yield node.lineno, node.col_offset + 1
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "files"
        ):
            yield from (
                (argument.lineno, argument.col_offset + 1)
                for argument in node.args
                if _is_package(argument)
            )


def _is_name(text: str, root: Path) -> bool:
    """Checks whether a text names a module within a package, perhaps with an attribute of it."""
    match = _NAME.fullmatch(text)
    if match is None or "." not in match["module"]:
        return False
    path = root.joinpath(*match["module"].split("."))
    return path.is_dir() or path.with_suffix(".py").is_file()


def _is_package(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value in BESIDE


class BuildPackages(BuildPy):
    """Builds the packages of a wheel, those beside flagdata within it."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return
        root = Path(self.build_lib)
        inside = root / "flagdata" / FOLDER
        shutil.rmtree(inside, ignore_errors=True)
        for path in sorted(root.rglob("*.py")):
            path.write_text(
                rename_packages(path.read_text(encoding="utf-8"), root), encoding="utf-8"
            )
        inside.mkdir()
        (inside / "__init__.py").write_text(_ABOUT, encoding="utf-8")
        for name in BESIDE:
            shutil.move(root / name, inside / name)

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        """Lists the files that are there after the move."""
        if self.editable_mode:
            return super().get_outputs(include_bytecode)
        return [str(path) for path in sorted(Path(self.build_lib).rglob("*")) if path.is_file()]
