"""What a newcomer's first answer takes: from a clean clone to a right wind on the terminal.

For each Python that is on the path, once with the plain installation and once with the physics: the
commands of docs/install.md in a new environment, the minutes that each takes, what pip downloads,
and the disk that the environment takes. The plain installation reads the wind off the example's
log, the physics off its film; an answer is right where the true wind lies in the interval, or
within the log's own resolution of the truth.

Two of the README's lines differ here: the clone is of this checkout, and the build of torch is what
the configured index offers for `torch==2.13.0` or, for a Python that it has none for, what the
extra resolves to; the sheet names it. pip's cache is off. Packages that a local index holds count
as downloaded, since a newcomer downloads them.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

PYTHONS = ("python3.11", "python3.13")
_ROOT = Path(__file__).resolve().parents[3]
_CPU_BUILD = {"python3.11": "torch==2.13.0"}
"""The build that runs without a graphics card, where the index has one."""
_DOWNLOADED = re.compile(r"Downloading \S+ \(([\d.]+) (\w+)\)")
_UNITS = {"bytes": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9}
_OF_THE_LOG = (
    "import json, flagdata; "
    "log, truth = flagdata.wind(flagdata.example('flag').log), flagdata.example('flag').truth; "
    "print(json.dumps({'wind': float(log.speed.mean()), 'true': truth['wind_speed']}))"
)
_RESOLUTION = 0.5  # m/s; the cup and the flag are seconds apart, and the log has steps of 0.1 m/s


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Commands, minutes and bytes of every Python and installation; nothing is written into
    `out`."""
    del seed, out
    return {
        python: {"light": _tried(_light, python), "physics": _tried(_physics, python)}
        if _runs(python)
        else {"left_out": f"no {python} on the path"}
        for python in PYTHONS
    }


def _tried(install: Callable[[str], dict[str, Any]], python: str) -> dict[str, Any]:
    """What an installation came to, or the message of the command that failed: that is a result,
    too."""
    try:
        return install(python)
    except RuntimeError as error:
        return {"right": False, "failed": str(error)}


def _runs(python: str) -> bool:
    found = shutil.which(python)
    return (
        found is not None
        and subprocess.run([found, "--version"], capture_output=True, check=False).returncode == 0
    )


class _Newcomer:
    """A folder with a clone and an environment, and what each command in it took."""

    def __init__(self, folder: Path, python: str) -> None:
        self.clone = folder / "flagdata"
        self.environment = self.clone / ".venv"
        self.steps: list[dict[str, Any]] = []
        self.python = python
        self._load = os.getloadavg()[0]
        self.step("git", "clone", "--quiet", str(_ROOT), str(self.clone), within=folder)
        self.step(python, "-m", "venv", ".venv")

    def step(self, *command: str, within: Path | None = None) -> str:
        """Run a command as it is typed; what it prints."""
        clean = {
            name: value
            for name, value in os.environ.items()
            if name not in {"PYTHONPATH", "VIRTUAL_ENV"}
        }
        path = os.pathsep.join([str(self.environment / "bin"), os.environ["PATH"]])
        begun = time.perf_counter()
        done = subprocess.run(
            command,
            cwd=within or self.clone,
            capture_output=True,
            text=True,
            check=False,
            env={**clean, "PATH": path, "PIP_NO_CACHE_DIR": "1"},
        )
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)}: {(done.stdout + done.stderr)[-2000:]}")
        said = " ".join(command).replace(str(_ROOT), "URL").replace(str(self.clone), "flagdata")
        self.steps.append({"command": said, "minutes": (time.perf_counter() - begun) / 60})
        return done.stdout

    def install(self, *what: str) -> None:
        """pip install, with the bytes that it downloads."""
        report = self.clone / "installed.json"
        said = self.step("pip", "install", "--report", str(report), *what)
        fetched = sum(float(number) * _UNITS[unit] for number, unit in _DOWNLOADED.findall(said))
        places = [
            urlparse(one["download_info"]["url"])
            for one in json.loads(report.read_text())["install"]
        ]
        local = [Path(unquote(place.path)) for place in places if place.scheme == "file"]
        self.steps[-1]["megabytes"] = (
            fetched + sum(one.stat().st_size for one in local if one.is_file())
        ) / 1e6
        self.steps[-1]["command"] = f"pip install {' '.join(what)}"

    def done(self, answer: dict[str, Any], *, right: bool) -> dict[str, Any]:
        """What it came to."""
        packages = json.loads(self.step("pip", "list", "--format", "json"))
        self.steps.pop()
        found = {one["name"]: one["version"] for one in packages}
        used = subprocess.run(
            ["du", "-sB1", str(self.environment)], capture_output=True, text=True, check=True
        )
        return {
            "commands": len(self.steps),
            "minutes": sum(one["minutes"] for one in self.steps),
            "megabytes_downloaded": sum(one.get("megabytes", 0.0) for one in self.steps),
            "megabytes_on_disk": int(used.stdout.split()[0]) / 1e6,
            "packages": len(set(found) - {"pip", "setuptools", "wheel"}),
            "torch": found.get("torch"),
            "python": self.step("python", "--version").split()[-1],
            "answer": answer,
            "right": right,
            "load_before": self._load,
            "steps": self.steps[:-1],
        }


def _light(python: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        newcomer = _Newcomer(Path(folder), python)
        newcomer.install(".")
        answer = json.loads(newcomer.step("python", "-c", _OF_THE_LOG))
        return newcomer.done(answer, right=abs(answer["wind"] - answer["true"]) < _RESOLUTION)


def _physics(python: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        newcomer = _Newcomer(Path(folder), python)
        wanted: Sequence[str] = (_CPU_BUILD[python],) if python in _CPU_BUILD else ()
        if wanted:
            newcomer.install(*wanted)
        newcomer.install(".[physics]")
        found = json.loads(newcomer.step("flagdata", "measure", "example:flag", "--json"))
        low, high = found["quantities"]["wind_speed"]["interval"]
        true = found["simulated_with"]["wind_speed"]
        return newcomer.done({"interval": [low, high], "true": true}, right=low <= true <= high)
