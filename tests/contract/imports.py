"""What a module imports, read from its source, so that an import inside a function or for types alone counts too."""

from __future__ import annotations

import ast


def imported_names(source: str) -> set[str]:
    """Dotted names of all modules that a module imports, and of whatever it takes from them.

    Raises:
        AssertionError: a relative import, which does not say of which package it is.
    """
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, "imports are absolute, so that rooms can be told"
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names
