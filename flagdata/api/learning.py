"""Data sets built and networks trained on them, in Python.

The options of each call are stated in a class, from which the command of the same name is made,
too. The packages
behind the calls are named by strings: flagdata imports none of those that rest on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.core.console import LocalPath
from flagdata.core.files.addresses import lake_place
from flagdata.core.files.caches import beside
from flagdata.core.parts import attribute
from flagdata.verbs.option_types import POSITIVE, STATED
from flagdata.verbs.shared_options import AtVersion, Computed, OnBranch, OnLake, Shared
from flagdata.verbs.verb_options import argument, make_call, option, options

if TYPE_CHECKING:
    from flagdata.answer.answer import Answer
    from flagdata.core.stated import Stated
    from flagdata.lake import Lake

JUDGED = "What is judged"


@options
class Building(Computed, OnBranch, OnLake):
    """Which data set is built, and where."""

    recipe: Path | str = argument("A TOML file, or the name of a recipe of the catalog.", "RECIPE")
    plan: bool = option("Print counts, bytes and hours, and make nothing.", default=False)
    sequences: int | None = option(
        "Simulated sequences of all sides together, instead of the recipe's.",
        default=None,
        type=POSITIVE,
        metavar="N",
    )
    films: int | None = option(
        "Films of all sides together; by default as many a sequence as the recipe has.",
        default=None,
        type=POSITIVE,
        metavar="N",
    )
    shard: str | None = option(
        "Make one part of N, for builds on several machines, each on a branch of its own.",
        default=None,
        metavar="I/N",
    )
    scheduler: str | None = option(
        "A Dask scheduler, tcp://HOST:PORT; without it, this machine.",
        default=None,
        metavar="ADDRESS",
    )
    renderer: str | None = option(
        "raster, cycles or workbench, instead of the recipe's.", default=None, metavar="NAME"
    )
    card: Path | None = option(
        "Where the card goes; by default cards/.", default=None, type=LocalPath(), metavar="FILE"
    )


@make_call(Building)
def build(chosen: Building) -> Mapping[str, Any]:
    """Builds a data set in a lake, as `flagdata build` does: its sequences, films, ground truth and
    card.

    ```python
    planned = flagdata.build("flagsim-small", lake="lake", plan=True)
    built = flagdata.build("flagsim-small", lake="lake", workers=2)
    small = flagdata.build("flagsim-small", lake="lake", sequences=100, films=500)
    ```

    Returns:
        What `flagdata build --json` prints.

    Raises:
        MissingExtraError: torch is not installed, or Dask for a scheduler.
        UnknownNameError: no such recipe or renderer.
        UsageError: options that contradict each other.
    """
    return attribute("sim.datasets.build_command:build").result(chosen)


@options
class OfInputs(AtVersion, OnLake):
    """Where prepared inputs of networks are kept."""

    cache: Path | None = option(
        "Where prepared inputs are kept, outside the lake; by default beside it, LAKE.inputs.",
        default=None,
        type=LocalPath(),
        metavar="DIR",
    )

    def inputs(self, lake: Lake) -> Path:
        """Returns the folder of prepared inputs."""
        folder = lake_place(self.lake) if isinstance(self.lake, str | Path) else lake.path
        return beside(folder, ".inputs") if self.cache is None else self.cache


@options
class Training(OfInputs, Computed, OnBranch):
    """Which network is trained, and on what."""

    recipe: Path | str = argument("A TOML file, or the name of a recipe of the catalog.", "RECIPE")
    seed: int | None = option(
        "Seed of weights, crops and orders, instead of the recipe's.",
        default=None,
        type=click.IntRange(min=0),
    )
    sequences: int | None = option(
        "Simulations to learn from, instead of all.",
        default=None,
        type=click.IntRange(min=2),
        metavar="N",
    )
    run: Path | None = option(
        "Where the checkpoint is kept while it trains; by default in the cache.",
        default=None,
        type=LocalPath(),
        metavar="DIR",
    )


@make_call(Training)
def train(chosen: Training) -> Answer:
    """Trains a network on the clips of a lake and commits it as an artifact, as `flagdata train`
    does.

    ```python
    trained = flagdata.train("flow", lake="lake", at="v1")
    trained.document["artifact"], trained.document["best"]["validation"]  # id, loss
    trained.to_xarray()["validation_loss"]  # (epoch,)
    ```

    Returns:
        The answer, in each rank of a torchrun; its `document` is what `flagdata train --json`
        prints.

    Raises:
        ConflictError: another training is under way in the folder.
        InputError, UsageError: the recipe does not fit the clips; the fix is a line of the recipe.
        MissingExtraError: torch is not installed.
        NotFoundError: no such lake or version.
        RefusedError: the sides of the data set leak, or one is empty.
        UnknownNameError: no such recipe, or the lake has no such data set.
    """
    return attribute("models.training.train_command:train").result(chosen)


@options
class Evaluating(OfInputs, Shared):
    """Which networks are judged, on what, and what the table holds."""

    models: Sequence[str] = argument(
        "Networks of the lake by name or id, shipped, or shipped/NAME.", "MODEL...", nargs=-1
    )
    dataset: str = option(
        "Data set whose clips are judged.", default="flagsim-wide", section=JUDGED
    )
    side: str = option(
        "Side of the data set.",
        default="test",
        section=JUDGED,
        type=click.Choice(("train", "validation", "test")),
    )
    reference: str | None = option(
        "Model that the others are compared with; by default the best.",
        default=None,
        section=JUDGED,
        metavar="LABEL",
    )
    area_weight: float | tuple[float, float] | str | Stated | None = option(
        "Area weight of all clips, if it is known [kg/m²]: 0.284, 0.284±0.01 or 0.10:0.17.",
        default=None,
        section=JUDGED,
        type=STATED,
        metavar="VALUE",
    )
    out: Path | str = option(
        "Where the page, the table in Markdown and the JSON go.",
        default=Path("evaluation"),
        type=LocalPath(),
        metavar="DIR",
    )
    name: str = option("Name of the files, without their endings.", default="evaluation")
    seed: int = option(
        "Seed of the draws and of the bootstrap.", default=0, type=click.IntRange(min=0)
    )


@make_call(Evaluating)
def evaluate(chosen: Evaluating) -> Answer:
    """Judges trained networks on one side of a data set and writes the table, as `flagdata
    evaluate` does.

    ```python
    judged = flagdata.evaluate(["flow", "sdn"], lake="lake", at="v1", out="evaluation")
    judged.quantities["rmse"]  # of the model that reads the wind best
    judged.document["models"]  # all scores, as the JSON file has them
    ```

    Returns:
        The answer; its `document` is what `flagdata evaluate --json` prints.

    Raises:
        InputError: films too short or too slow for a network, or that state none of its targets.
        MissingExtraError: torch is not installed.
        NotFoundError: no such lake or version.
        RefusedError: a clip that a network has learned from.
        UnknownNameError: no such network or data set.
    """
    return attribute("models.evaluation.evaluate_command:evaluate").result(chosen)
