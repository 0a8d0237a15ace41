"""A recipe's members as arrays, in no lake: what `flagdata.simulate` does."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.errors import InputError, UsageError
from flagdata.recipes import parsed
from flagdata.simulated import Simulated
from sim.run.batch import Outcome, Stepper
from sim.run.members import Crew
from sim.run.publish import batches, check_device, outcomes
from sim.run.reading import SCENES, of_content
from sim.run.recipe import Recipe

Content = Mapping[str, Any]
PLAIN: Content = {"material": {"name": "camel-ponte-roma"}}
"""What is simulated where no recipe is named: a flag of a measured knit."""


def simulated(recipe: str | Content | None, given: Content, *, device: str, workers: int) -> Simulated:
    """The members of a recipe with what is given beside it.

    Args:
        recipe: name of a recipe of the catalog, path of a TOML file, its content, or None for what is given alone.
        given: entries and tables that are put in place of the recipe's, a table's entries one by one.

    Raises:
        FlagdataError: see `flagdata.simulate`.
    """
    if workers < 1:
        raise UsageError(f"{workers} workers", where="workers", fix="give at least one")
    check_device(device)
    crew = Crew(recipe_of(recipe, given))
    steppers = [Stepper.of(crew, base) for base in range(len(crew.recipe.material.bases))]
    waiting = batches(crew, steppers, range(crew.recipe.count))
    found = [one for _, some in outcomes(crew, waiting, device=device, workers=workers, progress=None) for one in some]
    return _answer(crew.recipe, sorted(found, key=lambda one: one.member.index))


def recipe_of(recipe: str | Content | None, given: Content) -> Recipe:
    """The recipe with what is given beside it; as `simulated`."""
    name, folder, where = "simulation", Path(), "recipe"
    if isinstance(recipe, str):
        found = SCENES.find(recipe)
        name, folder, where = found.name, found.folder, found.where
        recipe = parsed(found.text, where=found.where)
    content = dict(PLAIN if recipe is None else recipe)
    for key, value in given.items():
        own = content.get(key)
        content[key] = {**own, **value} if isinstance(own, Mapping) and isinstance(value, Mapping) else value
    return of_content(content, name=name, folder=folder, where=where)


def _answer(recipe: Recipe, found: list[Outcome]) -> Simulated:
    whole = [one for one in found if one.sequence is not None]
    failed = {one.member.index: one.failure[1] for one in found if one.failure is not None}
    if not whole:
        raise InputError(
            f"none of {len(found)} members was simulated to the end: {next(iter(failed.values()))}",
            where=recipe.name,
            fix="declare more damping, or a smaller step",
        )
    names = [name for name, value in whole[0].member.parameters.items() if isinstance(value, float)]
    return Simulated(
        name=recipe.name,
        members=tuple(one.sequence for one in whole if one.sequence is not None),
        failed=failed,
        wind=np.stack([one.wind for one in whole]),
        parameters={name: np.array([one.member.parameters[name] for one in whole], dtype=np.float64) for name in names},
    )
