"""What `flagdata measure --refine N` calls: clips in, a refinement and its section of the report out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flagdata.console import progress
from flagdata.errors import InputError
from flagdata.lake import Artifact
from flagdata.tables import Range
from measure.refine.procedure import Settings, refine
from measure.refine.refinement import Refinement
from measure.refine.space import Space
from measure.refine.target import Target, of_recording
from measure.refine.view import DrawnView, View
from models.estimator import Estimator
from sim.assets import Assets
from sim.render.prior import named
from sim.run import load
from sim.run.recipe import Recipe

SCENES = {"density": ("flag-wide",), "fabric_density": ("flag-fabrics", "flag-fabrics-damped")}
"""Recipes that are simulated, and whose ranges are searched, by the area weight that a model estimates."""
LEARNED = {
    "density": {"flag-wide": 3600},
    "fabric_density": {"flag-wide": 3600, "flag-fabrics": 800, "flag-fabrics-damped": 800},
}
"""How many films of which scene such a model learned from (`catalogs/datasets`): the prior of its answer, and so of the
refined one (decision 020)."""
RENDERS = "flags"
"""Prior of ζ, where a target's own is not known."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Clip:
    """A clip to refine.

    Attributes:
        name: for people.
        frames: (frame, height, width) uint8 gray, as many and as fast as the model takes, conditioned
            (`models.conditioning`), at instants that make the flag look like one of 1.5 m (see `measure.estimate`).
        recording: its row in the lake, where it has one: a simulated recording states its own ζ.
    """

    name: str
    frames: NDArray[np.uint8]
    recording: Artifact | None = None


def scenes_of(estimator: Estimator) -> tuple[Recipe, ...]:
    """Recipes that are simulated to refine a model's estimates.

    Raises:
        InputError: a model of another kind of cloth.
    """
    return tuple(load(name) for name in SCENES[_weighed(estimator)])


def space_of(estimator: Estimator) -> Space:
    """The box that is searched for a model, with the prior that it learned.

    Raises:
        InputError: a model of another kind of cloth.
    """
    parts = [(Space.of(load(name)), float(films)) for name, films in LEARNED[_weighed(estimator)].items()]
    return Space.of(scenes_of(estimator)[0]).learned(parts)


def _weighed(estimator: Estimator) -> str:
    """The area weight that a model of flags estimates, a key of `SCENES`."""
    names = estimator.learners[0].scaling.names
    found = [target for target in SCENES if target in names]
    if not found:
        raise InputError(
            f"the model estimates {', '.join(names) or 'nothing'}, but no area weight of a flag",
            where=f"model {estimator.name!r}", fix="take the model of flags that comes with the package",
        )  # fmt: skip
    return found[0]


def run(
    clips: Sequence[Clip], estimator: Estimator, *, budget: int, seed: int, level: float, cache: Path | None = None,
    view: View | None = None, area_weight: tuple[float, float] | None = None,
) -> Refinement:  # fmt: skip
    """Refine clips of one flag, with a progress bar.

    Args:
        budget: simulated clips for each.
        cache: folder for evaluations, so that an interrupted run goes on.
        view: how all were filmed, where that is known; None takes what their recordings state, and otherwise draws ζ
            anew for each simulated clip.
        area_weight: range in which it is known to lie, of a flag of 1.5 m [kg/m²], any value of it alike; None for the
            prior that the model learned.

    Raises:
        InputError: see `measure.refine.procedure.refine`.
    """
    recipes, space = scenes_of(estimator), space_of(estimator)
    if area_weight is not None:
        density = Range(low=area_weight[0], high=area_weight[1])
        recipes = tuple(replace(one, material=replace(one.material, density=density)) for one in recipes)
        space = Space.of(recipes[0])
    otherwise = view or DrawnView(prior=named(RENDERS), assets=Assets())
    targets = [
        Target(name=clip.name, clip=clip.frames, view=otherwise)
        if view is not None or clip.recording is None
        else of_recording(clip.recording, clip.frames, otherwise=otherwise, space=space)
        for clip in clips
    ]
    settings = Settings(budget=budget, seed=seed, level=level)
    with progress(budget * len(targets), label="refining", unit="clip") as advance:
        return refine(targets, estimator, recipes, space=space, settings=settings, cache=cache, advance=advance)
