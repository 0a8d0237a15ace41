"""Programs that validations take data from, each in an environment of its own, at a fixed version.

What users run depends on none of them, and `sim` and `measure` know nothing of them. MuJoCo's
`discrete` integrator, the only one that is implicit for a flex, appeared in 4.0 and is announced to
change; the constants of a flex's stiffness changed with 4.0. Pictures by VTK change a little with
its version.

`python -m tests.studies environments NAME [FOLDER]` makes one (`make mujoco`, `make vtk`, `make
lerobot`, `make datasets`, `make pylance`). The last three hold other programs' readers: by those of
the first two, tests read what `flagdata export` writes, and by all the benchmark `peers` reads
clips; without them these skip, with the reason.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from flagdata.errors import FlagdataError, NotFoundError
from sim.blender.environment import interpreter

_ROOT = Path(__file__).resolve().parents[3]
_TIMEOUT = 60.0  # s; an import from a cold disk


class UnusableError(FlagdataError):
    """An environment is there, and it cannot be used."""

    kind = "environment-unusable"


@dataclass(frozen=True, kw_only=True)
class Environment:
    """A program's own environment.

    Attributes:
        title: of the program.
        package: that pip installs, and the target of `make` that does so.
        version: of it.
        probe: Python that prints its version.
        others: further requirements.
        python: that makes it, where the program needs another than this one.
    """

    title: str
    package: str
    version: str
    probe: str
    others: tuple[str, ...]
    python: str = sys.executable

    @property
    def setting(self) -> str:
        """Environment variable that names its Python."""
        return f"FLAGDATA_{self.package.upper()}"

    @property
    def folder(self) -> Path:
        """Where `make` puts it."""
        return _ROOT / f".venv-{self.package}"

    def find(self) -> Path:
        """Its Python, the version checked: the one of `setting`, or of `folder`.

        Raises:
            NotFoundError: there is none.
            UnusableError: the program cannot be imported by it, or it is of another version.
        """
        python = (
            Path(os.environ[self.setting])
            if self.setting in os.environ
            else interpreter(self.folder)
        )
        if not python.is_file():
            raise NotFoundError(
                f"{self.title} is not installed",
                where=str(python),
                fix=f"make its environment with make {self.package}, or name the Python of one by "
                f"{self.setting}",
            )
        done = subprocess.run(
            (str(python), "-I", "-c", self.probe),
            capture_output=True,
            text=True,
            timeout=_TIMEOUT,
            check=False,
        )
        found = done.stdout.strip()
        if done.returncode or found != self.version:
            what = f"this is {self.title} {found}, not {self.version}"
            raise UnusableError(
                done.stderr.strip()[-500:] if done.returncode else what,
                where=str(python),
                fix=f"delete the environment and run make {self.package}",
            )
        return python

    def create(self, folder: Path) -> None:
        """Make it, or complete it. pip's own settings (its index, its cache) apply.

        Raises:
            UnusableError: a step failed.
        """
        wanted = (f"{self.package}=={self.version}", *self.others)
        for command in (
            (self.python, "-m", "venv", str(folder)),
            (
                str(interpreter(folder)),
                "-m",
                "pip",
                "install",
                "--quiet",
                "--no-compile",
                "--disable-pip-version-check",
                *wanted,
            ),
        ):
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                said = (done.stdout + done.stderr).strip()[-2000:]
                raise UnusableError(
                    f"{' '.join(command[1:4])} failed: {said}",
                    where=str(folder),
                    fix=f"read its messages: the package index must offer {wanted[0]} for this "
                    "Python",
                )


MUJOCO = Environment(
    title="MuJoCo",
    package="mujoco",
    version="4.0.0",
    probe="import mujoco; print(mujoco.__version__)",
    others=("numpy>=2,<3",),
)
VTK = Environment(
    title="VTK",
    package="vtk",
    version="9.7.2",
    probe="from vtkmodules.vtkCommonCore import vtkVersion; print(vtkVersion.GetVTKVersion())",
    others=("numpy>=2,<3",),
)
LEROBOT = Environment(
    title="LeRobot",
    package="lerobot",
    version="0.6.1",
    probe="import lerobot; print(lerobot.__version__)",
    others=("torch==2.13.0", "lerobot[dataset]"),
    python="python3.12",
)
DATASETS = Environment(
    title="Hugging Face datasets",
    package="datasets",
    version="5.2.0",
    probe="import datasets; print(datasets.__version__)",
    others=("pillow", "xarray", "zarr", "netCDF4", "rerun-sdk", "pandas"),
)
LANCE = Environment(
    title="Lance",
    package="pylance",
    version="14.0.2",
    probe="import lance; print(lance.__version__)",
    others=("numpy>=2,<3", "simplejpeg"),
)
ENVIRONMENTS = {one.package: one for one in (MUJOCO, VTK, LEROBOT, DATASETS, LANCE)}

if __name__ == "__main__":
    chosen = ENVIRONMENTS[sys.argv[1]]
    chosen.create(Path(sys.argv[2]) if len(sys.argv) > 2 else chosen.folder)
