"""The built wheel holds what an installation needs: every tracked file of the packages, and nothing besides."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SUPERSEDED = ("models/shipped/flow/", "models/shipped/wave/")
"""Networks that others took the place of."""
LARGEST = 6e6  # B
PACKAGES = ("flagdata", "sim", "models", "measure", "catalogs")


def tracked(*folders: str) -> list[str]:
    """Files under version control that are there, as paths from the root."""
    listed = subprocess.run(("git", "ls-files", "-z", *folders), cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip(f"not a checkout: {listed.stderr.strip()}")
    return [name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """Built from a copy of the tracked files, with data files of models beside them."""
    source, made = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in tracked(*PACKAGES, "pyproject.toml", "README.md", "LICENSE"):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    for name in ("weights.safetensors", "card.json", "recipe.toml"):
        (source / "models" / "trained").mkdir(exist_ok=True)
        (source / "models" / "trained" / name).write_bytes(b"")
    subprocess.run(
        (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", made, source),
        check=True, capture_output=True,
    )  # fmt: skip
    return zipfile.ZipFile(next(made.glob("flagdata-*.whl")))


def test_the_wheel_holds_the_tracked_files_of_the_packages_and_no_others(wheel: zipfile.ZipFile) -> None:
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    models = {f"models/trained/{name}" for name in ("weights.safetensors", "card.json", "recipe.toml")}
    assert held == {name for name in tracked(*PACKAGES) if not name.startswith(SUPERSEDED)} | models


def test_the_wheel_is_small(wheel: zipfile.ZipFile) -> None:
    assert wheel.filename is not None
    assert Path(wheel.filename).stat().st_size <= LARGEST


def test_the_wheel_names_its_pythons_and_binds_no_one_to_blender(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    metadata = Parser().parsestr(wheel.read(name).decode())
    assert metadata["Requires-Python"] == "<3.14,>=3.11"
    assert not [need for need in metadata.get_all("Requires-Dist", []) if need.startswith("bpy")]


@pytest.mark.parametrize("constraints", ["constraints.txt", "constraints-oldest.txt"])
def test_every_dependency_has_a_version_in_both_sets(constraints: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [need for extra in project["optional-dependencies"].values() for need in extra]
    needed = [need for need in [*project["dependencies"], *extras] if not need.startswith("flagdata[")]
    names = {plain(need) for need in needed} - {"torch"}  # the Makefile chooses between its builds
    lines = (ROOT / constraints).read_text().splitlines()
    assert names <= {plain(line) for line in lines if not line.startswith("#")}


def plain(requirement: str) -> str:
    """A requirement's name, as package indexes compare them."""
    name = requirement
    for end in "[<>=; ":
        name = name.partition(end)[0]
    return name.lower().replace("_", "-")
