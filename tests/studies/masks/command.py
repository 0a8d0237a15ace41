"""Make the network of the cloth's mask that comes with the package: `python -m tests.studies masks
--help`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click
import torch

from flagdata.core.console import LocalPath, say
from flagdata.core.files.checksums import write_sums
from flagdata.core.files.outputs import check_folder, fresh_folder
from flagdata.core.provenance import code_version, recipe_hash
from flagdata.lake import Lake
from models.conditioning.mask_network import FOLDER
from models.trained.model_folder import WEIGHTS, write_card, write_tensors
from tests.studies.masks.examples import batches, make, read
from tests.studies.masks.training import Scores, train


@click.command()
@click.option(
    "--lake",
    "lake_path",
    type=LocalPath(exists=True),
    required=True,
    help="Lake with the data sets' mesh sequences.",
)
@click.option(
    "--dataset",
    "datasets",
    multiple=True,
    default=("outdoor", "outdoor-damped"),
    show_default=True,
    help="Data set whose sequences are filmed.",
)
@click.option("--films", default=520, show_default=True, help="Number of films to train on.")
@click.option(
    "--judged", default=48, show_default=True, help="Films of the validation side that are judged."
)
@click.option("--epochs", default=12, show_default=True)
@click.option("--seed", default=2127, show_default=True)
@click.option("--workers", default=1, show_default=True, help="Processes that film.")
@click.option(
    "--examples",
    "kept",
    type=LocalPath(),
    required=True,
    help="Folder of the examples, kept between runs.",
)
@click.option("--out", type=LocalPath(), default=FOLDER, help="Folder of the network; new.")
def main(
    lake_path: Path,
    datasets: tuple[str, ...],
    films: int,
    judged: int,
    epochs: int,
    seed: int,
    workers: int,
    kept: Path,
    out: Path,
) -> None:
    """Film simulated flags, train the network of the cloth's mask on them, and write it with its
    card."""
    check_folder(out)
    lake = Lake.open(lake_path)
    for side, count in (("train", films), ("validation", judged)):
        make(
            lake,
            batches(lake, datasets, side=side),
            kept / side,
            count=count,
            seed=seed,
            workers=workers,
        )
    sides = {side: list(read(kept / side)) for side in ("train", "validation")}
    reached: list[Scores] = []

    def advance(epoch: int, loss: float, scores: Scores) -> None:
        reached.append(scores)
        say(
            f"epoch {epoch + 1} of {epochs}: loss {loss:.3f}, Dice {scores.dice:.3f}, ends "
            f"{scores.ends:.2f} px"
        )

    torch.set_num_threads(max(1, workers))
    network = train(sides["train"], sides["validation"], epochs=epochs, seed=seed, advance=advance)
    recipe: dict[str, Any] = {
        "datasets": list(datasets),
        "films": films,
        "judged": judged,
        "epochs": epochs,
        "seed": seed,
    }
    with fresh_folder(out) as scratch:
        write_card(
            scratch,
            {
                "name": "cloth-mask",
                "title": "The cloth and its hoist in pictures of a film that was made fit",
                "licence": "CC-BY-4.0",
                "recipe": recipe,
                "recipe_hash": recipe_hash(recipe),
                "seed": seed,
                "code_version": code_version(),
                "trained": {side: len(some) for side, some in sides.items()},
                "parameters": sum(w.numel() for w in network.parameters()),
                "scores": asdict(reached[-1]),
            },
        )
        tensors = {
            k: v.half() if v.is_floating_point() else v for k, v in network.state_dict().items()
        }
        write_tensors(scratch / WEIGHTS, tensors)
        write_sums(scratch)
