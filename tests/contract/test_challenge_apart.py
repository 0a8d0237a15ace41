"""Whoever fits cannot know what challenges are made of: neither by import nor while it runs."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FITTING = (
    "sim", "models", "measure/observe", "measure/verdict", "measure/forecasting", "measure/probes", "measure/inference",
    "measure/nulls", "measure/loop", "measure/report", "measure/closing", "measure/propose", "measure/cases",
)  # fmt: skip
MODULES = sorted(path for part in FITTING for path in (ROOT / part).rglob("*.py"))


def imported(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_what_fits_imports_nothing_of_challenges(path: Path) -> None:
    assert not {name for name in imported(path) if name.startswith("measure.challenge")}
    assert "measure.challenge" not in path.read_text(), "not even as text that could be imported"


def test_what_fits_can_be_imported_where_challenges_cannot() -> None:
    names = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in MODULES
        if path.parts[len(ROOT.parts)] == "measure" and path.name != "__main__.py"
    ]
    code = (
        "import sys, importlib\n"
        "class Barrier:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.startswith('measure.challenge'):\n"
        "            raise ImportError(name)\n"
        "sys.meta_path.insert(0, Barrier())\n"
        f"for name in {names!r}:\n"
        "    importlib.import_module(name)\n"
        "from sim.effects import EFFECTS\n"
        "[EFFECTS[name] for name in EFFECTS]\n"
        "print(sorted(name for name in sys.modules if name.startswith('measure.challenge')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


def test_running_a_challenge_loads_nothing_that_makes_one() -> None:
    code = (
        "import sys\nimport measure.challenge.run, measure.challenge.filing, measure.challenge.fitter\n"
        "print(sorted(name for name in sys.modules if name.startswith('measure.challenge')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    kept = (
        "measure.challenge.outside",
        "measure.challenge.design",
        "measure.challenge.flight",
        "measure.challenge.key",
    )
    assert not [name for name in kept if name in done.stdout]
