"""The house's arrows: who may import whom, read from the source, so that a lazy import inside a function counts too."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("flagdata", "sim", "models", "measure", "catalogs")
ALLOWED = {
    "flagdata": {"catalogs"},
    "sim": {"flagdata", "catalogs"},
    "models": {"flagdata", "catalogs"},
    "measure": {"flagdata", "sim", "models", "catalogs"},
    "catalogs": set(),
}
MODULES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def imported_packages(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found.add(node.module.partition(".")[0])
    return found & set(PACKAGES)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_a_module_imports_only_along_the_arrows(path: Path) -> None:
    package = path.relative_to(ROOT).parts[0]
    extra = imported_packages(path) - ALLOWED[package] - {package}
    assert not extra, f"{package} may not import {sorted(extra)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_top_level_folder_holds_something(package: str) -> None:
    contents = [p for p in (ROOT / package).rglob("*") if p.suffix in (".py", ".toml") and p.stat().st_size > 400]
    assert contents, f"{package}/ is an empty shell"


def test_help_loads_neither_torch_nor_arrow_nor_a_decoder() -> None:
    heavy = ("torch", "bpy", "pyarrow", "av", "numpy", "matplotlib", "deltalake", "zarr")
    code = (
        "import sys\nfrom flagdata.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as stop:\n    assert stop.code == 0\n"
        f"print('LOADED', sorted(set({heavy!r}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "LOADED []"


def test_the_package_runs_as_a_module() -> None:
    run = (sys.executable, "-m", "flagdata", "ingest", "--no-such-option")
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("Usage: flagdata ingest")


def test_physics_creates_no_random_generator_and_chooses_no_device() -> None:
    """Named streams and devices are chosen at the command line and handed down (style 9 and 10)."""
    offenders = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.attr}"
        for path in MODULES
        if path.relative_to(ROOT).parts[0] in ("sim", "models")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute) and node.attr in ("default_rng", "manual_seed", "is_available")
    ]
    assert not offenders
