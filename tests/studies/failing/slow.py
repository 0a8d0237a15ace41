"""The commands that take long: each with a small scene, and what stands in for its computing once
it was done.

What is tried is what they read and write: for close-loop and propose a result that was computed
once is taken, after the bank was read as it is; for build the jobs that workers do are done once
and their results kept. Killed commands (`tests.studies.failing.killed`) compute all themselves.
"""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.schema import Kind
from flagdata.examples import example
from flagdata.lake import Artifact, Lake
from measure.closing import close_loop
from measure.forecasting import Calibration, Setting
from measure.loop import LoopOptions
from measure.nulls import NullBatch, null_plan
from measure.nulls import bank as banks
from measure.propose import dictionary
from measure.propose.term_search import propose
from measure.trajectories import Specimen
from measure.trajectories import experiment_recipe as recipes
from sim.cloth import handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.effects import EFFECTS
from tests.small import DATA_SET, SIMULATION, TRAINING
from tests.studies.failing.scenes import Scene, artifacts, files, rows
from tests.studies.failing.trial import Command

WIDTH, HEIGHT, RATE, SECONDS, NOISE = 0.75, 0.5, 25.0, 4.6, 5e-4
SPEEDS = (3.5, 4.3, 5.1, 6.0)
KINDS, LEVEL = 9, 0.25
"""Kinds of numerics of the bank, the fewest that a bank may have; this level can be tested by
them."""
EXPERIMENT = """
title = "tracks"
[cloth]
width = {width}
height = {height}
[material]
name = "camel-ponte-roma"
[attachment]
at = "hoist-corners"
"""
RECORDING = """
[[recording]]
source = "tracks.csv"
take = "wind-{number}"
noise = {noise}
[recording.wind]
velocity = [{speed}, 0.0, 0.0]
"""
FEW = DATA_SET.replace("3\nrenders = 7", "2\nrenders = 2").replace(
    "2\nrenders = 3", "1\nrenders = 1"
)
_LAKE = ("--lake", "{folder}/lake")


def started(folder: Path) -> None:
    """A lake that holds something already."""
    with Lake.create(folder / "lake").transaction("what must not be lost") as transaction:
        transaction.add(Artifact(kind=Kind.MARKERS, name="earlier", source_hash="0" * 64))


def loop_scene(folder: Path) -> Scene:
    """Recordings with a lift that the base model lacks, a bank of nulls, a lake; beside the folder,
    results."""
    started(folder)
    mesh = grid(width=WIDTH, height=HEIGHT, columns=8, rows=6)
    cloth = Specimen(
        mesh=mesh,
        material=named_material("camel-ponte-roma"),
        held=handles.corners(mesh.rest),
        anchors=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, HEIGHT]]),
    )
    recordings = NullBatch(
        specimen=cloth,
        markers=mesh.rest,
        rate=RATE,
        duration=SECONDS,
        noise=NOISE,
        speeds=SPEEDS,
        seed=77,
        calibrations=(Calibration(area_weight=1.1, bending=0.7, damping=1e-3),) * len(SPEEDS),
        effects=(EFFECTS["lift"](coefficient=0.6),),
    ).simulate()
    _tracks(folder / "tracks.csv", mesh.rest, [recording.positions for recording in recordings])
    parts = [RECORDING.format(number=n, noise=NOISE, speed=speed) for n, speed in enumerate(SPEEDS)]
    text = EXPERIMENT.format(width=WIDTH, height=HEIGHT) + "".join(parts)
    (folder / "tracks.toml").write_text(text)
    experiment = recipes.read(recipes.load(folder / "tracks.toml")).experiment
    banks.build(
        folder / "bank", null_plan.batches(Setting.of(experiment), kinds=KINDS, seed=0), workers=2
    )
    kept = folder.with_name(f"{folder.name}.kept")
    kept.mkdir()
    verdict = close_loop(experiment, LoopOptions(bank=folder / "bank", level=LEVEL))
    (kept / "verdict").write_bytes(pickle.dumps(verdict))
    options = null_plan.NullOptions(bank=folder / "bank", level=LEVEL)
    (kept / "outcome").write_bytes(pickle.dumps(propose(experiment, dictionary(), options=options)))
    return Scene(folder=folder, ids={"kept": str(kept)})


def _tracks(path: Path, markers: FloatArray, recordings: Sequence[FloatArray]) -> None:
    lines = ["recording,time,marker,u,v,x,y,z"]
    for number, positions in enumerate(recordings):
        for frame, at in enumerate(positions):
            for marker, ((u, v), (x, y, z)) in enumerate(zip(markers, at, strict=True)):
                lines.append(
                    f"wind-{number},{frame / RATE:.3f},m{marker},{u:.6f},{v:.6f},{x:.7f},{y:.7f},{z:.7f}"
                )
    path.write_text("\n".join(lines) + "\n")


def build_scene(folder: Path) -> Scene:
    """The recipe of a tiny data set; beside the folder, what workers make of its jobs."""
    started(folder)
    (folder / "scene.toml").write_text(SIMULATION)
    (folder / "tiny.toml").write_text(FEW)
    kept = folder.with_name(f"{folder.name}.kept")
    kept.mkdir()
    return Scene(folder=folder, ids={"kept": str(kept)})


def train_scene(folder: Path) -> Scene:
    """A lake of small films, and a recipe that learns from them."""
    from tests.models.conftest import fill

    lake = Lake.create(folder / "lake")
    fill(lake)
    (folder / "small.toml").write_text(TRAINING.replace("epochs = 3", "epochs = 1"))
    return Scene(folder=folder)


def measure_scene(folder: Path) -> Scene:
    """A small model, a film and a lake."""
    from tests.measure.estimate.conftest import FRAMES, TARGETS, pictures, write_video, written

    started(folder)
    written(folder / "model", TARGETS)
    write_video(folder / "flag.mkv", pictures(2 * FRAMES, height=40, width=56))
    return Scene(folder=folder)


def weigh_scene(folder: Path) -> Scene:
    """A flag's film, and a table of observables of a known cloth; beside the folder, what is read
    off the film."""
    started(folder)
    (folder / "flag.mp4").write_bytes(example("flag").film.read_bytes())
    seconds = np.arange(24) * 2.5
    speed = 5.0 + 1.5 * np.sin(np.arange(24) / 1.7)
    values = {"area_weight": np.array([0.2]), "gain": np.array([1.0]), "damping": np.array([0.01])}
    from tests.measure.cloth.calibration.conftest import readings

    shown = readings({**values, "azimuth": np.array([1.2])}, speed, seed=3)[0, :, :3]
    lines = [",".join(map(str, row)) for row in np.column_stack([seconds, speed, shown]).tolist()]
    (folder / "table.csv").write_text(
        "\n".join(["time,wind,droop,extension,middle-speed", *lines, ""])
    )
    kept = folder.with_name(f"{folder.name}.kept")
    kept.mkdir()
    return Scene(folder=folder, ids={"kept": str(kept)})


# What stands in for the computing. Each is called in the process from which commands are forked,
# with the folder of what was kept.


def kept_verdict(kept: str) -> None:
    """Closing the loop gives the verdict that was kept, once the bank is read."""
    import measure.closing.close

    verdict = _kept(f"{kept}/verdict")

    def closed(experiment: Any, options: Any, *, stage: Any = None) -> object:
        banks.load(options.bank, words="kept")
        return verdict

    _replace(measure.closing.close, close_loop=closed)


def kept_outcome(kept: str) -> None:
    """Proposing gives the outcome that was kept, once the bank is read."""
    import measure.propose.term_search

    outcome = _kept(f"{kept}/outcome")

    def proposed(experiment: Any, candidates: Any, *, options: Any, **others: Any) -> object:
        banks.load(options.bank, words="kept")
        return outcome

    _replace(measure.propose.term_search, propose=proposed)


def kept_jobs(kept: str) -> None:
    """What jobs of a build compute is kept by the jobs' arguments; they put it into the lake as
    they do."""
    from sim.datasets import build_jobs

    def keeping(function: Callable[..., Any]) -> Callable[..., Any]:
        def done(*arguments: Any) -> Any:
            path = Path(kept) / f"{function.__name__}-{_name(arguments)}"
            if not path.exists():
                path.write_bytes(pickle.dumps(function(*arguments)))
            return pickle.loads(path.read_bytes())

        return done

    _replace(build_jobs, simulate=keeping(build_jobs.simulate), film=keeping(build_jobs.film))


def kept_windows(kept: str) -> None:
    """What is read off a film is read once."""
    import measure.observables.watching

    plain = measure.observables.watching.watch_film

    def watched(film: Any, size: Any, **others: Any) -> object:
        path = Path(kept) / "windows"
        if not path.exists():
            path.write_bytes(pickle.dumps(plain(film, size, **others)))
        return pickle.loads(path.read_bytes())

    _replace(measure.observables.watching, watch_film=watched)


def known_flags(kept: str) -> None:
    """Simulated flags are a known function of their cloth, and few walkers weigh it."""
    from measure.cloth import MEASURED, cloth_calibration, cloth_posterior
    from tests.measure.cloth.calibration.conftest import known

    del kept
    _replace(cloth_calibration, simulated_values=known)
    _replace(cloth_calibration, measure_correction=lambda *_, **__: MEASURED)
    _replace(cloth_posterior, WALKERS=96, STEPS=300, CHECK=(32, 120))


def _replace(module: ModuleType, **others: object) -> None:
    """Puts others in place of what a module has."""
    for name, value in others.items():
        assert hasattr(module, name), f"{module.__name__} has no {name}"
        setattr(module, name, value)


def _name(arguments: Sequence[object]) -> str:
    """Of a job: names of the recipe and the film, and the members that are simulated."""
    named = [
        one if isinstance(one, list | int | str) else getattr(one, "name", "") for one in arguments
    ]
    return "".join(letter if letter.isalnum() else "-" for letter in str(named))


@cache
def _kept(path: str) -> object:
    return pickle.loads(Path(path).read_bytes())


def proposal(folder: Path) -> frozenset[object]:
    """The effect's files, and the proposal log: a command that was killed after its entry adds it
    once more."""
    log = folder / "out" / "proposal" / "proposals.json"
    entries = json.loads(log.read_text())["entries"] if log.exists() else []
    written = {entry for entry in files("out")(folder) if "proposals.json" not in str(entry)}
    return frozenset(written | {json.dumps(entry).replace(str(folder), "") for entry in entries})


LOOP = {
    "close-loop": Command(
        arguments=(
            "close-loop",
            "{folder}/tracks.toml",
            "--bank",
            "{folder}/bank",
            "--level",
            str(LEVEL),
            "--workers",
            "1",
            "--out",
            "{folder}/out",
            *_LAKE,
        ),
        state=lambda folder: rows(folder) | files("out")(folder),
        stand_in="tests.studies.failing.slow:kept_verdict",
        one_step=False,
    ),
    "propose": Command(
        arguments=(
            "propose",
            "{folder}/tracks.toml",
            "--bank",
            "{folder}/bank",
            "--level",
            str(LEVEL),
            "--workers",
            "1",
            "--out",
            "{folder}/out",
            *_LAKE,
        ),
        state=proposal,
        stand_in="tests.studies.failing.slow:kept_outcome",
        one_step=False,
    ),
}
BUILD = {
    "build": Command(
        arguments=("build", "{folder}/tiny.toml", "--workers", "1", *_LAKE),
        state=rows,
        stand_in="tests.studies.failing.slow:kept_jobs",
        one_step=False,
    ),
}
TRAIN = {
    "train": Command(
        arguments=("train", "{folder}/small.toml", "--workers", "1", *_LAKE), state=artifacts
    ),
}
MEASURE = {
    "measure": Command(
        arguments=(
            "measure",
            "{folder}/flag.mkv",
            "--flag-size",
            "1.5x1.0",
            "--model",
            "{folder}/model",
            "--anyway",
            "--report",
            "{folder}/report.html",
            "--zarr",
            "{folder}/answer.zarr",
            *_LAKE,
        ),
        state=rows,
    ),
}
WEIGH = {
    "observe": Command(
        arguments=("observe", "{folder}/flag.mp4", "--flag-size", "1.5x1.0", *_LAKE),
        state=artifacts,
        stand_in="tests.studies.failing.slow:kept_windows",
    ),
    "calibrate": Command(
        arguments=(
            "calibrate",
            "{folder}/table.csv",
            "--flag-size",
            "1.5x1.0",
            "--azimuth",
            "70±7",
            *_LAKE,
        ),
        state=artifacts,
        stand_in="tests.studies.failing.slow:known_flags",
    ),
}
SCENES = {
    "train": (train_scene, TRAIN),
    "measure": (measure_scene, MEASURE),
    "build": (build_scene, BUILD),
    "loop": (loop_scene, LOOP),
    "weigh": (weigh_scene, WEIGH),
}
"""Scenes, each with its commands."""
