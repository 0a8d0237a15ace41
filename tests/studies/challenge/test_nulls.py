"""Nulls that the sets of a challenge share."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from flagdata.core.provenance import recipe_hash
from flagdata.errors import ConflictError, InputError, UsageError
from measure.forecasting import Cut
from measure.nulls import NullBatch
from measure.nulls import bank as banks
from measure.trajectories import Experiment, Specimen, Trajectory
from tests.studies.challenge import nulls
from tests.studies.challenge.cases import TINY
from tests.studies.challenge.command import challenge
from tests.studies.challenge.recipe import ChallengeRecipe, parse

TEN_SECONDS = TINY.replace("duration = 0.2", "duration = 10.0")


def origin(recipe: ChallengeRecipe) -> nulls.Origin:
    return nulls.Origin(title=recipe.title, recipe=recipe_hash(asdict(recipe)))


@pytest.fixture
def recipe() -> ChallengeRecipe:
    return parse(TEN_SECONDS, where="tiny")


def test_they_are_of_the_recipes_cloths_winds_rates_and_noises(recipe: ChallengeRecipe) -> None:
    batches = nulls.null_batches(recipe, seed=5, kinds=12)
    assert {batch.rate for batch in batches} == {25.0, 60.0}
    assert {batch.noise for batch in batches} == {0.0, 0.001}
    for batch in batches:
        assert len(batch.markers) == 30
        assert all(2.7 <= speed <= 8.8 for speed in batch.speeds)
        # Two recordings of 10 s hold four segments of 2 s each: as many, by four winds of one
        # cloth.
        frames = round(batch.duration * batch.rate)
        cut = Cut.of(batch.rate, frames)
        assert cut.length * cut.period == pytest.approx(2.0)
        assert cut.segments(frames) == 2


def test_more_kinds_add_to_those_that_are_there(recipe: ChallengeRecipe) -> None:
    few, more = (nulls.null_batches(recipe, seed=5, kinds=kinds) for kinds in (3, 5))
    for old, new in zip(few, more, strict=False):
        assert (old.seed, old.rate, old.noise, old.speeds) == (
            new.seed,
            new.rate,
            new.noise,
            new.speeds,
        )
        np.testing.assert_array_equal(old.markers, new.markers)
    assert nulls.null_batches(recipe, seed=6, kinds=1)[0].seed != few[0].seed


def test_what_the_truth_computes_with_does_not_matter(recipe: ChallengeRecipe) -> None:
    other = replace(recipe, numerics={"only": replace(recipe.numerics["only"], columns=40)})
    assert (
        nulls.null_batches(recipe, seed=5, kinds=1)[0].speeds
        == nulls.null_batches(other, seed=5, kinds=1)[0].speeds
    )


def test_recordings_too_short_for_a_segment_are_refused(recipe: ChallengeRecipe) -> None:
    with pytest.raises(InputError, match=r"0\.5 s are too short"):
        nulls.null_batches(replace(recipe, duration=0.5), seed=5, kinds=1)


def test_a_folder_goes_on_with_its_own_nulls_alone(recipe: ChallengeRecipe, tmp_path: Path) -> None:
    nulls.claim(tmp_path / "bank", origin(recipe), seed=5)
    nulls.claim(tmp_path / "bank", origin(recipe), seed=5)
    with pytest.raises(ConflictError, match="seed 5, not 6"):
        nulls.claim(tmp_path / "bank", origin(recipe), seed=6)
    with pytest.raises(ConflictError, match="recipe"):
        nulls.claim(tmp_path / "bank", origin(replace(recipe, duration=12.0)), seed=5)


def test_the_verb_builds_them(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[tuple[Path, int, int, str | None]] = []

    def build(
        folder: Path,
        batches: Sequence[NullBatch],
        *,
        workers: int,
        scheduler: str | None,
        progress: object,
    ) -> None:
        asked.append((folder, len(batches), workers, scheduler))

    monkeypatch.setattr(banks, "build", build)
    (tmp_path / "tiny.toml").write_text(TEN_SECONDS)
    arguments = [
        "bank",
        str(tmp_path / "made"),
        "--recipe",
        str(tmp_path / "tiny.toml"),
        "--seed",
        "5",
        "--kinds",
        "6",
    ]
    result = CliRunner().invoke(
        challenge,
        [*arguments, "--workers", "2", "--scheduler", "tcp://a:1", "--json"],
        catch_exceptions=False,
    )
    assert json.loads(result.stdout)["recordings"] == 6 * banks.WINDS
    assert asked == [(tmp_path / "made", 6, 2, "tcp://a:1")]


def test_the_verb_takes_a_recipe_of_close_loop(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, specimen: Specimen, own_recording: Trajectory
) -> None:
    """Nulls of its cloth, markers and winds; a folder goes on with those of the same recordings
    alone."""
    experiment = Experiment(specimen=specimen, recordings=(own_recording,))
    asked: list[NullBatch] = []
    monkeypatch.setattr(banks, "build", lambda folder, batches, **_: asked.extend(batches))
    monkeypatch.setattr(nulls.recipes, "load", lambda path: SimpleNamespace(title=path.stem))
    monkeypatch.setattr(
        nulls.recipes, "read", lambda recipe, lake: SimpleNamespace(experiment=experiment)
    )
    (tmp_path / "tracked.toml").write_text('[[recording]]\nsource = "tracks.csv"\n')
    arguments = [
        "bank",
        str(tmp_path / "made"),
        "--recipe",
        str(tmp_path / "tracked.toml"),
        "--kinds",
        "6",
    ]
    CliRunner().invoke(challenge, [*arguments, "--seed", "5"], catch_exceptions=False)
    assert len(asked) == 6
    assert all(np.array_equal(batch.markers, own_recording.markers) for batch in asked)
    assert all(0.9 * 4.0 <= speed <= 1.1 * 4.0 for batch in asked for speed in batch.speeds)
    experiment = replace(experiment, recordings=(replace(own_recording, noise=1e-3),))
    with pytest.raises(ConflictError, match="recipe"):
        CliRunner().invoke(challenge, [*arguments, "--seed", "5"], catch_exceptions=False)


def test_films_keep_their_simulations_themselves() -> None:
    with pytest.raises(UsageError, match="films need no bank"):
        nulls.nulls_of("films", seed=1, kinds=4, lake=None)
