"""The built wheel holds what an installation needs: every tracked file of the packages, and nothing
besides."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NO_DEFAULTS = ("models/shipped/flow/", "models/shipped/flow-world/", "models/shipped/wave/")
"""Networks that measure nothing by default: a checkout has them."""
DATA = (".safetensors", ".mp4")
LARGEST_DATA = 4 << 20  # B
LARGEST = 25 << 18  # B, with the code
PACKAGES = ("flagdata", "sim", "models", "measure", "catalogs")


def tracked(*folders: str) -> list[str]:
    """Files under version control that are there, as paths from the root."""
    listed = subprocess.run(
        ("git", "ls-files", "-z", *folders), cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip(f"not a checkout: {listed.stderr.strip()}")
    return [name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def copy_tracked(target: Path) -> None:
    """Copy what a build reads."""
    for name in tracked(*PACKAGES, "pyproject.toml", "README.md", "LICENSE"):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, target / name)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """Built from a copy of the tracked files, with data files of models beside them."""
    source, made = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    copy_tracked(source)
    for name in ("weights.safetensors", "card.json", "recipe.toml"):
        (source / "models" / "trained").mkdir(exist_ok=True)
        (source / "models" / "trained" / name).write_bytes(b"")
    subprocess.run(
        (
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--quiet",
            "--no-deps",
            "--no-build-isolation",
            "-w",
            made,
            source,
        ),
        check=True,
        capture_output=True,
    )
    return zipfile.ZipFile(next(made.glob("flagdata-*.whl")))


def test_the_wheel_holds_the_tracked_files_of_the_packages_and_no_others(
    wheel: zipfile.ZipFile,
) -> None:
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    models = {
        f"models/trained/{name}" for name in ("weights.safetensors", "card.json", "recipe.toml")
    }
    wanted = {name for name in tracked(*PACKAGES) if not name.startswith(NO_DEFAULTS)} | models
    inside = {
        name if name.startswith("flagdata/") else f"flagdata/_packages/{name}" for name in wanted
    }
    assert held == inside | {"flagdata/_packages/__init__.py"}


def test_the_wheel_is_small(wheel: zipfile.ZipFile) -> None:
    assert wheel.filename is not None
    assert (
        sum(part.compress_size for part in wheel.infolist() if part.filename.endswith(DATA))
        <= LARGEST_DATA
    )
    assert Path(wheel.filename).stat().st_size <= LARGEST


def test_the_wheel_names_its_pythons_and_binds_no_one_to_blender(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    metadata = Parser().parsestr(wheel.read(name).decode())
    assert metadata["Requires-Python"] == "<3.15,>=3.11"
    assert not [need for need in metadata.get_all("Requires-Dist", []) if need.startswith("bpy")]


@pytest.mark.parametrize("constraints", ["constraints.txt", "constraints-oldest.txt"])
def test_every_dependency_has_a_version_in_both_sets(constraints: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [need for extra in project["optional-dependencies"].values() for need in extra]
    needed = [
        need for need in [*project["dependencies"], *extras] if not need.startswith("flagdata[")
    ]
    names = {plain(need) for need in needed} - {"torch"}  # the Makefile chooses between its builds
    lines = (ROOT / constraints).read_text().splitlines()
    assert names <= {plain(line) for line in lines if not line.startswith("#")}


def plain(requirement: str) -> str:
    """A requirement's name, as package indexes compare them."""
    name = requirement
    for end in "[<>=; ":
        name = name.partition(end)[0]
    return name.lower().replace("_", "-")


MINE = "VALUE = 'mine'\n"
SCRIPT = """
import json
from importlib import import_module
import catalogs, measure, models, sim
import flagdata
import flagdata.extend
from flagdata.cli import main
flags = flagdata.simulate(
    scene={"columns": 4}, wind={"speed": 3.0}, time={"settle": 0.0, "frames": 2},
    effects={"lift": {"coefficient": 1.0}},
)
own = import_module("flagdata._packages.sim.effects.effect_files").load("own.py:Denser")
film = flagdata.render(flags[0], width=32, height=32, parameters={"raster_samples": 1})
try:
    flagdata.measure(film)
except flagdata.errors.FlagdataError as error:
    kind = error.kind
try:
    main(["calibrate", "--help"])
except SystemExit as end:
    code = end.code
print(json.dumps({
    "mine": [module.VALUE for module in (catalogs, measure, models, sim)], "frames": flags.positions.shape[1],
    "film": len(film), "kind": kind, "code": code, "own": list(own.strengths()), "from": flagdata.__file__,
    "public": [name for name in dir(flagdata.extend) if getattr(flagdata.extend, name) is None],
}))
"""
OWN_EFFECT = """
from dataclasses import dataclass
from typing import Annotated

from sim.effects.effect import PressureEffect
from sim.effects.parameter import Value, strength


@dataclass(frozen=True, kw_only=True)
class Denser(PressureEffect):
    change: Annotated[Value, strength(unit="1", prior=(-0.2, 0.3), admissible=(-1.0, 9.0), source="made")] = 0.0

    def factor(self, density, across):
        return across.new_tensor(1.0) + self.change
"""


EDITABLE = """
import sys
from importlib.machinery import PathFinder
from importlib.util import spec_from_file_location
from pathlib import Path
class Editable:
    def find_spec(self, name, path, target=None):
        if name in {packages!r}:
            return spec_from_file_location(name, Path({root!r}) / name / "__init__.py")
sys.meta_path.insert(sys.meta_path.index(PathFinder) + 1, Editable())
"""
"""What an editable installation leaves behind: a finder that is asked after the folders of
`sys.path`."""


@pytest.mark.parametrize("installation", ["wheel", "checkout", "editable"])
def test_a_users_own_files_of_the_packages_names_neither_break_an_installation_nor_are_shadowed(
    installation: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    site, home = tmp_path / "site", tmp_path / "home"
    if installation == "wheel":
        request.getfixturevalue("wheel").extractall(site)
    elif installation == "editable":
        site.mkdir()
        (site / "sitecustomize.py").write_text(EDITABLE.format(packages=PACKAGES, root=str(ROOT)))
    for name in ("catalogs.py", "measure.py", "sim.py", "models/__init__.py"):
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(MINE)
    (home / "script.py").write_text(SCRIPT)
    (home / "own.py").write_text(OWN_EFFECT)
    done = subprocess.run(
        [sys.executable, "script.py"],
        cwd=home,
        env={**os.environ, "PYTHONPATH": str(ROOT if installation == "checkout" else site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["mine"] == ["mine"] * 4
    assert Path(found["from"]).is_relative_to(site if installation == "wheel" else ROOT)
    assert (found["frames"], found["film"], found["kind"], found["code"]) == (2, 2, "bad-input", 0)
    assert (found["own"], found["public"]) == (["change"], [])


def test_a_script_and_a_folder_of_weights_may_have_the_name_of_a_package_of_an_editable_installation(
    tmp_path: Path,
) -> None:
    """An import of its name would find the script itself, and a folder that holds no module hides a
    package."""
    site, home = tmp_path / "site", tmp_path / "home"
    site.mkdir()
    (site / "sitecustomize.py").write_text(EDITABLE.format(packages=PACKAGES, root=str(ROOT)))
    (home / "models").mkdir(parents=True)
    (home / "sim.py").write_text("from flagdata.cli import main\nmain(['catalog', 'models'])\n")
    done = subprocess.run(
        [sys.executable, "sim.py"],
        cwd=home,
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, "flow-outdoor" in done.stdout) == (0, True), done.stderr


def test_a_checkout_keeps_its_names_where_no_file_of_a_user_has_one(tmp_path: Path) -> None:
    code = (
        "import sys, flagdata, sim.effects; print('flagdata._packages' in sys.modules, "
        "sim.effects.__name__)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["False", "sim.effects"]


BUILD = "import sys; from setuptools.build_meta import build_editable; build_editable(sys.argv[1])"


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone, in a folder of its own."""
    folder = tmp_path_factory.mktemp("beside") / "flagdata"
    copy_tracked(folder)
    return folder


@pytest.fixture(scope="module")
def editable(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """What an installation of the clone, to be edited, adds to the path of modules."""
    made = tmp_path_factory.mktemp("editable")
    subprocess.run([sys.executable, "-c", BUILD, made], cwd=clone, check=True, capture_output=True)
    (built,) = (zipfile.ZipFile(path) for path in made.glob("flagdata-*.whl"))
    (line,) = (built.read(name).decode() for name in built.namelist() if name.endswith(".pth"))
    return line.strip()


@pytest.mark.parametrize("installation", ["wheel", "editable"])
def test_a_clone_beside_a_script_does_not_shadow_the_installation(
    installation: str, clone: Path, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """The clone's folder is called flagdata and holds no code itself; an installation that is not
    on the path of modules comes after it."""
    site = tmp_path / "site"
    if installation == "wheel":
        request.getfixturevalue("wheel").extractall(site)
    else:
        site = Path(request.getfixturevalue("editable"))
    script = clone.parent / "script.py"
    script.write_text("import flagdata\nprint(flagdata.__file__, flagdata.measure.__name__)\n")
    done = subprocess.run(
        [sys.executable, script.name],
        cwd=clone.parent,
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == [str(site / "flagdata" / "__init__.py"), "measure"], done.stderr
