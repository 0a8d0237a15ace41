"""What a data set may be called, and that it is itself by that name, in the catalog and on its
card."""

from __future__ import annotations

import html
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flagdata.errors import ConflictError, InputError
from flagdata.lake import Artifact, Lake
from sim.datasets import DatasetRecipe, PlannedFilm, Roll, casts, load
from sim.datasets.build import Build
from sim.datasets.card import write_card
from sim.run import member_artifact
from tests.refusals import unrefused

Make = Callable[..., DatasetRecipe]


def build_of(lake: Lake, recipe: DatasetRecipe) -> Build:
    """A build without workers: what it asks of them fails."""
    nobody: Any = None
    return Build(
        lake=lake, recipe=recipe, workers=nobody, bars=lambda *_: nullcontext(lambda _: None)
    )


def films(lake: Lake, recipe: DatasetRecipe) -> list[PlannedFilm]:
    return build_of(lake, recipe).films(Roll(cast=cast) for cast in casts(recipe))


def sequence_of(film: PlannedFilm) -> Artifact:
    """The row of the sequence that a film is of."""
    simulation = film.cast.simulation
    return member_artifact(simulation, simulation.identity(), film.index, film.sequence_seed)


def test_films_are_of_their_data_set_and_side(make: Make, tmp_path: Path) -> None:
    recipe = replace(make(), name="o'brien")
    rows = [film.artifact() for film in films(Lake.create(tmp_path / "lake"), recipe)]
    assert {row.dataset for row in rows} == {"o'brien"}
    assert [sum(row.side == side for row in rows) for side in ("train", "test")] == [7, 3]


def test_the_card_of_a_data_set_shows_how_its_sides_are_taken(make: Make, tmp_path: Path) -> None:
    text = write_card(Lake.create(tmp_path / "lake"), replace(make(), name="o'brien")).read_text()
    assert '"train": {"dataset": "o\'brien", "side": "train"}' in html.unescape(text)


def test_a_recipe_whose_films_are_there_under_another_name_is_refused_before_anything_is_simulated(
    make: Make, tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    film = films(lake, make())[0]
    with lake.transaction("the sequence and one film") as transaction:
        transaction.add(sequence_of(film))
        transaction.add(film.artifact())
    with pytest.raises(ConflictError, match="there already, in the data set 'tiny'"):
        build_of(lake, replace(make(), name="other")).run()


def test_what_no_artifact_can_be_called_is_refused_before_the_recipe_is_read() -> None:
    cases = ["a\tb", " ", "a" * 101, "a\udcffb"]
    assert not unrefused(
        lambda name: load(f"{name}.toml"), zip(cases), InputError, "a data set cannot be called"
    )
