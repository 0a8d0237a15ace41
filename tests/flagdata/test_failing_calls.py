"""A disk that refuses any one call of any writing command: a clear error, or, once it is published, no error at all."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from flagdata.findings import Severity
from flagdata.ingest.store import ingest_camera, ingest_wind
from flagdata.lake import Lake
from flagdata.lake.health import doctor

HERE = Path(__file__).parent
POINTS = 3
"""How many of a command's calls fail in turn, spread evenly, and the last: all of them with FLAGDATA_EVERY_CALL set."""
EVERY = bool(os.environ.get("FLAGDATA_EVERY_CALL"))

RECIPE = """
seed = 3
count = 1
batch = 1
[scene]
columns = 6
start-noise = 1e-3
[material]
name = "camel-ponte-roma"
[wind]
speed = 4.0
[time]
settle = 0.04
frames = 2
"""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A folder with a lake, a film, a log and a recipe, and the ids in the lake."""

    folder: Path
    camera: str
    wind: str


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, video: Path, wind_log: Path, write_video: Callable) -> Scene:
    folder = tmp_path_factory.mktemp("scene")
    lake = Lake.create(folder / "lake")
    camera = ingest_camera(lake, write_video(folder / "first.mp4", frames=60)).artifact.id
    wind = ingest_wind(lake, wind_log).artifact.id
    lake.branch("side")
    shutil.copyfile(video, folder / "second.mp4")
    (folder / "second.csv").write_text(wind_log.read_text().replace("+02:00,5.", "+02:00,6."))
    ingest_camera(lake, write_video(folder / "third.mp4", frames=30), branch="side")
    (folder / "small.toml").write_text(RECIPE)
    return Scene(folder=folder, camera=camera, wind=wind)


def head(folder: Path) -> object:
    return Lake.open(folder / "lake").resolve(None)


COMMANDS: dict[str, tuple[list[str], Callable[[Path], object]]] = {
    "ingest camera": (["ingest", "second.mp4"], head),
    "ingest wind": (["ingest", "second.csv"], head),
    "align": (["align", "CAMERA", "WIND", "--by", "given", "--offset", "0", "--offset-sigma", "0.1"], head),
    "merge": (["merge", "side"], head),
    "withdraw": (["withdraw", "CAMERA", "-m", "wrong"], head),
    "tag": (["tag", "v1"], lambda folder: sorted(Lake.open(folder / "lake").refs.tags())),
    "branch": (["branch", "more"], lambda folder: sorted(Lake.open(folder / "lake").refs.branches())),
    "init": (["init", "new"], lambda folder: (folder / "new" / "lake.json").exists()),
    "simulate": (["simulate", "small.toml", "--workers", "1"], head),
}
"""Command → its arguments, and what differs once it has published."""
FILES = {"second.mp4", "second.csv", "small.toml", "new"}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., dict[str, Any]]]:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        pytest.skip("calls are made to fail by a library of C that Linux loads before libc: no compiler, or no Linux")
    library = tmp_path_factory.mktemp("library") / "failing.so"
    source = HERE / "failing_calls.c"
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(source), "-ldl"], check=True)
    environment = {**os.environ, "LD_PRELOAD": str(library), "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(
        [sys.executable, str(HERE / "failing_worker.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=environment,
    ) as server:  # fmt: skip
        tasks, answers = server.stdin, server.stdout
        assert tasks is not None
        assert answers is not None

        def run(folder: Path, arguments: list[str], *, call: int, error: int, stays: bool) -> dict[str, Any]:
            task = {"arguments": arguments, "call": call, "error": error, "stays": stays, "folder": str(folder)}
            tasks.write(json.dumps(task) + "\n")
            tasks.flush()
            return json.loads(answers.readline())

        yield run
        tasks.close()


@pytest.mark.timeout(7200 if EVERY else 600)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_call_that_fails_before_publication_is_an_error_and_after_it_a_warning(
    name: str, scene: Scene, run: Callable[..., dict[str, Any]], tmp_path: Path
) -> None:
    arguments, published = COMMANDS[name]
    arguments = [{"CAMERA": scene.camera, "WIND": scene.wind}.get(word, word) for word in arguments]

    def trial(number: int, *, call: int, error: int, stays: bool) -> tuple[dict[str, Any], bool, Path]:
        folder = tmp_path / str(number)
        shutil.copytree(scene.folder, folder)
        own = [str(folder / word) if word in FILES else word for word in arguments]
        before = published(folder)
        done = run(folder, [*own, *lake_of(own, folder)], call=call, error=error, stays=stays)
        return done, published(folder) != before, folder

    whole, is_published, _ = trial(0, call=-1, error=0, stays=False)
    assert (whole["code"], is_published) == (0, True), whole["stderr"]
    total = whole["calls"]
    assert total >= 4  # written, flushed, published, the folder flushed
    calls = range(total) if EVERY else sorted({*range(0, total, -(-total // POINTS)), total - 2, total - 1})
    refused = 0
    for number, call in enumerate(calls, start=1):
        full = call % 2 == 0
        for stays in (False, True) if EVERY else (full,):
            done, is_published, folder = trial(
                2 * number + stays, call=call, error=errno.ENOSPC if stays else errno.EIO, stays=stays
            )
            what = f"call {call} of {total}, {'all later ones too' if stays else 'alone'}: {done['stderr']}"
            assert "Traceback" not in done["stderr"], what
            assert "unforeseen" not in done["stderr"], what
            assert (done["code"] == 0) == is_published, what
            if done["code"]:
                refused += 1
                assert done["code"] == 1, what
                assert "fix:" in done["stderr"], what
            if name != "init" or is_published:
                lake = Lake.open(folder / ("new" if name == "init" else "lake"))
                errors = [f for f in doctor(lake, grace=timedelta(0)) if f.severity is Severity.ERROR]
                assert errors == [], what
            shutil.rmtree(folder)
    assert refused


def lake_of(arguments: list[str], folder: Path) -> list[str]:
    """The option that names the lake, for a command that takes it."""
    return [] if arguments[0] == "init" else ["--lake", str(folder / "lake")]
