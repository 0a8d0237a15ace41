"""Recipes of data sets: those of the catalog, and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, NotFoundError, UnknownNameError, UsageError
from flagdata.recipes.typed_tables import Range, ends
from sim.datasets import DATASETS, DatasetRecipe, Truth, casts, load, parse, with_counts
from sim.datasets.dataset_toml import with_renderer
from sim.effects import FiniteSpanLoading
from sim.run import Crew
from tests.refusals import unrefused

Make = Callable[..., DatasetRecipe]


def test_flagsim_has_the_papers_counts_size_and_search_space() -> None:
    # Runia et al. 2020, section "FlagSim Dataset" and table of the search space.
    recipe = load("flagsim")
    assert [(s.name, s.sequences, s.renders) for s in recipe.sides] == [
        ("train", 1000, 14000),
        ("validation", 150, 3800),
        ("test", 85, 3500),
    ]
    time, wind, material = (
        recipe.simulation.time,
        recipe.simulation.wind,
        recipe.simulation.material,
    )
    assert (time.frames, time.rate) == (60, 25.0)
    assert ends(wind.speed) == (0.0, 10.0)
    assert material.area_weight == Range(low=0.10, high=0.17)
    assert ends(material.bending_each) == (0.1, 10.0)
    assert (
        ends(recipe.prior.quantities["width"])
        == ends(recipe.prior.quantities["height"])
        == (300, 300)
    )


def test_clothsim_draws_from_all_ten_measured_cloths() -> None:
    assert len(load("clothsim").simulation.material.bases) == 10


@pytest.mark.parametrize("name", DATASETS.names())
def test_recipes_of_the_catalog_are_complete_and_no_seed_is_on_two_sides(name: str) -> None:
    recipe = load(name)
    assert recipe.licence
    seeds = [cast.simulation.seed for cast in casts(recipe)]
    assert len(set(seeds)) == len(seeds)
    counts: dict[str, int] = {}
    for cast in casts(recipe):
        counts[cast.side.name] = counts.get(cast.side.name, 0) + cast.simulation.count
    assert counts == {side.name: side.sequences for side in recipe.sides}


def test_a_field_campaign_has_one_flag_a_session_and_believes_its_anemometer() -> None:
    recipe = load("field")
    assert recipe.anemometer.truth is Truth.MEASURED
    drawn = [cast.simulation for cast in casts(recipe)]
    assert len(drawn) == 14
    for simulation in drawn:
        assert len(simulation.material.bases) == 1
        assert not isinstance(simulation.material.bending, Range)
        low, high = ends(simulation.wind.speed)
        assert high / low == pytest.approx(1.25 / 0.75)
    assert len({simulation.material.bases[0].area_weight for simulation in drawn}) == 14


def test_what_does_not_shape_the_data_leaves_the_hash_alone_and_what_does_changes_it(
    make: Make,
) -> None:
    base = make().hash
    assert make({"A tiny data set": "Another title"}).hash == base
    for old, new in (
        ("seed = 1", "seed = 2"),
        ("renders = 7", "renders = 8"),
        ("read-noise = 1.0", "read-noise = 2.0"),
    ):
        assert make({old: new}).hash != base
    assert make({"jpeg-quality = { low = 70,": "jpeg-quality = { low = 71,"}).hash != base
    assert make(scene={"columns = 6": "columns = 7"}).hash != base
    assert with_renderer(make(), "cycles").hash != base


def test_what_makes_no_data_set_is_refused(make: Make) -> None:
    cases = [
        ('licence = "CC0-1.0"', "", InputError, "licence"),
        ("renders = 7", "renders = 2", InputError, "renders"),
        ("[sides.test]", "[sides.tset]", UnknownNameError, "did you mean 'test'"),
        ('prior = "flags"', 'prior = "flag"', UnknownNameError, "did you mean 'flags'"),
        ('prior = "flags"', "", InputError, "prior"),
        ("noise = 0.1", "nose = 0.1", UnknownNameError, "did you mean 'noise'"),
        ("anemometer-gain", "clock-drift", UnknownNameError, "effect of an anemometer"),
        ("gain = { low = 0.95,", "gain = { low = -0.95,", InputError, "gain"),
        (
            "jpeg-quality = { low = 70, high = 90 }",
            "jpeg-quality = 101",
            InputError,
            "jpeg-quality",
        ),
        ('scene = "scene.toml"', 'scene = "absent.toml"', NotFoundError, "no such recipe file"),
        (
            "noise = 0.1",
            'noise = 0.1\ntruth = "measured"\nbefore = 30.0',
            UsageError,
            "30 s of wind",
        ),
        ("width = 32", 'width = 32\nrenderer = "povray"', UnknownNameError, "renderer"),
        ("[camera]", "[groups]\nrates = [0.0]\n[camera]", InputError, "a rate of 0 Hz"),
        (
            "[camera]",
            '[groups]\nattachments = ["hoists"]\n[camera]',
            UnknownNameError,
            "did you mean 'hoist'",
        ),
        ("[camera]", "[groups]\nheigth = 1.0\n[camera]", UnknownNameError, "did you mean 'height'"),
        ("[camera]", "[sessions]\n[groups]\n[camera]", UsageError, "both sessions and groups"),
    ]
    assert not unrefused(lambda old, new: make({old: new}), cases)


def test_the_scene_of_a_data_set_may_name_the_airs_inertia(make: Make) -> None:
    shared = make(
        scene={"[time]": "[effects.finite-span-loading]\nshare = { low = 0.1, high = 0.3 }\n[time]"}
    )
    assert shared.hash != make().hash
    crew = Crew(next(casts(shared)).simulation)
    members = [crew.member(0), crew.member(1)]
    shares = np.array(
        [member.parameters["finite-span-loading.share"] for member in members], dtype=np.float64
    )
    assert 0.1 <= shares.min() < shares.max() <= 0.3
    system, _ = crew.assemble(members)
    (load,) = system.loads
    assert isinstance(load, FiniteSpanLoading)
    assert torch.as_tensor(load.share).tolist() == pytest.approx(shares.tolist())


def test_gusts_whose_minute_before_is_not_simulated_cannot_be_measured(make: Make) -> None:
    gusty = {"[time]": "[effects.gusts]\nintensity = 0.2\n[time]"}
    assert make(scene=gusty).anemometer.truth is Truth.STATED
    with pytest.raises(UsageError, match="settle for 60 s"):
        make({"noise = 0.1": 'noise = 0.1\ntruth = "measured"'}, scene=gusty)


def test_an_unknown_recipe_is_answered_with_the_nearest(tmp_path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'flagsim'"):
        load("flagsin")
    with pytest.raises(NotFoundError):
        load(str(tmp_path / "none.toml"))
    with pytest.raises(InputError, match="not TOML"):
        parse("title = ", name="x", folder=tmp_path, where="x.toml")


@pytest.mark.parametrize("name", DATASETS.names())
def test_counts_are_dealt_to_the_sides_in_the_recipes_shares(name: str) -> None:
    recipe = load(name)
    wanted = 101, 505
    other = with_counts(recipe, sequences=wanted[0], films=wanted[1])
    assert (
        sum(side.sequences for side in other.sides),
        sum(side.renders for side in other.sides),
    ) == wanted
    totals = [
        sum(getattr(side, what) for side in recipe.sides) for what in ("sequences", "renders")
    ]
    for side, before in zip(other.sides, recipe.sides, strict=True):
        assert abs(side.sequences - wanted[0] * before.sequences / totals[0]) < 1
        assert abs(side.renders - wanted[1] * before.renders / totals[1]) < 1
        assert side.renders >= side.sequences >= side.sessions
        assert bool(side.sessions) == bool(before.sessions)
    assert sum(cast.simulation.count for cast in casts(other)) == wanted[0]
    assert (other.name, other.licence) == (f"{name}-101x505", recipe.licence)
    assert other.hash != recipe.hash
    assert other.seed != recipe.seed  # none of its films is one of the recipe's own


def test_films_follow_the_sequences_and_counts_that_cannot_be_are_refused() -> None:
    recipe = load("flagsim-small")  # 400 sequences, 5 films of each
    assert with_counts(recipe, sequences=None, films=None) is recipe
    assert with_counts(recipe, sequences=400, films=2000) is recipe
    assert sum(side.renders for side in with_counts(recipe, sequences=40, films=None).sides) == 200
    assert (
        sum(side.sequences for side in with_counts(recipe, sequences=None, films=800).sides) == 400
    )
    assert [side.sequences for side in with_counts(recipe, sequences=3, films=3).sides] == [1, 1, 1]
    with pytest.raises(UsageError, match="2 sequences cannot be on 3 sides"):
        with_counts(recipe, sequences=2, films=None)
    with pytest.raises(UsageError, match="300 films are fewer than the 400 sequences"):
        with_counts(recipe, sequences=None, films=300)
