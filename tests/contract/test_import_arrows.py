"""Which package may import which, read from the source, so that a lazy import inside a function
counts too."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.contract.imports import PACKAGES, ROOT, imported_from, modules, tree

ALLOWED = {
    "flagdata": {"catalogs"},
    "sim": {"flagdata", "catalogs"},
    "models": {"flagdata", "catalogs"},
    "measure": {"flagdata", "sim", "models", "catalogs"},
    "catalogs": set[str](),
}


def test_a_module_imports_only_along_the_arrows() -> None:
    offenders = {
        str(path.relative_to(ROOT)): extra
        for package in PACKAGES
        for path in modules(package)
        if (extra := packages(path) - ALLOWED[package] - {package})
    }
    assert offenders == {}


def packages(path: Path) -> set[str]:
    return {name.partition(".")[0] for name in imported_from(path)} & set(PACKAGES)


def test_every_top_level_folder_holds_something() -> None:
    files = {
        package: [p for p in (ROOT / package).rglob("*") if p.suffix in (".py", ".toml")]
        for package in PACKAGES
    }
    assert [
        package for package in PACKAGES if not any(p.stat().st_size > 400 for p in files[package])
    ] == []


def test_help_loads_neither_torch_nor_arrow_nor_a_decoder() -> None:
    heavy = ("torch", "bpy", "pyarrow", "av", "numpy", "matplotlib", "deltalake", "zarr")
    code = (
        "import sys\nfrom flagdata.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as stop:\n    assert stop.code == 0\n"
        f"print('LOADED', sorted(set({heavy!r}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "LOADED []"


@pytest.mark.parametrize(
    "arguments",
    [
        ("measure", "missing.mp4"),
        ("observe", "missing.mp4", "--flag-size", "1.5x1.0"),
        ("calibrate", "missing.csv", "--flag-size", "1.5x1.0"),
    ],
)
def test_a_file_that_is_missing_is_reported_before_anything_heavy_is_loaded(
    arguments: tuple[str, ...],
) -> None:
    heavy = ("torch", "scipy", "cv2", "pyarrow", "av", "deltalake")
    code = (
        f"import sys\nfrom flagdata.cli import main\ntry:\n    main({list(arguments)!r})\nexcept "
        "SystemExit as stop:\n"
        f"    print(stop.code, sorted(set({heavy!r}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "1 []\n"
    assert f"there is no file '{arguments[1]}', and no lake was named" in done.stderr


def test_a_measurement_loads_neither_torchs_compiler_nor_what_only_other_commands_need() -> None:
    """Each of these takes as long to load as a tenth of a film takes to measure, or more."""
    heavy = (
        "torch._dynamo",
        "sympy",
        "pandas",
        "sklearn",
        "scipy.stats",
        "scipy.optimize",
        "sim",
        "matplotlib",
        "zarr",
    )
    code = (
        "import sys\nfrom measure.measuring_model import network\n"
        "from measure.commands import measure, measurement_artifact\n"
        "from measure.estimate import film_measuring as measuring, wind_by_window as series\n"
        "network(None, lake=None, at=None)\n"
        f"print('LOADED', sorted(set({heavy!r}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "LOADED []"


def test_a_record_and_the_lake_know_nothing_of_the_readers_of_logs() -> None:
    offenders = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in modules("flagdata/record", "flagdata/lake")
        for name in imported_from(path)
        if name.startswith("flagdata.ingest")
    ]
    assert not offenders


def test_the_package_runs_as_a_module() -> None:
    run = (sys.executable, "-m", "flagdata", "ingest", "--no-such-option")
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("Usage: flagdata ingest")


def test_physics_creates_no_random_generator_and_chooses_no_device() -> None:
    """Named streams and devices are chosen at the command line and handed down (style 9 and 10)."""
    offenders = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.attr}"
        for path in modules("sim", "models")
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Attribute)
        and node.attr in ("default_rng", "manual_seed", "is_available")
    ]
    assert not offenders
