"""What a part hands out at its door is there, under a name of its own, and tests take it there.

A part is a package and the folder below it, `measure.verdict`; its door is its `__init__.py`
(decision 070).
"""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from flagdata.packages.lazy import export_blocks, exports
from flagdata.packages.verb_package import VerbPackage
from tests.contract.imports import ROOT, modules, statements, tree
from tests.contract.test_import_circles import PRODUCT, name_of
from tests.contract.test_part_circles import part

MODULES = {name_of(str(path.relative_to(ROOT))): path for path in modules(*PRODUCT)}
DOORS = {
    name: exports(str(path))
    for name, path in MODULES.items()
    if path.stem == "__init__" and export_blocks(tree(path))
}


def defined(module: ast.Module) -> set[str]:
    """Names that a module binds when it is imported."""
    names = {
        target.id
        for node in ast.walk(module)
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in ast.walk(node)
        if isinstance(target, ast.Name)
    }
    return names | {
        node.name for node in module.body if isinstance(node, ast.FunctionDef | ast.ClassDef)
    }


def test_there_are_doors() -> None:
    assert {
        "flagdata",
        "flagdata.dataset",
        "measure.verdict",
        "sim.effects",
        "models.training",
    } <= set(DOORS)


@pytest.mark.parametrize("door", DOORS)
def test_a_door_names_what_modules_of_its_part_define(door: str) -> None:
    assert [
        f"{module}.{name}"
        for name, module in DOORS[door].items()
        if not module.startswith(f"{door}.")
        or module not in MODULES
        or name not in defined(tree(MODULES[module]))
    ] == []


@pytest.mark.parametrize("door", DOORS)
def test_no_name_at_a_door_is_a_modules(door: str) -> None:
    """Once such a module is imported, the package's attribute is the module; a package that is
    called as a verb is both."""
    hidden = [f"{door}.{name}" for name in DOORS[door] if f"{door}.{name}" in MODULES]
    assert [name for name in hidden if not isinstance(import_module(name), VerbPackage)] == []


def test_tests_take_at_the_door_what_is_handed_out_there() -> None:
    below = [
        f"{path.relative_to(ROOT)}:{node.lineno} from {node.module} import {alias.name}"
        for path in modules("tests")
        for node in statements(tree(path))
        if isinstance(node, ast.ImportFrom)
        and node.module in MODULES
        and node.module.count(".") > 1
        for alias in node.names
        if DOORS.get(part(node.module), {}).get(alias.name) == node.module
    ]
    assert below == []


def test_a_name_loads_its_own_module_and_no_other(tmp_path: Path) -> None:
    package = tmp_path / "house" / "room"
    package.mkdir(parents=True)
    (tmp_path / "house" / "__init__.py").write_text("")
    (package / "__init__.py").write_text(
        "from typing import TYPE_CHECKING\nfrom flagdata.packages.lazy import lazy_exports\n"
        "if TYPE_CHECKING:\n    from house.room.chair import Chair, legs\n    from "
        "house.room.table import top\n"
        "__getattr__ = lazy_exports(__name__, __file__)\n"
    )
    (package / "chair.py").write_text("class Chair: pass\nlegs = 4\n")
    (package / "table.py").write_text("top = 1\n")
    code = (
        "import sys, pickle, house.room\nfrom house.room import Chair, legs\n"
        "print(sorted(n for n in sys.modules if n.startswith('house')), legs, Chair.__module__)\n"
        "try:\n    house.room.lamp\nexcept AttributeError as error:\n    print(error)\n"
        "from house.room import table\nprint(table.__name__, house.room.top)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={"PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines() == [
        "['house', 'house.room', 'house.room.chair'] 4 house.room.chair",
        "module 'house.room' has no attribute 'lamp'",
        "house.room.table 1",
    ]
