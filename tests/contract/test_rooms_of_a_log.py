"""The rooms in which a log is read stand in one order, and import only what lies before them, in functions as well."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.contract.imports import imported_names

HOUSE = Path(__file__).resolve().parents[2] / "flagdata" / "ingest" / "anemometer"
PACKAGE = "flagdata.ingest.anemometer"
ROOMS = (
    "sniffing", "foreign", "instants", "options", "words", "recipe", "reading", "text", "documents", "winds", "samples",
    "times", "tables", "formats", "recognition", "restating", "sniff", "several", "plan", "preview", "log", "confirm",
)  # fmt: skip
"""Folders and single modules; each may import those before it. `__init__` is what others see."""
MODULES = [path for path in sorted(HOUSE.rglob("*.py")) if path != HOUSE / "__init__.py"]


def room_of(path: Path) -> str:
    return path.relative_to(HOUSE).parts[0].removesuffix(".py")


def imported_rooms(source: str) -> set[str]:
    """Rooms that a module imports anything of, wherever in it the import stands."""
    return {
        name.removeprefix(f"{PACKAGE}.").partition(".")[0]
        for name in imported_names(source)
        if name.startswith(f"{PACKAGE}.")
    }


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(HOUSE)))
def test_a_room_imports_only_what_lies_before_it(path: Path) -> None:
    own = room_of(path)
    extra = imported_rooms(path.read_text(encoding="utf-8")) - set(ROOMS[: ROOMS.index(own)]) - {own}
    assert not extra, f"{own} may not import {sorted(extra)}"


@pytest.mark.parametrize("room", [room for room in ROOMS if (HOUSE / room).is_dir()])
def test_every_room_says_what_it_holds(room: str) -> None:
    tree = ast.parse((HOUSE / room / "__init__.py").read_text(encoding="utf-8"))
    assert ast.get_docstring(tree)


def test_no_room_is_empty_or_unknown() -> None:
    assert {room_of(path) for path in MODULES} == set(ROOMS)


def test_an_import_within_a_function_is_seen() -> None:
    source = f"def late():\n    from {PACKAGE} import log\n    import {PACKAGE}.tables.draft\n"
    assert imported_rooms(source) == {"log", "tables"}
