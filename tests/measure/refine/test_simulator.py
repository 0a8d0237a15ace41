"""Replicates take turns at scenes, and draw the damping that nobody knows; what is filmed is
conditioned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range, Scale
from measure.refine import FilmCamera, FilmRequest, FixedView, Simulator
from measure.refine.simulator import SimulatedScene
from models.conditioning import condition_film
from sim.run import IntegratorSpec, Recipe

FRAMES, RATE = 8, 25.0
DAMPING = Range(low=1e-3, high=20e-3, scale=Scale.LOG)
HERE = (0.0,) * 16 + (0.4,)


def damped(recipe: Recipe) -> Recipe:
    material = replace(recipe.material, damping=DAMPING)
    return replace(recipe, material=material, integrator=IntegratorSpec(name="implicit", step=5e-3))


def of(recipes: Recipe | list[Recipe], view: FixedView) -> Simulator:
    return Simulator.of(recipes, view, frames=FRAMES, rate=RATE, batch=2)


def test_each_request_draws_its_damping_over_the_whole_range(recipe: Recipe) -> None:
    scene = SimulatedScene(damped(recipe))
    found = np.array(
        [
            scene.member(FilmRequest(point=HERE, seed=seed)).scene.material.damping
            for seed in range(400)
        ],
        dtype=np.float64,
    )
    shares = np.log(found / DAMPING.low) / np.log(DAMPING.high / DAMPING.low)
    assert shares.min() >= 0
    assert shares.max() <= 1
    assert np.abs(np.quantile(shares, [0.25, 0.5, 0.75]) - [0.25, 0.5, 0.75]).max() < 0.08


def test_a_scene_without_a_range_keeps_the_damping_of_its_material(recipe: Recipe) -> None:
    assert (
        SimulatedScene(recipe).member(FilmRequest(point=HERE, seed=7)).scene.material.damping
        == recipe.material.bases[0].damping
    )


def test_replicates_take_turns_at_the_scenes(recipe: Recipe, view: FixedView) -> None:
    requests = [FilmRequest(point=HERE, seed=11, replicate=number) for number in (0, 1, 2)]
    both = [film.clip for film in of([recipe, damped(recipe)], view).films(requests)]
    first = [film.clip for film in of(recipe, view).films(requests)]
    other = [film.clip for film in of(damped(recipe), view).films(requests)]
    assert np.array_equal(both[0], first[0])
    assert np.array_equal(both[2], first[2])
    assert np.array_equal(both[1], other[1])
    assert not np.array_equal(first[0], other[0])


def test_scenes_of_different_spaces_are_refused(recipe: Recipe, view: FixedView) -> None:
    heavier = replace(
        recipe, material=replace(recipe.material, area_weight=Range(low=0.2, high=0.4))
    )
    with pytest.raises(InputError, match="2 different search spaces"):
        of([recipe, heavier], view)


@pytest.mark.parametrize("name", ["stretching", "area_weight_factor"])
def test_a_range_that_nothing_would_draw_is_refused(
    recipe: Recipe, view: FixedView, name: str
) -> None:
    ranged = replace(recipe, material=replace(recipe.material, **{name: Range(low=0.5, high=2.0)}))
    with pytest.raises(InputError, match="ranges of bending factors"):
        of(ranged, view)


def test_only_a_range_of_damping_says_that_it_is_drawn(recipe: Recipe, view: FixedView) -> None:
    assert of([recipe, damped(recipe)], view).draws_damping
    assert not of(recipe, view).draws_damping


@pytest.fixture
def filmed(monkeypatch: pytest.MonkeyPatch) -> list[UInt8Array]:
    """What cameras film while a test goes on, (frame, height, width) each."""
    found: list[UInt8Array] = []
    film = FilmCamera.filmed

    def kept(self: FilmCamera, frames: UInt8Array, *, seed: int) -> UInt8Array:
        found.append(film(self, frames, seed=seed))
        return found[-1]

    monkeypatch.setattr(FilmCamera, "filmed", kept)
    return found


@pytest.mark.parametrize("wind", [-1.0, 0.4], ids=["calm", "windy"])
def test_a_simulated_clip_is_what_was_filmed_conditioned_once(
    recipe: Recipe, view: FixedView, filmed: list[UInt8Array], wind: float
) -> None:
    clip = of(recipe, view).films([FilmRequest(point=(*HERE[:-1], wind), seed=11)])[0].clip
    (film,) = filmed
    np.testing.assert_array_equal(clip, condition_film(film, np.arange(FRAMES) / RATE).frames)
