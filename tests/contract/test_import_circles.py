"""No module imports itself by way of others: imports at the top of a module, those for types alone
included.

Names that a package hands out when they are asked for (`flagdata.lazy`) are no import of the
package.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter

from flagdata.packages.lazy import export_blocks
from tests.contract.imports import ROOT, imported_names, modules, tree

PRODUCT = ("flagdata", "sim", "models", "measure")


def name_of(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def at_the_top(node: ast.AST) -> Iterator[ast.stmt]:
    """Statements that run, or that a type checker reads, when the module is imported: none inside a
    function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt) and not isinstance(
            child, ast.FunctionDef | ast.AsyncFunctionDef
        ):
            yield child
            yield from at_the_top(child)


def circle(sources: dict[str, ast.Module]) -> list[str]:
    """The first circle of imports among some modules, by their dotted names; empty where there is
    none."""
    graph: dict[str, set[str]] = {}
    for name, source in sources.items():
        handed_out = {id(node) for block in export_blocks(source) for node in block.body}
        statements = (node for node in at_the_top(source) if id(node) not in handed_out)
        imports = [node for node in statements if isinstance(node, ast.Import | ast.ImportFrom)]
        names = imported_names(ast.Module(body=list(imports), type_ignores=[])) & set(sources)
        # `from package import module` is the module's, not the package's own.
        parents = {
            node.module
            for node in imports
            if isinstance(node, ast.ImportFrom) and _only_modules(node, sources)
        }
        graph[name] = names - parents - {name}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def _only_modules(node: ast.ImportFrom, sources: dict[str, ast.Module]) -> bool:
    return all(f"{node.module}.{alias.name}" in sources for alias in node.names)


def test_no_circle() -> None:
    paths = {name_of(str(path.relative_to(ROOT))): path for path in modules(*PRODUCT)}
    assert circle({name: tree(path) for name, path in paths.items()}) == []


def test_an_import_for_types_closes_a_circle_and_one_in_a_function_does_not() -> None:
    first = ast.parse("from flagdata.lake import second\n")
    typed = (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from flagdata.lake.first import "
        "X\n"
    )
    sources = {"flagdata.lake": ast.parse(""), "flagdata.lake.first": first}
    assert circle({**sources, "flagdata.lake.second": ast.parse(typed)}) != []
    lazy = "def late():\n    from flagdata.lake.first import X\n"
    assert circle({**sources, "flagdata.lake.second": ast.parse(lazy)}) == []


def test_what_a_package_hands_out_closes_none() -> None:
    door = "if TYPE_CHECKING:\n    from flagdata.lake.first import X\n"
    first = ast.parse("from flagdata.lake import LAYOUT\n")
    lazy = ast.parse(f"{door}__getattr__ = lazy_exports(__name__, __file__)\n")
    assert circle({"flagdata.lake": ast.parse(door), "flagdata.lake.first": first}) != []
    assert circle({"flagdata.lake": lazy, "flagdata.lake.first": first}) == []
