"""The stages of a verdict have one order and import only earlier ones, in functions as well."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from tests.contract.imports import ROOT, imported_from, imported_names, modules, tree

STAGES = (
    "trajectories",
    "verdict",
    "forecasting",
    "probes",
    "inference",
    "nulls",
    "loop",
    "report",
    "closing",
    "propose",
)
"""Each may import those before it."""
BARE = {"verdict": set[str](), "trajectories": set[str]()}
"""Stages that import no other one."""


def stages_of(names: Iterable[str]) -> set[str]:
    """Stages to which imported names belong."""
    parts = [name.split(".") for name in names]
    return {part[1] for part in parts if part[0] == "measure" and len(part) > 1} & set(STAGES)


def test_a_stage_imports_only_earlier_ones() -> None:
    offenders = {
        str(path.relative_to(ROOT)): extra
        for i, stage in enumerate(STAGES)
        for path in modules(f"measure/{stage}")
        if (extra := stages_of(imported_from(path)) - BARE.get(stage, set(STAGES[:i])) - {stage})
    }
    assert offenders == {}


def test_every_stage_states_its_purpose() -> None:
    assert [
        stage
        for stage in STAGES
        if not ast.get_docstring(tree(ROOT / "measure" / stage / "__init__.py"))
    ] == []


def test_imports_within_functions_and_for_types_count() -> None:
    source = (
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from measure.report.verdict_answer import closed\n"
        "def late():\n    from measure import closing\n    import measure.nulls.bank\n"
    )
    assert stages_of(imported_names(source)) == {"report", "closing", "nulls"}
