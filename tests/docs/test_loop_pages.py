"""The commands of the pages about the loop run: they read what they say, and write the report, the
models, the lake.

The inference between is replaced by a made-up verdict or outcome: it takes minutes, and has tests
of its own.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.answer import Quantity
from flagdata.core.schema import Kind
from flagdata.ingest import write_folder
from flagdata.lake import Lake, MeshSequence
from measure.demo import TrackedRecipe, make_tracks
from measure.nulls import NullBatch
from measure.nulls.bank import build
from measure.propose import Decision, ProposalOutcome
from measure.propose.proposal_log import entries
from measure.trajectories import Experiment, load
from measure.verdict import Conclusion, Parameter, Verdict
from sim.cloth.mesh import grid
from tests.docs.pages import Shell, blocks, commands
from tests.measure.report.verdicts import Size, verdict
from tests.measure.trajectories.flags import HEIGHT, WIDTH, flutter

SPEEDS = (4.0, 6.0)


def arcsim_run(path: Path, speed: float) -> None:
    """An output folder of 2.4 s, held all along its hoist."""
    mesh = grid(width=WIDTH, height=HEIGHT, columns=9, rows=6)
    times = np.arange(60) / 25
    positions = flutter(mesh.rest, times)
    sequence = MeshSequence(
        time=np.round(times * 1e9).astype(np.int64),
        positions=positions.astype(np.float32),
        faces=mesh.faces.astype(np.int32),
        rest=mesh.rest.astype(np.float32),
        attributes={},
    )
    scene = {
        "frame_time": 0.04,
        "frame_steps": 8,
        "gravity": [0, 0, -9.81],
        "cloths": [
            {"mesh": "flag.obj", "materials": [{"data": "materials/camel-ponte-roma.json"}]}
        ],
        "handles": [{"nodes": np.flatnonzero(mesh.rest[:, 0] == 0).tolist()}],
        "wind": {"density": 1.0, "velocity": [speed, 0, 0], "drag": 0.0},
    }
    write_folder(path, sequence, scene=scene)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands find: the demonstration's flag, shorter and of fewer markers; two runs of
    ArcSim; a log."""
    path = tmp_path_factory.mktemp("loop")
    recipe = TrackedRecipe(seed=5, speeds=SPEEDS, duration=5.0, settle=0.4, vertices=40)
    make_tracks(recipe, path, advance=lambda count: None)
    for speed, name in zip((4.0, 8.0), ("run-4ms", "run-8ms"), strict=True):
        arcsim_run(path / name, speed)
    stamps = (
        f"2026-05-14T09:30:{second:02d}Z,{5 + 0.3 * (second % 3):.1f}" for second in range(12)
    )
    (path / "anemometer.csv").write_text(
        "\n".join(["time,wind_speed", *stamps]) + "\n", encoding="utf-8"
    )
    Lake.create(path / "lake")
    return path


def concluded() -> Verdict:
    """That lift acts, with the parameters that closing the loop reports."""
    values = {"area_weight": 1.0, "bending": 0.8, "damping": 0.002}
    parameters = tuple(
        Parameter(name=name, before=one, after=one, shift=0.0)
        for name, one in (
            (n, Quantity.of(value=v, low=0.9 * v, high=1.1 * v, unit="1"))
            for n, v in values.items()
        )
    )
    return replace(
        verdict(Conclusion.EFFECT, Size(across=3, up=3, frames=20, stretch=2)),
        parameters=parameters,
    )


def test_every_command_of_closing_the_loop_runs(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged: list[Experiment] = []

    def instead(experiment: Experiment, *_: object, **__: object) -> Verdict:
        judged.append(experiment)
        return concluded()

    def first_kind(bank: Path, batches: Sequence[NullBatch], **given: Any) -> None:
        build(bank, batches[:1], **given)

    monkeypatch.setattr("measure.closing.close.close_loop", instead)
    monkeypatch.setattr("measure.nulls.bank.build", first_kind)
    monkeypatch.chdir(folder)
    shell = Shell(patch=monkeypatch)
    for command in commands("loop-markers.md"):
        shell.run(command)
    speeds = [[round(r.wind.speed, 1) for r in experiment.recordings] for experiment in judged]
    assert speeds == [[4.0, 6.0], [4.0, 8.0], [5.3, 5.3], [4.0, 6.0]]
    assert all(
        (folder / "loop" / name).exists()
        for name in ("report.html", "verdict.json", "base.toml", "model.toml")
    )
    kinds = [row["kind"] for row in Lake.open(folder / "lake").rows().to_pylist()]
    assert sorted(kinds) == sorted([Kind.MEASUREMENT, Kind.MODEL, Kind.MODEL, Kind.MESHES])


def test_the_recipe_of_the_page_is_read(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "tracks.csv", tmp_path)
    (text,) = blocks("loop-markers.md", "toml")
    path = tmp_path / "flag.toml"
    path.write_text(text, encoding="utf-8")
    recipe = load(path)
    assert recipe.nulls == 160
    assert [(source.take, source.rate) for source in recipe.recordings] == [("4 m-s", 25)]


RISING_LOWER = """
from dataclasses import dataclass
from typing import Annotated

import torch

from sim.effects.effect import ForceEffect
from sim.effects.parameter import Value, strength


@dataclass(frozen=True, kw_only=True)
class RisingLower(ForceEffect):
    acceleration: Annotated[Value, strength(unit="m/s²", prior=(0.0, 5.0), source="made up for a test")] = 0.0

    def force(self, cloth, time, position, velocity, wind):
        return self.acceleration * cloth.mass[:, None, None] * torch.tensor([0.0, 0.0, 1.0])[:, None]
"""


def nothing_taken() -> ProposalOutcome:
    return ProposalOutcome(
        decision=Decision.REJECTED,
        reason="no term stands out",
        steps=(),
        tried=0,
        ranking=(),
        strengths=(),
        retest=None,
        level=0.03,
        nulls="none",
        proposed_from="0",
        tested_on="0",
        known=(),
        seed=0,
    )


def test_every_command_of_proposing_runs(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[Sequence[object], dict[str, Any]]] = []

    def instead(experiment: Experiment, tried: Sequence[object], **given: Any) -> ProposalOutcome:
        calls.append((tried, given))
        return nothing_taken()

    monkeypatch.setattr("measure.propose.term_search.propose", instead)
    monkeypatch.chdir(tmp_path)
    shutil.copy(folder / "tracks.csv", tmp_path)
    for name in ("flag.toml", "other.toml"):
        shutil.copy(folder / "tracked.toml", tmp_path / name)
    (tmp_path / "bank").mkdir()
    made = tmp_path / "out" / "close-loop" / "proposal"
    made.mkdir(parents=True)
    (made / "proposed_1f2e3d.py").write_text(RISING_LOWER, encoding="utf-8")
    shell = Shell(patch=monkeypatch)
    for command in commands("proposals.md"):
        shell.run(command)
    (first, plain), (_, known), (tried, tested) = calls
    assert len(first) > 100
    assert plain["options"].bank is None
    assert str(known["options"].bank) == "bank"
    assert [str(column.effect) for column in known["acting_columns"]] == ["vertical-wind"]
    assert len(tried) == 1
    assert len(tested["controls"]) == len(first)
    assert len(entries(made / "proposals.json")) == 3
