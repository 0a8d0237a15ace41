"""Films: dealt evenly, shuffled, and each with streams of its own."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from flagdata.recipes.typed_tables import Range
from flagdata.timebase import iso
from sim.datasets import DatasetRecipe, PlannedFilm, Roll, Sequences, casts, load
from sim.run import Crew
from tests.small import GROUPS


def films(recipe: DatasetRecipe, side: str) -> list[PlannedFilm]:
    rolls = [Roll(cast=cast) for cast in casts(recipe) if cast.side.name == side]
    members = tuple((roll.cast, index, roll.id(index)) for roll in rolls for index in roll.chosen)
    return list(Sequences(recipe=recipe, side=side, members=members).films())


def test_sequences_are_filmed_equally_often_or_once_more() -> None:
    recipe = load("flagsim")
    for side, less, more in (("validation", 25, 26), ("test", 41, 42)):
        often = Counter(Counter(film.sequence for film in films(recipe, side)).values())
        assert set(often) == {less, more}
        assert sum(times * count for times, count in often.items()) == recipe.side(side).renders


def test_seeds_and_identities_are_all_different() -> None:
    every = films(load("flagsim-small"), "train")
    for distinct in (
        [f.seed for f in every],
        [f.name for f in every],
        [f.artifact().id for f in every],
    ):
        assert len(set(distinct)) == len(every)


def test_the_order_of_films_is_independent_of_their_sequences() -> None:
    # In a random order neighbours share their sequence with probability (r - 1)/(n - 1) = 4/1499: 4
    # of 1499 expected.
    sequences = [film.sequence for film in films(load("flagsim-small"), "train")]
    together = sum(a == b for a, b in itertools.pairwise(sequences))
    assert together <= 14  # 5 standard deviations of a Poisson count of mean 4


def test_another_image_size_changes_no_seed(make: Callable[..., DatasetRecipe]) -> None:
    small, large = films(make(), "train"), films(make({"width = 32": "width = 64"}), "train")
    assert [f.seed for f in small] == [f.seed for f in large]
    assert [f.sequence for f in small] == [f.sequence for f in large]
    assert not {f.artifact().id for f in small} & {f.artifact().id for f in large}


def test_sessions_keep_camera_and_day_and_no_day_is_on_two_sides() -> None:
    recipe = load("field")
    days: dict[str, set[str]] = {}
    for side in ("train", "validation", "test"):
        by_session: dict[str | None, list[PlannedFilm]] = {}
        for film in films(recipe, side):
            by_session.setdefault(film.session, []).append(film)
        assert len(by_session) == recipe.side(side).sessions
        for own in by_session.values():
            assert len({film.look for film in own}) == 1
            assert len({iso(film.begin)[:10] for film in own}) == 1
            begins = np.sort([film.begin for film in own])
            length = recipe.simulation.time.total / recipe.simulation.time.rate
            assert np.diff(begins).min() > length * 1e9
        days[side] = {iso(film.begin)[:10] for own in by_session.values() for film in own}
        assert len(days[side]) == len(by_session)
    for one, other in itertools.combinations(days.values(), 2):
        assert not one & other


def test_a_sequence_that_fails_is_replaced_by_the_next_index(
    make: Callable[..., DatasetRecipe],
) -> None:
    roll = Roll(cast=next(casts(make())))
    assert roll.chosen == [0, 1, 2]
    roll.failed[1] = "it crumpled"
    assert roll.chosen == [0, 2, 3]
    assert roll.pending({roll.id(0), roll.id(2)}) == [3]
    other = Roll(cast=replace(roll.cast, simulation=replace(roll.cast.simulation, count=2)))
    assert other.id(0) == roll.id(0)  # how many are wanted changes no sequence


def test_batches_draw_height_rate_and_attachment_and_their_films_are_equally_long(
    make: Callable[..., DatasetRecipe],
) -> None:
    recipe = make(
        {
            "[sides.train]\nsequences = 3\nrenders = 7": GROUPS
            + "[sides.train]\nsequences = 40\nrenders = 40"
        }
    )
    own = [cast for cast in casts(recipe) if cast.side.name == "train"]
    batch, scene, time = recipe.simulation.batch, recipe.simulation.scene, recipe.simulation.time
    assert [cast.simulation.count for cast in own] == [batch] * (40 // batch) + [40 % batch] * bool(
        40 % batch
    )
    heights = [cast.simulation.scene.height for cast in own]
    assert len(set(heights)) == len(own)
    assert min(heights) >= 0.2
    assert max(heights) <= 0.4
    assert {cast.simulation.time.rate for cast in own} == {20.0, 40.0}
    assert {cast.simulation.scene.attachment.value for cast in own} == {"corners", "hoist"}
    for cast in own:
        drawn = cast.simulation.time
        assert abs(drawn.frames / drawn.rate - time.frames / time.rate) <= 0.5 / drawn.rate
        assert cast.stated == {"width": scene.width, "height": cast.simulation.scene.height}
    every = films(recipe, "train")
    assert {film.artifact().frame_count for film in every} == {
        cast.simulation.time.frames for cast in own
    }
    assert len({film.artifact().id for film in every}) == 40


def test_groups_leave_the_identity_of_data_sets_without_them_alone(
    make: Callable[..., DatasetRecipe],
) -> None:
    assert "groups" not in make().identity()
    base = make({"[sides.train]": GROUPS + "[sides.train]"})
    for old, new in (
        ("[20.0, 40.0]", "[20.0, 20.0, 40.0]"),
        ("high = 0.4", "high = 0.5"),
        (', "hoist"]', "]"),
    ):
        assert make({"[sides.train]": GROUPS.replace(old, new) + "[sides.train]"}).hash != base.hash


def test_a_sessions_mean_wind_says_nothing_of_where_its_first_sequence_lies_about_it() -> None:
    """Both are drawn evenly: their places agree in the mean of 14 days to 1/3, give or take 0.24 /
    √14."""
    recipe = load("field")
    winds = recipe.simulation.wind.speed
    assert isinstance(winds, Range)
    apart = []
    for cast in casts(recipe):
        own = cast.simulation.wind.speed
        assert isinstance(own, Range)
        mean, first = (own.low + own.high) / 2, Crew(cast.simulation).member(0).wind_speed
        places = (
            (mean - winds.low) / (winds.high - winds.low),
            (first - own.low) / (own.high - own.low),
        )
        apart.append(abs(places[0] - places[1]))
    assert len(apart) == 14
    assert 0.14 < np.mean(apart) < 0.53
