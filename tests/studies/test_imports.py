"""Every study can be imported: a name that it takes from the product is there."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ELSEWHERE = {"tests.studies.validation.mujoco.worker", "tests.studies.validation.vtk_films.worker"}
"""Run by an environment of their own, which has the simulator or renderer that they drive."""
STUDIES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in Path(__file__).parent.rglob("*.py")
    if not path.name.startswith(("test_", "__", "conftest"))
)


@pytest.mark.parametrize("name", [name for name in STUDIES if name not in ELSEWHERE])
def test_a_study_imports(name: str) -> None:
    assert import_module(name).__doc__
