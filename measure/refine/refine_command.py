"""What `flagdata measure --refine N` calls: clips in, a refinement and its section of the report
out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from flagdata.core.arrays import UInt8Array
from flagdata.core.console import progress
from flagdata.core.stated import Stated
from flagdata.errors import InputError
from flagdata.lake import Artifact
from flagdata.recipes.typed_tables import Range
from measure.refine.procedure import Settings, refine
from measure.refine.refinement import Refinement
from measure.refine.space import Space
from measure.refine.target import Target, of_recording
from measure.refine.target_view import DrawnView, View
from models.trained.estimator import Estimator
from sim.assets import Assets
from sim.render.render_prior import named_prior
from sim.run import load
from sim.run.simulation_recipe import Recipe


@dataclass(frozen=True, kw_only=True)
class Learned:
    """What a model of flags learned from (`catalogs/datasets`).

    Attributes:
        scenes: recipes that are simulated to refine its estimates, and whose ranges are searched.
        films: how many films of which scene: the prior of its answer, and so of the refined one
            (decision 020).
    """

    scenes: tuple[str, ...]
    films: Mapping[str, int]


LEARNED: Mapping[tuple[str, str], Learned] = {
    ("wind_speed", "area_weight"): Learned(scenes=("flag-wide",), films={"flag-wide": 3600}),
    ("wind_speed", "fabric_area_weight"): Learned(
        scenes=("flag-fabrics", "flag-fabrics-damped"),
        films={"flag-wide": 3600, "flag-fabrics": 800, "flag-fabrics-damped": 800},
    ),
    ("outdoor_wind", "fabric_area_weight"): Learned(
        scenes=("flag-outdoor", "flag-outdoor-damped"),
        films={"flag-outdoor": 960, "flag-outdoor-damped": 1856},
    ),
    ("outdoor_wind", "world_area_weight"): Learned(
        scenes=("flag-world", "flag-world-damped"),
        films={"flag-world": 3360, "flag-world-damped": 6720},
    ),
}
"""By the wind and the area weight that a model estimates."""
RENDERS = "flags"
"""Prior of ζ, where a target's own is not known."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Clip:
    """A clip to refine.

    Attributes:
        name: for people.
        frames: (frame, height, width) uint8 gray, as many and as fast as the model takes,
            conditioned (`models.conditioning`), at instants that make the flag look like one of 1.5
            m (see `measure.estimate`).
        recording: its row in the lake, where it has one: a simulated recording states its own ζ.
    """

    name: str
    frames: UInt8Array
    recording: Artifact | None = None


def scenes_of(estimator: Estimator, *, aspect: float | None = None) -> tuple[Recipe, ...]:
    """Loads recipes that are simulated to refine a model's estimates.

    Args:
        aspect: length over height of the flag, for a model that knows several; None for the
            recipes' own.

    Raises:
        InputError: a model of another kind of cloth.
    """
    recipes = tuple(load(name) for name in _learned_of(estimator).scenes)
    if aspect is None:
        return recipes
    return tuple(
        replace(recipe, scene=replace(recipe.scene, height=recipe.scene.width / aspect))
        for recipe in recipes
    )


def space_of(estimator: Estimator) -> Space:
    """Makes the box that is searched for a model, with the prior that it learned.

    Raises:
        InputError: a model of another kind of cloth.
    """
    learned_from = _learned_of(estimator)
    return Space.of(load(learned_from.scenes[0])).learned(
        [(Space.of(load(name)), float(films)) for name, films in learned_from.films.items()]
    )


def _learned_of(estimator: Estimator) -> Learned:
    """Finds what a model of flags learned from, by its targets."""
    names = estimator.learners[0].scaling.names
    matching = [data for targets, data in LEARNED.items() if set(targets) <= set(names)]
    if not matching:
        raise InputError(
            f"the model estimates {', '.join(names) or 'nothing'}, but no wind and area weight of "
            "a flag",
            where=f"model {estimator.name!r}",
            fix="take the model of flags that comes with the package",
        )
    return matching[0]


def run(
    clips: Sequence[Clip],
    estimator: Estimator,
    *,
    budget: int,
    seed: int,
    level: float,
    cache: Path | None = None,
    view: View | None = None,
    area_weight: Stated | None = None,
    aspect: float | None = None,
) -> Refinement:
    """Refines clips of one flag, with a progress bar.

    Args:
        budget: simulated clips for each.
        cache: folder for evaluations, so that an interrupted run goes on.
        view: how all were filmed, where that is known; None takes what their recordings state, and
            otherwise draws ζ anew for each simulated clip.
        area_weight: range in which it is known to lie, of a flag of 1.5 m [kg/m²], any value of it
            alike; None for the prior that the model learned.
        aspect: see `scenes_of`.

    Raises:
        InputError: see `measure.refine.procedure.refine`.
    """
    recipes, space = scenes_of(estimator, aspect=aspect), space_of(estimator)
    if area_weight is not None:
        stated_range = Range(low=area_weight.low, high=area_weight.high)
        recipes = tuple(
            replace(recipe, material=replace(recipe.material, area_weight=stated_range))
            for recipe in recipes
        )
        space = Space.of(recipes[0])
    otherwise = view or DrawnView(prior=named_prior(RENDERS), assets=Assets())
    targets = [
        Target(name=clip.name, clip=clip.frames, view=otherwise)
        if view is not None or clip.recording is None
        else of_recording(clip.recording, clip.frames, otherwise=otherwise, space=space)
        for clip in clips
    ]
    settings = Settings(budget=budget, seed=seed, level=level)
    with progress(budget * len(targets), label="refining", unit="clip") as advance:
        return refine(
            targets,
            estimator,
            recipes,
            space=space,
            settings=settings,
            cache=cache,
            advance=advance,
        )
