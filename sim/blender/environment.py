"""Blender's own environment: where it is, how it is made, and whether the worker can use it.

Blender's module needs one version of Python and NumPy 1. It is therefore installed apart, in a
virtual environment that holds nothing else, and flagdata's own environment knows of it only by the
path of its Python.
"""

from __future__ import annotations

import functools
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.files.caches import user_cache
from flagdata.core.shell import command_line
from flagdata.errors import ErrorKind, FlagdataError, NotFoundError

SETTING = "FLAGDATA_BLENDER"
SERIES = "4.5"
"""The last series of Blender with long-term support whose module exists for `PYTHON`."""
REQUIREMENT = "bpy==4.5.15"
PYTHON = (3, 11)
"""The only version of Python that the module is built for."""

_MARK = "flagdata-blender"
"""Name of a file in an environment that this module makes."""
_CHECK_TIMEOUT = 120.0  # s; importing Blender from a cold disk
_TAIL = 2000  # characters of a failed command's output that an error quotes
_PROBE = """
import json, os, platform, numpy, bpy
found = {"blender": bpy.app.version_string, "python": platform.python_version()}
found["numpy"] = numpy.__version__
print("\\n" + json.dumps(found), flush=True)
os._exit(0)
"""
"""Ends without Blender's own clean-up, which may hang."""
_MISSING_LIBRARY = re.compile(r"(lib[\w+-]+\.so[.\d]*): cannot open shared object file")
_DEBIAN = {
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXext.so.6": "libxext6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libxcb.so.1": "libxcb1",
}
"""The Debian package of each shared library that the module is linked to and does not bring
along."""

DEBIAN_PACKAGES = tuple(sorted(set(_DEBIAN.values())))


class BlenderError(FlagdataError):
    """Blender's environment is there, and the worker cannot use it."""

    kind = ErrorKind.BLENDER_UNUSABLE


@dataclass(frozen=True, kw_only=True)
class Environment:
    """An environment of Blender that works.

    Attributes:
        python: the path of its interpreter.
        blender, python_version, numpy: the versions in it.
    """

    python: Path
    blender: str
    python_version: str
    numpy: str


def default_folder() -> Path:
    """Returns where `flagdata blender-setup` makes the environment: `blender` in flagdata's cache
    folder."""
    return user_cache() / "blender"


def interpreter(folder: Path) -> Path:
    """Returns the Python of a virtual environment."""
    return folder / "Scripts" / "python.exe" if os.name == "nt" else folder / "bin" / "python"


def find() -> Path:
    """Finds the Python of Blender's environment: FLAGDATA_BLENDER, or that in the default folder.

    Raises:
        NotFoundError: there is none.
    """
    if chosen := os.environ.get(SETTING):
        if not Path(chosen).is_file():
            raise NotFoundError(
                f"there is no Python at {chosen}",
                where=SETTING,
                fix="set it to the Python of Blender's environment, or unset it and run flagdata "
                "blender-setup",
            )
        return Path(chosen)
    python = interpreter(default_folder())
    if not python.is_file():
        raise NotFoundError(
            "Blender is not installed",
            where=str(default_folder()),
            fix=f"make its environment with flagdata blender-setup, name one with {SETTING}, or "
            "take the renderer "
            "raster",
        )
    return python


@functools.cache
def check(python: Path) -> Environment:
    """Imports Blender with this Python, in a process of its own, and asks for its version.

    Raises:
        BlenderError: it cannot be imported, or it is of another series than `SERIES`.
    """
    try:
        done = subprocess.run(
            (str(python), "-I", "-c", _PROBE),
            capture_output=True,
            text=True,
            timeout=_CHECK_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise BlenderError(
            f"Blender could not be imported within {_CHECK_TIMEOUT:g} s",
            where=str(python),
            fix="try again on a machine that is less busy, or make the environment anew with "
            "flagdata blender-setup",
        ) from None
    except OSError as error:
        raise BlenderError(
            f"this Python cannot be run: {error.strerror}",
            where=str(python),
            fix="run flagdata blender-setup",
        ) from None
    if done.returncode:
        raise _not_importable(python, done.stderr)
    versions = json.loads(done.stdout.splitlines()[-1])
    if not versions["blender"].startswith(f"{SERIES}."):
        raise BlenderError(
            f"this is Blender {versions['blender']}, and the worker is written for {SERIES}",
            where=str(python),
            fix=f"run flagdata blender-setup, or name an environment with {REQUIREMENT} with "
            f"{SETTING}",
        )
    return Environment(
        python=python,
        blender=versions["blender"],
        python_version=versions["python"],
        numpy=versions["numpy"],
    )


def create(folder: Path, *, python: str | None = None, say: Callable[[str], None]) -> Environment:
    """Makes Blender's environment, or completes the one that is in the folder.

    Nothing but the folder is changed. pip's own settings (its index, its cache) apply.

    Args:
        folder: an empty or absent folder, or one in which this was begun before.
        python: an interpreter of Python 3.11; by default the running one, or `python3.11` of the
            search path.
        say: called with a sentence before each step that takes long.

    Raises:
        ConflictError: the folder holds something else, such as an environment for other work.
        NotFoundError: there is no Python 3.11.
        BlenderError: a step failed, or the module cannot be imported.
    """
    target = interpreter(folder)
    from flagdata.core.files.outputs import check_folder, rewrite

    if not _is_own(folder):
        check_folder(folder)
    base = _python_for_blender(python)
    say(f"making an environment in {folder}")
    rewrite(
        folder / _MARK,
        "the environment of flagdata blender-setup, which completes it when run again\n",
    )
    _run(
        (base, "-m", "venv", str(folder)),
        folder,
        fix="install Python's venv (Debian: apt-get install python3.11-venv)",
    )
    say(f"installing {REQUIREMENT}, about 1 GB on disk")
    _run(
        (
            str(target),
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            REQUIREMENT,
        ),
        folder,
        fix="see what pip said above: the index that pip is set to must offer this version for "
        "Python "
        f"{_dotted_version(PYTHON)}; delete the folder if it is of another Python",
    )
    check.cache_clear()
    return check(target)


def _is_own(folder: Path) -> bool:
    """Returns whether the environment in a folder is Blender's: marked so, or with Blender's module
    in it."""
    return (folder / _MARK).is_file() or any(folder.glob("lib/python*/site-packages/bpy"))


def _python_for_blender(requested: str | None) -> str:
    """Finds the path of a Python of version `PYTHON`."""
    for candidate in (
        (requested,)
        if requested
        else (sys.executable, f"python{_dotted_version(PYTHON)}", "python3")
    ):
        path = shutil.which(candidate)
        if path and _version(path) == PYTHON:
            return path
    raise NotFoundError(
        f"{requested or 'the running Python'} is not Python {_dotted_version(PYTHON)}, the only "
        f"version that Blender {SERIES} "
        "is built for"
        + ("" if requested else f", and the search path has no python{_dotted_version(PYTHON)}"),
        where="flagdata blender-setup",
        fix=f"install Python {_dotted_version(PYTHON)} and name it with --python",
    )


def _version(python: str) -> tuple[int, ...] | None:
    """Asks a Python for its major and minor version; None where it does not run."""
    command = (python, "-I", "-c", "import sys; print(*sys.version_info[:2])")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return tuple(int(part) for part in done.stdout.split()) if done.returncode == 0 else None


def _dotted_version(version: tuple[int, ...]) -> str:
    return ".".join(str(part) for part in version)


def _run(command: Sequence[str], folder: Path, *, fix: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        output = (done.stdout + done.stderr).strip()[-_TAIL:]
        raise BlenderError(f"{' '.join(command[1:4])} failed: {output}", where=str(folder), fix=fix)


def _not_importable(python: Path, output: str) -> BlenderError:
    """Makes the error for a module that does not import, by the last line of what Python
    printed."""
    reason = output.strip().splitlines()[-1] if output.strip() else "it said nothing"
    library = _MISSING_LIBRARY.search(reason)
    fix = "run flagdata blender-setup, which installs it"
    if library:
        fix = f"install the library {library[1]} of the system"
        if library[1] in _DEBIAN:
            fix += f"; Debian: {command_line('apt-get', 'install', *DEBIAN_PACKAGES)}"
    return BlenderError(f"Blender cannot be imported: {reason}", where=str(python), fix=fix)
