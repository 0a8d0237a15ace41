"""Null recordings for the sets of a challenge, by what every participant knows of them."""

from __future__ import annotations

import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.files.outputs import check_folder
from flagdata.core.provenance import code_version, recipe_hash
from flagdata.core.rng import child_seed, stream
from flagdata.errors import ConflictError, InputError, UsageError
from flagdata.lake import Lake
from flagdata.recipes.documents import read_json
from measure.forecasting import Cut, Setting
from measure.nulls import NullBatch, null_plan
from measure.nulls import bank as banks
from measure.trajectories import Specimen
from measure.trajectories import experiment_recipe as recipes
from sim.cloth import handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from tests.studies.challenge.folder import HEIGHT, MODEL_COLUMNS, MODEL_ROWS, write_json
from tests.studies.challenge.meshes import layout
from tests.studies.challenge.recipe import ChallengeRecipe, load


def null_batches(recipe: ChallengeRecipe, *, seed: int, kinds: int) -> list[NullBatch]:
    """For an amortised null: so many meshes and methods, each with its cloth, rate, noise and
    layout of markers.

    Of the recipe its cloths, markers, rates, noises and winds are used. Its numerics are not: those
    are the truth's.

    Args:
        seed: of all that is drawn; not the challenge's.

    Raises:
        InputError: recordings too short for a segment.
    """
    mesh = grid(width=recipe.width, height=recipe.height, columns=MODEL_COLUMNS, rows=MODEL_ROWS)
    held = handles.corners(mesh.rest)
    along_pole = np.array([(0.0, 0.0, HEIGHT + mesh.rest[vertex, 1]) for vertex in held])
    speeds = banks.around(recipe.speed.low, recipe.speed.high)
    made: list[NullBatch] = []
    for index in range(kinds):
        own = child_seed(seed, "null", index)
        rng = stream(own, "design")
        rate = float(recipe.rates[int(rng.integers(len(recipe.rates)))])
        noise = recipe.noises[int(rng.integers(len(recipe.noises)))]
        frames = round(recipe.duration * rate)
        cut = Cut.of(rate, frames)
        if not cut.enough:
            raise InputError(
                f"recordings of {recipe.duration:g} s are too short",
                where=recipe.title,
                fix="let them last for 10 s",
            )
        specimen = Specimen(
            mesh=mesh,
            material=named_material(recipe.materials[index % len(recipe.materials)]),
            held=held,
            anchors=along_pole,
            stiffness=handles.ARCSIM_STIFFNESS,
            anchors_given=False,
        )
        made.append(
            banks.prior_batch(
                specimen,
                markers=layout(recipe, stream(own, "layout")),
                rate=rate,
                noise=noise,
                speeds=speeds,
                duration=cut.lasting(banks.segments_of_each(recipe.count * cut.segments(frames))),
                seed=own,
            )
        )
    return made


@dataclass(frozen=True, kw_only=True)
class Origin:
    """What nulls are made from: a recipe's title, and the hash of all that shapes them."""

    title: str
    recipe: str


def nulls_of(
    recipe: str, *, seed: int, kinds: int, lake: Lake | None
) -> tuple[Origin, list[NullBatch]]:
    """The nulls of a challenge's recipe, or of the recordings that a recipe of close-loop names.

    Args:
        lake: that artifacts are read from; None where there is none.

    Raises:
        UsageError: a recipe of films.
        FlagdataError: as the readers of either.
    """
    path = Path(recipe)
    if not (path.suffix == ".toml" and path.is_file() and _of_recordings(path)):
        loaded = load(recipe)
        if loaded.films is not None:
            raise UsageError(
                "films need no bank: their simulations are kept as the first set is judged",
                where=f"--recipe {recipe}",
                fix="run `python -m tests.studies challenge run` with --bank, the folder to keep "
                "them in",
            )
        made = null_batches(loaded, seed=seed, kinds=kinds)
        return Origin(title=loaded.title, recipe=recipe_hash(_content(loaded))), made
    experiment = recipes.load(path)
    setting = Setting.of(recipes.read(experiment, lake).experiment)
    origin = Origin(title=experiment.title, recipe=null_plan.design_hash(setting))
    return origin, null_plan.batches(setting, kinds=kinds, seed=seed)


def _content(recipe: ChallengeRecipe) -> dict[str, Any]:
    """What nulls of markers are made from: as before there were films, so that older folders are
    known again."""
    return {name: value for name, value in asdict(recipe).items() if name != "films"}


def _of_recordings(path: Path) -> bool:
    """Whether a recipe names recordings, as those of close-loop do and those of challenges do
    not."""
    try:
        return isinstance(tomllib.loads(path.read_text(encoding="utf-8")).get("recording"), list)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        return False  # the challenge's reader says what is wrong with it


def claim(folder: Path, origin: Origin, *, seed: int) -> None:
    """Note what the nulls of a folder are made from, so that a build that was stopped goes on with
    the same.

    Raises:
        ConflictError: the folder's are of another recipe or seed, or the folder holds something
            else.
    """
    made = {"recipe": origin.recipe, "title": origin.title, "seed": seed}
    path = folder / "bank.json"
    if not path.exists():
        check_folder(folder)
        write_json(path, {**made, "code": code_version()})
        return
    noted = read_json(path, noun="note of what the nulls are made from")
    for key in ("title", "recipe", "seed"):
        if noted.get(key) != made[key]:
            raise ConflictError(
                f"its nulls are of {key} {noted.get(key)!r}, not {made[key]!r}",
                where=str(folder),
                fix="name a folder that is not there yet",
            )
