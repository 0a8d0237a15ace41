"""A tiny data set: five sequences of a coarse flag, ten films of 32 × 32 pixels; and where it is
built."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from flagdata.cli import root
from flagdata.lake import Lake
from sim.datasets import DatasetRecipe, parse
from tests import pausing
from tests.clusters import Cluster
from tests.program import invoke
from tests.small import DATA_SET, SIMULATION

WORKER = Path(__file__).with_name("build_worker.py")
Rows = dict[str, tuple[str, ...]]


@pytest.fixture(scope="session")
def recipe_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny data set's recipe beside its scene."""
    folder = tmp_path_factory.mktemp("recipe")
    (folder / "scene.toml").write_text(SIMULATION)
    (folder / "tiny.toml").write_text(DATA_SET)
    return folder / "tiny.toml"


@pytest.fixture(scope="session")
def make(recipe_file: Path) -> Callable[..., DatasetRecipe]:
    """The tiny recipe with pieces of its text replaced: old → new."""

    def made(
        replaced: dict[str, str] | None = None, *, scene: dict[str, str] | None = None
    ) -> DatasetRecipe:
        text = _replaced(DATA_SET, replaced or {})
        folder = recipe_file.parent
        if scene:
            folder = folder / str(abs(hash(tuple(scene.items()))))
            folder.mkdir(exist_ok=True)
            (folder / "scene.toml").write_text(_replaced(SIMULATION, scene))
        return parse(text, name="tiny", folder=folder, where="tiny.toml")

    return made


def _replaced(text: str, changes: dict[str, str]) -> str:
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.fixture(scope="session")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    running = Cluster(tmp_path_factory.mktemp("dask"), workers=2)
    try:
        yield running
    finally:
        running.close()


class Builds:
    """Builds through the cluster: in this process, or in processes of their own, which may be
    killed."""

    def __init__(self, cluster: Cluster, said: Path) -> None:
        self._cluster = cluster
        self._said = said

    def start(self, recipe: Path, lake: Path, *, pause: int) -> subprocess.Popen[str]:
        """`flagdata build`, which commits every two films; it waits in the first commit from
        `pause` artifacts on."""
        command = ["build", recipe, "--lake", lake, "--scheduler", self._cluster.address]
        # What it says goes to a file: nobody reads a pipe while it runs.
        with self._said.open("wb") as said:
            process = pausing.start(WORKER, pause, *command, stderr=said)
        pausing.await_pause(process)
        return process

    def finish(self, process: subprocess.Popen[str]) -> None:
        assert self._ended(process) == 0

    def build(self, recipe: Path, lake: Path | str) -> Result:
        """`flagdata build`, to its end."""
        command = ["build", str(recipe), "--lake", str(lake), "--scheduler", self._cluster.address]
        return CliRunner().invoke(root, command)

    def refused(self, process: subprocess.Popen[str]) -> str:
        """What a build says that goes on and ends without success."""
        assert self._ended(process) == 1
        return self._said.read_text()

    def _ended(self, process: subprocess.Popen[str]) -> int:
        with process:
            pausing.go_on(process)
            return process.wait(timeout=300)

    def kill(self, process: subprocess.Popen[str]) -> None:
        with process:
            process.kill()
        assert process.returncode == -signal.SIGKILL

    def rows(self, lake: Path | str) -> Rows:
        """Artifact → all of its row that does not say when it was committed, and by which code."""
        columns = [
            "artifact",
            "kind",
            "name",
            "object",
            "recipe_hash",
            "seed",
            "start",
            "parameters",
            "wind",
        ]
        rows = Lake.open(lake).rows(columns=columns).to_pylist()
        assert len({row["artifact"] for row in rows}) == len(rows)
        return {row["artifact"]: tuple(str(row[column]) for column in columns) for row in rows}


@pytest.fixture(scope="session")
def builds(cluster: Cluster, tmp_path_factory: pytest.TempPathFactory) -> Builds:
    return Builds(cluster, tmp_path_factory.mktemp("builds") / "said")


@pytest.fixture(scope="session")
def report(recipe_file: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What `flagdata build` says of the tiny data set, built without interruption by a process of
    this machine."""
    lake = tmp_path_factory.mktemp("built") / "lake"
    return invoke("build", recipe_file, "--lake", lake, "--workers", 1, "--json").document


@pytest.fixture(scope="session")
def built(report: dict[str, Any]) -> Path:
    """The lake of it."""
    return Path(report["card"]).parents[1]
