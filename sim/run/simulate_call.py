"""A recipe's members as arrays, in no lake: what `flagdata.simulate` does."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.answer.simulated import Simulated
from flagdata.errors import InputError, UsageError
from flagdata.recipes.shelves import parse_recipe
from sim.run.member_batch import BatchOutcome, Stepper
from sim.run.members import Crew
from sim.run.publish import batches, check_device, outcomes
from sim.run.simulation_recipe import Recipe
from sim.run.simulation_toml import SCENES, of_content

Content = Mapping[str, Any]
PLAIN: Content = {"material": {"name": "camel-ponte-roma"}}
"""What is simulated where no recipe is named: a flag of a measured knit."""


def simulate_members(
    recipe: str | Content | None, overrides: Content, *, device: str, workers: int
) -> Simulated:
    """Simulates the members of a recipe, with entries of the caller's in place of its own.

    Args:
        recipe: name of a recipe of the catalog, path of a TOML file, its content, or None for the
            overrides alone.
        overrides: entries and tables put in place of the recipe's, a table's entries one by one.

    Raises:
        FlagdataError: see `flagdata.simulate`.
    """
    if workers < 1:
        raise UsageError(f"{workers} workers", where="workers", fix="give at least one")
    check_device(device)
    crew = Crew(recipe_of(recipe, overrides))
    steppers = [Stepper.of(crew, base) for base in range(len(crew.recipe.material.bases))]
    waiting = batches(crew, steppers, range(crew.recipe.count))
    members = [
        outcome
        for _, batch in outcomes(crew, waiting, device=device, workers=workers, progress=None)
        for outcome in batch
    ]
    return _answer(crew.recipe, sorted(members, key=lambda outcome: outcome.member.index))


def recipe_of(recipe: str | Content | None, overrides: Content) -> Recipe:
    """Reads a recipe and puts the overrides in place of its entries; as `simulate_members`."""
    name, folder, where = "simulation", Path(), "recipe"
    if isinstance(recipe, str):
        file = SCENES.find(recipe)
        name, folder, where = file.name, file.folder, file.where
        recipe = parse_recipe(file.text, where=file.where)
    content = dict(PLAIN if recipe is None else recipe)
    for key, value in overrides.items():
        entry = content.get(key)
        content[key] = (
            {**entry, **value}
            if isinstance(entry, Mapping) and isinstance(value, Mapping)
            else value
        )
    return of_content(content, name=name, folder=folder, where=where)


def _answer(recipe: Recipe, members: list[BatchOutcome]) -> Simulated:
    complete = [member for member in members if member.sequence is not None]
    failed = {
        member.member.index: member.failure[1] for member in members if member.failure is not None
    }
    if not complete:
        raise InputError(
            f"none of {len(members)} members was simulated to the end: "
            f"{next(iter(failed.values()))}",
            where=recipe.name,
            fix="declare more damping, or a smaller step",
        )
    names = [
        name for name, value in complete[0].member.parameters.items() if isinstance(value, float)
    ]
    return Simulated(
        name=recipe.name,
        members=tuple(member.sequence for member in complete if member.sequence is not None),
        failed=failed,
        wind=np.stack([member.wind for member in complete]),
        parameters={
            name: np.array(
                [member.member.parameters[name] for member in complete], dtype=np.float64
            )
            for name in names
        },
    )
