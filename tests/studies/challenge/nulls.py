"""Null recordings for the sets of a challenge: of each design its own, by what every participant
knows of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flagdata.core.files.outputs import check_folder
from flagdata.core.provenance import code_version
from flagdata.core.rng import child_seed
from flagdata.errors import ConflictError, UsageError
from flagdata.lake import Lake
from flagdata.recipes.documents import read_json
from measure.forecasting import Setting
from measure.nulls import NullBatch, null_plan, winds
from measure.trajectories import Experiment
from measure.trajectories import experiment_recipe as recipes
from tests.studies.challenge.folder import ChallengeFolder, write_json


@dataclass(frozen=True, kw_only=True, eq=False)
class DesignNulls:
    """Nulls of one design, not simulated yet.

    Attributes:
        folder: that they are built into.
        title: of what they are made from.
        batches: one a kind.
    """

    folder: Path
    title: str
    batches: list[NullBatch]


def design_of(experiment: Experiment) -> str:
    """Names what a set's nulls have to share with it: the nominal cloth, rate and noise, and
    whether its wind varies. Markers are the same in all sets of a challenge."""
    recordings = experiment.recordings
    wind = "varying" if any(winds.fluctuates(own) for own in recordings) else "steady"
    noise = max(own.noise for own in recordings)
    return f"{experiment.specimen.material.name}-{recordings[0].rate:g}hz-{1e3 * noise:g}mm-{wind}"


def nulls_of_sets(
    folder: Path, challenge: ChallengeFolder, *, seed: int, kinds: int
) -> list[DesignNulls]:
    """The nulls of each design among a challenge's sets, over the winds of all its sets, each in a
    folder of its own.

    Raises:
        UsageError: sets of films.
        FlagdataError: as `ChallengeFolder.experiment`.
    """
    if challenge.filmed:
        raise UsageError(
            "films need no bank: their simulations are kept as the first set is judged",
            where=f"--sets {challenge.path}",
            fix="run `python -m tests.studies challenge run` with --bank, the folder to keep them in",
        )
    settings: dict[str, list[Setting]] = {}
    for name in challenge.names():
        experiment = challenge.experiment(name)
        settings.setdefault(design_of(experiment), []).append(Setting.of(experiment))
    title = challenge.manifest()["title"]
    return [
        DesignNulls(
            folder=folder / design,
            title=f"{title}: {design}",
            batches=null_plan.batches(*alike, kinds=kinds, seed=child_seed(seed, design)),
        )
        for design, alike in sorted(settings.items())
    ]


def nulls_of_recordings(
    folder: Path, recipe: Path, *, seed: int, kinds: int, lake: Lake | None
) -> DesignNulls:
    """The nulls of the recordings that a recipe of close-loop names.

    Args:
        lake: that artifacts are read from; None where there is none.

    Raises:
        FlagdataError: as the reader of such recipes.
    """
    experiment = recipes.load(recipe)
    setting = Setting.of(recipes.read(experiment, lake).experiment)
    return DesignNulls(
        folder=folder,
        title=experiment.title,
        batches=null_plan.batches(setting, kinds=kinds, seed=seed),
    )


def claim(nulls: DesignNulls, *, seed: int) -> None:
    """Note what the nulls of a folder are made from, so that a build that was stopped goes on with
    the same.

    Raises:
        ConflictError: the folder's are of another recipe or seed, or the folder holds something
            else.
    """
    folder = nulls.folder
    made = {"recipe": nulls.batches[0].identity(), "title": nulls.title, "seed": seed}
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
