"""The rooms of a verdict stand in one order, and import only what lies before them, in functions as well."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.contract.imports import imported_names

ROOT = Path(__file__).resolve().parents[2]
ROOMS = (
    "observe", "verdict", "forecasting", "probes", "inference", "nulls", "loop", "report", "closing", "propose",
    "challenge",
)  # fmt: skip
"""Each may import those before it."""
BARE = {"verdict": set[str](), "observe": set[str]()}
"""What imports no other room, not even those before it."""
MODULES = [(room, path) for room in ROOMS for path in sorted((ROOT / "measure" / room).rglob("*.py"))]


def imported_rooms(source: str) -> set[str]:
    """Rooms that a module imports anything of, wherever in it the import stands."""
    parts = [name.split(".") for name in imported_names(source)]
    return {part[1] for part in parts if part[0] == "measure" and len(part) > 1} & set(ROOMS)


@pytest.mark.parametrize(("room", "path"), MODULES, ids=lambda value: str(value).removeprefix(f"{ROOT}/"))
def test_a_room_imports_only_what_lies_before_it(room: str, path: Path) -> None:
    allowed = BARE.get(room, set(ROOMS[: ROOMS.index(room)]))
    extra = imported_rooms(path.read_text(encoding="utf-8")) - allowed - {room}
    assert not extra, f"measure/{room} may not import {sorted(extra)}"


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_says_what_it_holds(room: str) -> None:
    tree = ast.parse((ROOT / "measure" / room / "__init__.py").read_text(encoding="utf-8"))
    assert ast.get_docstring(tree)


def test_an_import_within_a_function_or_for_types_alone_is_seen() -> None:
    source = (
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from measure.report.page import page\n"
        "def late():\n    from measure import closing\n    import measure.nulls.bank\n"
    )
    assert imported_rooms(source) == {"report", "closing", "nulls"}
