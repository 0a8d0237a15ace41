"""The rooms of a verdict stand in one order, and import only what lies before them, in functions as well."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from tests.contract.imports import ROOT, imported_from, imported_names, modules, tree

ROOMS = (
    "observe", "verdict", "forecasting", "probes", "inference", "nulls", "loop", "report", "closing", "propose",
    "challenge",
)  # fmt: skip
"""Each may import those before it."""
BARE = {"verdict": set[str](), "observe": set[str]()}
"""What imports no other room, not even those before it."""


def rooms_of(names: Iterable[str]) -> set[str]:
    """Rooms that imported names belong to."""
    parts = [name.split(".") for name in names]
    return {part[1] for part in parts if part[0] == "measure" and len(part) > 1} & set(ROOMS)


def test_a_room_imports_only_what_lies_before_it() -> None:
    offenders = {
        str(path.relative_to(ROOT)): extra
        for i, room in enumerate(ROOMS)
        for path in modules(f"measure/{room}")
        if (extra := rooms_of(imported_from(path)) - BARE.get(room, set(ROOMS[:i])) - {room})
    }
    assert offenders == {}


def test_every_room_says_what_it_holds() -> None:
    assert [room for room in ROOMS if not ast.get_docstring(tree(ROOT / "measure" / room / "__init__.py"))] == []


def test_an_import_within_a_function_or_for_types_alone_is_seen() -> None:
    source = (
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from measure.report.page import page\n"
        "def late():\n    from measure import closing\n    import measure.nulls.bank\n"
    )
    assert rooms_of(imported_names(source)) == {"report", "closing", "nulls"}
