"""What notebooks, pages and examples import is public: it is the same in an installation, and
stays.

The docstring of `flagdata` names the public modules."""

from __future__ import annotations

import ast
import inspect
import json
import re
import textwrap
from collections.abc import Iterator
from importlib import import_module

import pytest

import flagdata
from flagdata.extend import GROUPS
from flagdata.packages.installed_names import BESIDE
from tests.contract.imports import ROOT
from tests.docs.calls import example
from tests.docs.pages import DOCS

MODULES = set(re.findall(r"`(flagdata\.[a-z]+)`", flagdata.__doc__ or ""))
RECORDS = ("decisions", "results", "cases", "method")
"""Folders of pages that speak of the code as it is or was, to its developers."""
FEATURES = {"flagdata.time"}
"""Columns of an export that are called so."""
PYTHON = re.compile(r"^( *)```python[^\n]*\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
QUOTED = re.compile(r"`(flagdata\.[a-z_]+)[^`\n]*`")


def names_of(module: str) -> set[str]:
    """The public names of a public module."""
    found = import_module(module)
    return set(getattr(found, "__all__", ())) or {
        name for name in dir(found) if not name.startswith("_")
    }


def pages() -> Iterator[tuple[str, str]]:
    """The pages for users, with their text."""
    for path in (*DOCS.rglob("*.md"), ROOT / "README.md"):
        if path.parent.name not in RECORDS and path.parent.parent.name not in RECORDS:
            yield str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")


def programs() -> dict[str, str]:
    """Where Python stands → the Python there."""
    found = {
        name: "\n".join(textwrap.dedent(code) for _, code in PYTHON.findall(text))
        for name, text in pages()
    }
    for path in DOCS.rglob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
        found[str(path.relative_to(ROOT))] = "\n".join(code)
    found |= {f"flagdata.{name}": example(name) for name in flagdata.__all__}
    return {name: code for name, code in found.items() if code}


PROGRAMS = programs()


def taken(code: str) -> Iterator[tuple[str, str]]:
    """Module and name of what a program takes from flagdata and the packages beside it."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((str(node.module), alias.name) for alias in node.names)
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) == "flagdata":
            yield "flagdata", node.attr


def is_public(module: str, name: str) -> bool:
    """Whether a name may be taken from a module, or a module as a whole (no name)."""
    if module.partition(".")[0] not in {"flagdata", *BESIDE}:
        return True
    if f"{module}.{name}" in MODULES or (module == "flagdata" and name == "__version__"):
        return True
    return module in {"flagdata", *MODULES} and (not name or name in names_of(module))


def test_the_docstring_of_flagdata_names_its_public_modules() -> None:
    assert {"flagdata.dataset", "flagdata.errors", "flagdata.extend"} <= MODULES
    assert [name for name in MODULES if not inspect.ismodule(import_module(name))] == []


@pytest.mark.parametrize("where", PROGRAMS)
def test_a_program_takes_public_names_alone(where: str) -> None:
    found = [f"{module} {name}" for module, name in taken(PROGRAMS[where])]
    assert [one for one in found if not is_public(*one.split(" "))] == []


@pytest.mark.parametrize("where", [name for name, text in pages() if QUOTED.search(text)])
def test_what_a_page_calls_flagdatas_is(where: str) -> None:
    text = (ROOT / where).read_text(encoding="utf-8")
    known = {f"flagdata.{name}" for name in (*flagdata.__all__, "__version__")}
    known |= MODULES | set(GROUPS) | FEATURES
    assert set(QUOTED.findall(text)) - known == set()


@pytest.mark.parametrize(
    "code",
    [
        "from measure.demo.tracked import make_tracks",
        "from flagdata.cli import root",
        "import sim.effects",
        "from flagdata.errors import NoSuchError",
        "import flagdata\nflagdata.no_such_call()",
    ],
)
def test_a_private_name_is_found(code: str) -> None:
    assert not all(is_public(*one) for one in taken(code))
