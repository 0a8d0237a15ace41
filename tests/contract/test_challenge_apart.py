"""The fitted code cannot know what challenges are made of: neither by import nor while it runs, nor
is it shipped."""

from __future__ import annotations

import subprocess
import sys

from tests.contract.imports import PACKAGES, ROOT, imported_from, modules

FITTING = (
    "sim",
    "models",
    "measure/trajectories",
    "measure/verdict",
    "measure/forecasting",
    "measure/probes",
    "measure/inference",
    "measure/nulls",
    "measure/loop",
    "measure/report",
    "measure/closing",
    "measure/commands",
    "measure/film",
    "measure/propose",
    "measure/observables",
    "measure/cloth",
)
MODULES = modules(*FITTING)


def test_what_is_shipped_imports_nothing_of_challenges_nor_of_other_tests() -> None:
    """Not even as text that could be imported."""
    offenders = [
        str(path.relative_to(ROOT))
        for path in modules(*PACKAGES)
        if any(name.partition(".")[0] == "tests" for name in imported_from(path))
        or "tests.studies.challenge" in path.read_text(encoding="utf-8")
    ]
    assert offenders == []


def test_what_fits_needs_no_challenge_and_a_run_loads_nothing_that_makes_one() -> None:
    names = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in MODULES
        if path.parts[len(ROOT.parts)] == "measure" and path.name != "__main__.py"
    ]
    code = (
        "import sys, importlib\n"
        "class Barrier:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.startswith('tests.studies.challenge'):\n"
        "            raise ImportError(name)\n"
        "sys.meta_path.insert(0, Barrier())\n"
        f"for name in {names!r}:\n"
        "    importlib.import_module(name)\n"
        "from sim.effects import EFFECTS\n"
        "[EFFECTS[name] for name in EFFECTS]\n"
        "def loaded():\n"
        "    return sorted(name for name in sys.modules if "
        "name.startswith('tests.studies.challenge'))\n"
        "print(loaded())\n"
        "del sys.meta_path[0]\n"
        "import tests.studies.challenge.run, tests.studies.challenge.filing, "
        "tests.studies.challenge.fitter\n"
        "print(loaded())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    fitting, running = done.stdout.splitlines()
    assert fitting == "[]"
    makers = ("outside", "design", "filming", "simulation", "answer_key")
    assert not [name for name in makers if f"tests.studies.challenge.{name}" in running]
