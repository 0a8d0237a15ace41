"""No part imports itself by way of others: a part is a package and the folder or the module below
it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter

from tests.contract.imports import ROOT, modules, statements, tree
from tests.contract.test_import_circles import PRODUCT, name_of


def part(module: str) -> str:
    """`measure.verdict` of `measure.verdict.record`."""
    return ".".join(module.split(".")[:2])


def modules_imported(source: ast.Module, known: set[str]) -> Iterator[str]:
    """Modules that a source imports anywhere; `from package import module` is the module's, not the
    package's."""
    for node in statements(source):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield from (
                    module
                    for module in (name if name in known else node.module,)
                    if module in known
                )


def circle_of_parts(sources: dict[str, ast.Module]) -> list[str]:
    """The first circle among the parts of some modules, by their dotted names; empty where there is
    none."""
    graph: dict[str, set[str]] = {}
    for name, source in sources.items():
        parts = {part(module) for module in modules_imported(source, set(sources))}
        graph.setdefault(part(name), set()).update(parts - {part(name)})
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_no_part_is_in_a_circle() -> None:
    paths = {name_of(str(path.relative_to(ROOT))): path for path in modules(*PRODUCT)}
    assert circle_of_parts({name: tree(path) for name, path in paths.items()}) == []


def test_two_modules_of_two_parts_close_a_circle_without_one_among_modules_and_within_functions() -> (
    None
):
    lake = {"flagdata.lake.rows": "from flagdata.units import metres\n", "flagdata.lake.refs": ""}
    units = {
        "flagdata.units": "",
        "flagdata.units.metres": "",
        "flagdata.units.table": "def late():\n    from flagdata.lake import refs\n",
    }
    sources = {name: ast.parse(text) for name, text in (lake | units).items()}
    assert set(circle_of_parts(sources)) == {"flagdata.lake", "flagdata.units"}
    del sources["flagdata.units.table"]
    assert circle_of_parts(sources) == []
