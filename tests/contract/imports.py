"""Modules of the project and what each imports, read from its source: an import inside a function
counts too."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("flagdata", "sim", "models", "measure", "catalogs")


def modules(*folders: str) -> list[Path]:
    """Python files below some folders of the repository, in order."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported_from(path: Path) -> frozenset[str]:
    return frozenset(imported_names(tree(path)))


def imported_names(source: str | ast.Module) -> set[str]:
    """Dotted names of all modules that a module imports, and of whatever it takes from them.

    Raises:
        AssertionError: a relative import, which does not say of which package it is.
    """
    names: set[str] = set()
    for node in statements(ast.parse(source) if isinstance(source, str) else source):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, "imports are absolute, so that each names its package"
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements below a node, also those in functions, classes and conditions; of their
    expressions none."""
    for field in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, field, ()):
            yield child
            yield from statements(child)
