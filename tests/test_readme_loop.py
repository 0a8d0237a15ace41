"""The README's commands of closing the loop run: they read what they say, and write the report, the models, the lake.

The inference between is replaced by a made-up verdict: it takes minutes, and has tests of its own.
"""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.cli import main
from flagdata.ingest.meshes import write_folder
from flagdata.lake import Lake
from flagdata.lake.meshes import MeshSequence
from flagdata.schema import Kind
from measure.demo.tracked import TrackedRecipe, make_tracks
from measure.loop.verdict import Conclusion, Estimate, Parameter, Verdict
from measure.observe.trajectory import Experiment
from sim.mesh import grid
from tests.measure.observe.flags import HEIGHT, WIDTH, flutter
from tests.measure.report.verdicts import Size, verdict
from tests.test_readme import OF_THE_LOOP, commands

COMMANDS = [command for command in commands() if command.startswith(OF_THE_LOOP)]
SPEEDS = (4.0, 6.0)


def arcsim_run(path: Path, speed: float) -> None:
    """An output folder of 2.4 s, held all along its hoist."""
    mesh = grid(width=WIDTH, height=HEIGHT, columns=9, rows=6)
    times = np.arange(60) / 25
    positions = flutter(mesh.rest, times)
    sequence = MeshSequence(
        time=np.round(times * 1e9).astype(np.int64), positions=positions.astype(np.float32),
        faces=mesh.faces.astype(np.int32), rest=mesh.rest.astype(np.float32), attributes={},
    )  # fmt: skip
    scene = {
        "frame_time": 0.04, "frame_steps": 8, "gravity": [0, 0, -9.81],
        "cloths": [{"mesh": "flag.obj", "materials": [{"data": "materials/camel-ponte-roma.json"}]}],
        "handles": [{"nodes": np.flatnonzero(mesh.rest[:, 0] == 0).tolist()}],
        "wind": {"density": 1.0, "velocity": [speed, 0, 0], "drag": 0.0},
    }  # fmt: skip
    write_folder(path, sequence, scene=scene)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands find: the demonstration's flag, shorter; two runs of ArcSim; a log."""
    path = tmp_path_factory.mktemp("loop")
    recipe = TrackedRecipe(seed=5, speeds=SPEEDS, duration=5.0, settle=0.4)
    make_tracks(recipe, path, advance=lambda count: None)
    for speed, name in zip((4.0, 8.0), ("run-4ms", "run-8ms"), strict=True):
        arcsim_run(path / name, speed)
    stamps = (f"2026-05-14T09:30:{second:02d}Z,{5 + 0.3 * (second % 3):.1f}" for second in range(12))
    (path / "anemometer.csv").write_text("\n".join(["time,wind_speed", *stamps]) + "\n", encoding="utf-8")
    Lake.create(path / "lake")
    return path


def concluded() -> Verdict:
    """That lift acts, with the parameters that closing the loop reports."""
    values = {"density": 1.0, "bending": 0.8, "damping": 0.002}
    parameters = tuple(
        Parameter(name=name, before=one, after=one, shift=0.0)
        for name, one in ((n, Estimate(value=v, low=0.9 * v, high=1.1 * v, unit="1")) for n, v in values.items())
    )
    return replace(verdict(Conclusion.EFFECT, Size(across=3, up=3, frames=20, stretch=2)), parameters=parameters)


def test_every_command_of_closing_the_loop_runs(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    judged: list[Experiment] = []

    def instead(experiment: Experiment, *_: object, **__: object) -> Verdict:
        judged.append(experiment)
        return concluded()

    monkeypatch.setattr("measure.loop.close.close_loop", instead)
    monkeypatch.chdir(folder)
    assert len(COMMANDS) == 4
    for command in COMMANDS:
        with pytest.raises(SystemExit) as ended:
            main(shlex.split(command)[1:])
        assert ended.value.code == 0, (command, capsys.readouterr().err)
    speeds = [[round(r.wind.speed, 1) for r in experiment.recordings] for experiment in judged]
    assert speeds == [[4.0, 6.0], [4.0, 8.0], [5.3, 5.3]]
    assert all((folder / "loop" / name).exists() for name in ("report.html", "verdict.json", "base.toml", "model.toml"))
    kinds = [row["kind"] for row in Lake.open(folder / "lake").rows().to_pylist()]
    assert sorted(kinds) == sorted([Kind.MEASUREMENT, Kind.MODEL, Kind.MODEL, Kind.MESHES])
