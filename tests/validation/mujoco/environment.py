"""MuJoCo's own environment: where it is, how it is made (`make mujoco`), and whether it holds the right version.

MuJoCo's `discrete` integrator, the only one that is implicit for a flex, appeared in 4.0 and is announced to change;
the constants of a flex's stiffness changed with 4.0. The version is therefore fixed, in an environment of its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from flagdata.errors import FlagdataError, NotFoundError
from sim.blender.environment import interpreter

SETTING = "FLAGDATA_MUJOCO"
VERSION = "4.0.0"
REQUIREMENTS = (f"mujoco=={VERSION}", "numpy>=2,<3")
FOLDER = Path(__file__).resolve().parents[3] / ".venv-mujoco"
_TIMEOUT = 60.0  # s; an import from a cold disk
_PROBE = "import mujoco; print(mujoco.__version__)"


class MujocoError(FlagdataError):
    """MuJoCo's environment is there, and it cannot be used."""

    kind = "mujoco-unusable"


def find() -> Path:
    """The Python of MuJoCo's environment, its version checked: FLAGDATA_MUJOCO, or that of `.venv-mujoco`.

    Raises:
        NotFoundError: there is none.
        MujocoError: MuJoCo cannot be imported by it, or it is of another version.
    """
    python = Path(os.environ[SETTING]) if SETTING in os.environ else interpreter(FOLDER)
    if not python.is_file():
        raise NotFoundError(
            "MuJoCo is not installed", where=str(python),
            fix=f"make its environment with make mujoco, or name the Python of one by {SETTING}",
        )  # fmt: skip
    done = subprocess.run(
        (str(python), "-I", "-c", _PROBE), capture_output=True, text=True, timeout=_TIMEOUT, check=False
    )
    found = done.stdout.strip()
    if done.returncode or found != VERSION:
        what = f"this is MuJoCo {found}, not {VERSION}" if not done.returncode else done.stderr.strip()[-500:]
        raise MujocoError(what, where=str(python), fix="delete the environment and run make mujoco")
    return python


def create(folder: Path) -> None:
    """Make the environment, or complete it. pip's own settings (its index, its cache) apply.

    Raises:
        MujocoError: a step failed.
    """
    for command in (
        (sys.executable, "-m", "venv", str(folder)),
        (str(interpreter(folder)), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *REQUIREMENTS),
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            said = (done.stdout + done.stderr).strip()[-2000:]
            raise MujocoError(
                f"{' '.join(command[1:4])} failed: {said}", where=str(folder),
                fix=f"read its messages: the package index must offer {REQUIREMENTS[0]} for this Python",
            )  # fmt: skip


if __name__ == "__main__":
    create(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
