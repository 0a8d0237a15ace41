"""Blender's environment: how it is found, made and checked; what the worker brings into it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from flagdata.errors import ConflictError, NotFoundError
from sim.blender import environment, launch
from sim.blender.blender_setup import blender_setup
from sim.blender.environment import BlenderError

ROOT = Path(__file__).resolve().parents[3]
WORKING = {"blender": "4.5.15 LTS", "python": "3.11.2", "numpy": "1.26.4"}


@pytest.fixture(autouse=True)
def no_blender(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(environment.SETTING, raising=False)
    monkeypatch.setenv("FLAGDATA_CACHE", str(tmp_path / "cache"))


def interpreter(path: Path, *, out: str = "", err: str = "", code: int = 0) -> Path:
    """A program in Python's place that prints `out` and `err`, whatever it is asked."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".out").write_text(out)
    path.with_suffix(".err").write_text(err)
    path.write_text(
        f'#!/bin/sh\ncat "{path.with_suffix(".out")}"\ncat "{path.with_suffix(".err")}" >&2\nexit '
        f"{code}\n"
    )
    path.chmod(0o755)
    return path


def wheel(folder: Path, name: str, version: str, source: str, *needs: str) -> None:
    """A package of one file, as pip installs it."""
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as archive:
        info = f"{name}-{version}.dist-info"
        archive.writestr(f"{name}/__init__.py", source)
        needed = "".join(f"Requires-Dist: {need}\n" for need in needs)
        archive.writestr(
            f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needed}"
        )
        archive.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr(f"{info}/RECORD", "")


def test_the_setting_goes_before_the_default_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    default = interpreter(tmp_path / "cache" / "blender" / "bin" / "python")
    assert environment.find() == default
    chosen = interpreter(tmp_path / "other")
    monkeypatch.setenv(environment.SETTING, str(chosen))
    assert environment.find() == chosen


def test_a_setting_that_names_no_file_is_refused_and_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interpreter(tmp_path / "cache" / "blender" / "bin" / "python")
    monkeypatch.setenv(environment.SETTING, str(tmp_path / "absent"))
    with pytest.raises(NotFoundError, match="FLAGDATA_BLENDER: there is no Python at"):
        environment.find()


def test_what_blender_prints_before_its_version_is_passed_over(tmp_path: Path) -> None:
    python = interpreter(
        tmp_path / "python", out="Read prefs: userpref.blend\n\n" + json.dumps(WORKING) + "\n"
    )
    found = environment.check(python)
    assert (found.python, found.blender, found.numpy) == (python, "4.5.15 LTS", "1.26.4")


def test_another_series_of_blender_is_refused_by_its_version(tmp_path: Path) -> None:
    python = interpreter(tmp_path / "python", out=json.dumps({**WORKING, "blender": "4.2.23 LTS"}))
    with pytest.raises(BlenderError, match=r"this is Blender 4\.2\.23 LTS"):
        environment.check(python)


@pytest.mark.parametrize(
    ("said", "fix"),
    [
        ("ModuleNotFoundError: No module named 'bpy'", "flagdata blender-setup"),
        (
            "ImportError: libXi.so.6: cannot open shared object file: No such file or directory",
            " libxi6 ",
        ),
        (
            "ImportError: libnew.so.1: cannot open shared object file: No such file or directory",
            "library libnew.so.1",
        ),
    ],
)
def test_a_module_that_does_not_import_is_an_error_with_its_reason(
    tmp_path: Path, said: str, fix: str
) -> None:
    python = interpreter(
        tmp_path / "python", err=f"Traceback (most recent call last):\n{said}\n", code=1
    )
    with pytest.raises(BlenderError) as error:
        environment.check(python)
    assert said in error.value.what
    assert fix in f"{error.value.fix} "


def test_a_file_that_is_no_program_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "python").write_text("no program")
    with pytest.raises(BlenderError, match="cannot be run"):
        environment.check(tmp_path / "python")


@pytest.mark.parametrize("name", ["mine.txt", "pyvenv.cfg"])
def test_a_folder_of_other_files_and_an_environment_for_other_work_are_left_alone(
    name: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(ConflictError, match="exists"):
        environment.create(tmp_path, say=print)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_an_environment_that_was_begun_or_has_blender_in_it_is_completed(tmp_path: Path) -> None:
    """What says so: the search for a Python is reached, and finds none of this name."""
    (tmp_path / "begun").mkdir()
    (tmp_path / "begun" / "flagdata-blender").touch()
    (tmp_path / "older" / "lib" / "python3.11" / "site-packages" / "bpy").mkdir(parents=True)
    for folder in ("begun", "older"):
        with pytest.raises(NotFoundError, match="python-of-no-machine"):
            environment.create(tmp_path / folder, python="python-of-no-machine", say=print)


def test_blender_is_made_with_no_other_python_than_its_own(tmp_path: Path) -> None:
    other = interpreter(tmp_path / "python", out="3 13\n")
    with pytest.raises(NotFoundError, match=r"is not Python 3\.11"):
        environment.create(tmp_path / "made", python=str(other), say=print)
    assert not (tmp_path / "made").exists()


@pytest.mark.skipif(
    sys.version_info[:2] != environment.PYTHON, reason="needs Python 3.11, as Blender's module does"
)
def test_the_command_makes_an_environment_that_is_then_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shelf = tmp_path / "shelf"
    shelf.mkdir()
    wheel(
        shelf,
        "bpy",
        "4.5.15",
        "import numpy\nclass app:\n    version_string = '4.5.15 LTS'\n",
        "numpy",
    )
    wheel(shelf, "numpy", "1.26.4", "__version__ = '1.26.4'\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(shelf))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    ran = CliRunner().invoke(blender_setup, ["--json"], catch_exceptions=False)
    assert json.loads(ran.stdout)["blender"] == "4.5.15 LTS"
    ran = CliRunner().invoke(blender_setup, ["--check"], catch_exceptions=False)
    assert ran.stdout.startswith("Blender 4.5.15 LTS, Python 3.11.")
    assert str(environment.default_folder()) in ran.stdout


def test_a_step_that_fails_reports_pips_message(tmp_path: Path) -> None:
    pip = interpreter(
        tmp_path / "pip", err="ERROR: No matching distribution found for bpy==4.5.15\n", code=1
    )
    base = tmp_path / "python"
    base.write_text(
        f'#!/bin/sh\n[ "$2" = venv ] && mkdir -p "$3/bin" && cp {pip} "$3/bin/python"\necho 3 11\n'
    )
    base.chmod(0o755)
    with pytest.raises(BlenderError, match=r"No matching distribution found for bpy==4\.5\.15"):
        environment.create(tmp_path / "made", python=str(base), say=print)


def test_the_worker_needs_nothing_but_numpy_and_the_standard_library() -> None:
    code = f"""
import sys
sys.path.insert(0, {str(ROOT / "sim" / "blender")!r})
import launch
before = set(sys.modules)
for name in launch.PACKAGES:
    launch.expose(name, __import__("pathlib").Path({str(ROOT)!r}))
import sim.blender.worker
loaded = {{name.partition(".")[0] for name in set(sys.modules) - before}}
print(*sorted(loaded - sys.stdlib_module_names))
"""
    done = subprocess.run(
        (sys.executable, "-I", "-c", code), capture_output=True, text=True, check=True
    )
    cython = {"cython_runtime"} | {
        name for name in done.stdout.split() if name.startswith("_cython_")
    }  # numpy 1's own
    assert set(done.stdout.split()) - cython == {"flagdata", "numpy", "sim"}


def test_only_the_named_packages_of_a_folder_become_importable(tmp_path: Path) -> None:
    for name in ("wanted", "beside"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("")
    (tmp_path / "wanted" / "inner.py").write_text("VALUE = 7\n")
    code = f"""
import importlib.util, sys
sys.path.insert(0, {str(Path(launch.__file__).parent)!r})
import launch
launch.expose("wanted", __import__("pathlib").Path({str(tmp_path)!r}))
import wanted.inner
print(wanted.inner.VALUE, importlib.util.find_spec("beside"))
"""
    done = subprocess.run(
        (sys.executable, "-I", "-c", code), capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["7", "None"]
