"""Nulls that the sets of one design share."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from flagdata.errors import ConflictError, NotFoundError, UsageError
from measure.nulls import NullBatch
from measure.nulls import bank as banks
from measure.trajectories import Experiment, Specimen, Trajectory, WindTrack
from sim.cloth.material import named_material
from tests.studies.challenge import nulls
from tests.studies.challenge.command import challenge
from tests.studies.challenge.fitter import ClosingTheLoop
from tests.studies.challenge.folder import ChallengeFolder

KNIT, DENIM = (
    "camel-ponte-roma-25hz-1mm-steady",
    "11oz-black-denim-25hz-1mm-varying",
)


@pytest.fixture
def sets(specimen: Specimen, own_recording: Trajectory) -> dict[str, Experiment]:
    """Two of a knit in winds of 4 and 6 m/s, one of denim in a wind that varies."""
    noisy = replace(own_recording, noise=1e-3)
    gusty = WindTrack(
        times=np.arange(27) / 10, velocity=np.outer(5 + np.sin(np.arange(27)), (1.0, 0.0, 0.0))
    )
    denim = replace(specimen, material=named_material("11oz-black-denim"))
    return {
        "set-001": Experiment(specimen=specimen, recordings=(noisy,)),
        "set-002": Experiment(specimen=denim, recordings=(replace(noisy, wind=gusty),)),
        "set-003": Experiment(
            specimen=specimen,
            recordings=(replace(noisy, wind=WindTrack.constant((6.0, 0.0, 0.0))),),
        ),
    }


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, sets: dict[str, Experiment]) -> ChallengeFolder:
    """A folder of these sets."""
    monkeypatch.setattr(
        ChallengeFolder, "manifest", lambda self: {"title": "made", "sets": dict.fromkeys(sets)}
    )
    monkeypatch.setattr(ChallengeFolder, "experiment", lambda self, name: sets[name])
    return ChallengeFolder(Path("sets"))


def test_each_design_has_nulls_of_its_own_cloth_noise_rate_and_markers(
    made: ChallengeFolder, sets: dict[str, Experiment]
) -> None:
    denim, knit = nulls.nulls_of_sets(Path("bank"), made, seed=5, kinds=3)
    assert [denim.folder, knit.folder] == [Path("bank") / DENIM, Path("bank") / KNIT]
    for design, name in ((denim, "set-002"), (knit, "set-001")):
        own = sets[name]
        assert len(design.batches) == 3
        for batch in design.batches:
            assert batch.specimen.material == own.specimen.material
            assert (batch.rate, batch.noise) == (25.0, 1e-3)
            np.testing.assert_array_equal(batch.markers, own.recordings[0].markers)
    # Winds of all its sets, and somewhat beyond; those of the denim vary as its log does.
    speeds = [speed for batch in knit.batches for speed in batch.speeds]
    assert 3.6 <= min(speeds) < 4.5
    assert 6.0 < max(speeds) <= 6.6
    assert not any(batch.winds for batch in knit.batches)
    assert all(batch.winds for batch in denim.batches)


def test_more_kinds_add_to_those_that_are_there(made: ChallengeFolder) -> None:
    few, more, other = (
        nulls.nulls_of_sets(Path("bank"), made, seed=seed, kinds=kinds)[1].batches
        for seed, kinds in ((5, 3), (5, 5), (6, 1))
    )
    assert [(b.seed, b.speeds) for b in few] == [(b.seed, b.speeds) for b in more[:3]]
    assert other[0].seed != few[0].seed


def test_a_set_is_judged_by_the_nulls_of_its_design(
    sets: dict[str, Experiment], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[Path | None] = []
    monkeypatch.setattr(
        "measure.closing.close_loop", lambda experiment, options: asked.append(options.bank)
    )
    for name in ("set-001", "set-002"):
        ClosingTheLoop(bank=tmp_path)(sets[name], 1)
        ClosingTheLoop()(sets[name], 1)
    assert asked == [tmp_path / KNIT, None, tmp_path / DENIM, None]
    with pytest.raises(NotFoundError, match="holds no null recordings"):
        banks.load(tmp_path / KNIT, words="missing")


def test_a_folder_goes_on_with_its_own_nulls_alone(made: ChallengeFolder, tmp_path: Path) -> None:
    design, other = nulls.nulls_of_sets(tmp_path, made, seed=5, kinds=1)
    nulls.claim(design, seed=5)
    nulls.claim(design, seed=5)
    with pytest.raises(ConflictError, match="seed 5, not 6"):
        nulls.claim(design, seed=6)
    with pytest.raises(ConflictError, match="recipe"):
        nulls.claim(replace(design, batches=other.batches), seed=5)


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Path, list[NullBatch], int, str | None]]:
    """What is asked to be built, and is not."""
    asked: list[tuple[Path, list[NullBatch], int, str | None]] = []

    def build(
        folder: Path,
        batches: Sequence[NullBatch],
        *,
        workers: int,
        scheduler: str | None,
        progress: object,
    ) -> None:
        asked.append((folder, list(batches), workers, scheduler))

    monkeypatch.setattr(banks, "build", build)
    return asked


def test_the_verb_builds_those_of_each_design(
    made: ChallengeFolder,
    built: list[tuple[Path, list[NullBatch], int, str | None]],
    tmp_path: Path,
) -> None:
    arguments = ["bank", str(tmp_path / "made"), "--sets", str(tmp_path), "--seed", "5"]
    options = ["--kinds", "6", "--workers", "2", "--scheduler", "tcp://a:1", "--json"]
    result = CliRunner().invoke(challenge, [*arguments, *options], catch_exceptions=False)
    said = json.loads(result.stdout)
    assert said["recordings"] == 2 * 6 * banks.WINDS
    assert said["designs"] == [DENIM, KNIT]
    assert [(folder, len(batches), *how) for folder, batches, *how in built] == [
        (tmp_path / "made" / name, 6, 2, "tcp://a:1") for name in (DENIM, KNIT)
    ]


def test_the_verb_takes_a_recipe_of_close_loop(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    specimen: Specimen,
    own_recording: Trajectory,
    built: list[tuple[Path, list[NullBatch], int, str | None]],
) -> None:
    """Nulls of its cloth, markers and winds; a folder goes on with those of the same recordings
    alone."""
    experiment = Experiment(specimen=specimen, recordings=(own_recording,))
    monkeypatch.setattr(nulls.recipes, "load", lambda path: SimpleNamespace(title=path.stem))
    monkeypatch.setattr(
        nulls.recipes, "read", lambda recipe, lake: SimpleNamespace(experiment=experiment)
    )
    out = tmp_path / "made"
    arguments = ["bank", str(out), "--recipe", "tracked.toml", "--kinds", "6", "--seed", "5"]
    CliRunner().invoke(challenge, arguments, catch_exceptions=False)
    ((folder, batches, _, _),) = built
    assert (folder, len(batches)) == (out, 6)
    assert all(np.array_equal(batch.markers, own_recording.markers) for batch in batches)
    assert all(0.9 * 4.0 <= speed <= 1.1 * 4.0 for batch in batches for speed in batch.speeds)
    experiment = replace(experiment, recordings=(replace(own_recording, noise=1e-3),))
    with pytest.raises(ConflictError, match="recipe"):
        CliRunner().invoke(challenge, arguments, catch_exceptions=False)
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "mine").write_text("mine")
    arguments[1] = str(tmp_path / "taken")
    with pytest.raises(ConflictError):
        CliRunner().invoke(challenge, arguments, catch_exceptions=False)
    assert len(built) == 1


@pytest.mark.parametrize("given", [[], ["--sets", "a", "--recipe", "b.toml"]])
def test_nulls_are_of_sets_or_of_a_recipe(given: list[str], tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="of one design"):
        CliRunner().invoke(
            challenge,
            ["bank", str(tmp_path / "made"), "--seed", "5", *given],
            catch_exceptions=False,
        )
    assert not (tmp_path / "made").exists()


def test_films_keep_their_simulations_themselves(
    made: ChallengeFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ChallengeFolder, "filmed", True)
    with pytest.raises(UsageError, match="films need no bank"):
        nulls.nulls_of_sets(Path("bank"), made, seed=1, kinds=4)
