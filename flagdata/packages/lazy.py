"""Names that a package hands out and imports only when they are first asked for: the package's
door."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from flagdata.packages.installed_names import PREFIX


def lazy_exports(package: str, file: str) -> Callable[[str], Any]:
    """Returns the `__getattr__` of a package whose `__init__.py` imports names where a type checker
    reads them.

        if TYPE_CHECKING:
            from measure.verdict.verdict_record import Record

        __getattr__ = lazy_exports(__name__, __file__)

    `from measure.verdict import Record` then imports `measure.verdict.verdict_record` and no other
    module of the package. A name that is also a module's cannot be among them: once the module is
    imported, the package's attribute is it. Where packages have the names of an installation
    (`flagdata.packages.installed_names`), so have the modules.
    """
    part = package.removeprefix(PREFIX)

    def attribute(name: str) -> Any:
        module = None if name.startswith("__") else exports(file).get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(
            import_module(package + module.removeprefix(PREFIX).removeprefix(part)), name
        )

    return attribute


@cache
def exports(file: str) -> dict[str, str]:
    """Returns name → module of what the source of a package hands out, read once."""
    blocks = export_blocks(ast.parse(Path(file).read_text(encoding="utf-8")))
    imports = [node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module for node in imports if node.module for alias in node.names}


def export_blocks(tree: ast.Module) -> list[ast.If]:
    """Returns the blocks `if TYPE_CHECKING` of a package that calls `lazy_exports`, none of another
    module."""
    calls = [
        node
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call)
        and ast.unparse(node.value.func) == "lazy_exports"
    ]
    return [
        node
        for node in tree.body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and calls
    ]
