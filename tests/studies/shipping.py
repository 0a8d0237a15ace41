"""From trained networks of a lake to one model that comes with the package: `python -m
tests.studies shipping --help`.

Several seeds of one recipe become one estimator; its distributions are spread so that their
intervals on validation clips cover what they say; the summaries of the training clips are kept, so
that a clip unlike them is known. Weights are stored as float16, which moves an estimate by a
hundredth of its standard deviation.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import torch
from torch import Tensor

from flagdata.core.console import LocalPath, progress, say
from flagdata.core.files.checksums import write_sums
from flagdata.core.files.outputs import check_folder, fresh_folder
from flagdata.core.schema import Kind
from flagdata.errors import UsageError
from flagdata.recipes.documents import column_json
from models.evaluation.predict import embed_entries
from models.trained.estimator import CLOUD, SHIPPED, Estimator, load
from models.trained.model_folder import WEIGHTS, write_card, write_tensors
from models.trained.outliers import Familiarity
from models.training import Prepared

LEVELS = (0.5, 0.8, 0.9)
"""Central intervals whose coverage decides how far the distributions are spread."""
_WIDEST, _NARROWEST, _TRIED = 2.0, 0.5, 61
_DRAWS = 400
_KEPT = ("title", "recipe", "recipe_hash", "data", "code_version", "front_end", "cropping")


def widening(estimator: Estimator, validation: Prepared) -> tuple[float, ...]:
    """(target,) factors that bring the covered shares nearest to what the intervals say.

    The factor of a target is that of a geometric grid from 0.5 to 2 at which the summed squared
    differences between nominal and covered shares of `LEVELS` are smallest over the validation
    clips.
    """
    entries = np.arange(len(validation))
    inputs = validation.batch(entries, np.zeros(len(entries), dtype=np.int64))
    plain = replace(estimator, widening=torch.ones(len(estimator.targets)))
    logits = plain.logits(plain.embeddings(inputs), seed=0, draws=_DRAWS).double()
    names = estimator.learners[0].scaling.names
    stated = validation.truth(names)
    estimator.learners[0].scaling.check(stated, where="the validation side")
    truth = estimator.learners[0].scaling.learned(torch.from_numpy(stated)).double()
    centre = logits.mean(dim=1)
    factors = np.geomspace(_NARROWEST, _WIDEST, _TRIED)
    return tuple(
        float(
            factors[
                np.argmin(
                    [_miss(logits[..., k], centre[:, k], truth[:, k], factor) for factor in factors]
                )
            ]
        )
        for k in range(len(names))
    )


def _miss(logits: Tensor, centre: Tensor, truth: Tensor, factor: float) -> float:
    offset = (truth - centre) / factor
    below = ((logits - centre[:, None]) < offset[:, None]).double().mean(dim=1)
    central = 2 * (below - 0.5).abs()
    return sum((float((central <= level).double().mean()) - level) ** 2 for level in LEVELS)


def familiar(estimator: Estimator, train: Prepared, validation: Prepared) -> Familiarity:
    """The summaries of the training clips; the false-alarm rate is that of one validation clip a
    simulation."""
    first = np.unique(validation.sequence, return_index=True)[1]
    return Familiarity.of(
        embed_entries(estimator.learners[0], train),
        embed_entries(estimator.learners[0], validation)[first],
    )


def write(
    folder: Path, members: Sequence[Path], *, train: Prepared, validation: Prepared, name: str
) -> Estimator:
    """Make one model of trained ones.

    Args:
        folder: of the model, which is not there yet.
        members: folders of the trained networks.
        train, validation: what they were trained on and judged by, prepared.

    Raises:
        UsageError: networks of different recipes or data.
        ConflictError: a model, or anything else, is in the folder.
    """
    loaded = [load(member) for member in members]
    first = loaded[0]
    for other in loaded[1:]:
        if _seedless(first.card["recipe"]) != _seedless(other.card["recipe"]) or _learned(
            first.card["data"]
        ) != _learned(other.card["data"]):
            raise UsageError(
                f"{other.card['name']} was trained otherwise than {first.card['name']}",
                where=str(members),
                fix="ship seeds of one recipe, trained on the same data",
            )
    learners = tuple(one.learners[0].float() for one in loaded)
    joint = replace(first, learners=learners, name=name)
    found = widening(joint, validation)
    cloud = familiar(joint, train, validation)
    card: dict[str, Any] = {key: first.card[key] for key in _KEPT}
    card |= {
        "name": name,
        "members": len(learners),
        "seeds": [one.card["seed"] for one in loaded],
        "widening": list(found),
        "seed": first.card["seed"],
        "parameters": sum(w.numel() for one in learners for w in one.network.parameters()),
        "trained": {"films": len(train), "sequences": len(np.unique(train.sequence))},
    }
    tensors = {
        f"{place}.{key}": value.half() if value.is_floating_point() else value
        for place, learner in enumerate(learners)
        for key, value in learner.state_dict().items()
    }
    with fresh_folder(folder) as scratch:
        write_card(scratch, card)
        write_tensors(scratch / WEIGHTS, tensors)
        write_tensors(
            scratch / CLOUD, {key: torch.from_numpy(value) for key, value in cloud.arrays().items()}
        )
        write_sums(scratch)
    return load(folder)


def _learned(data: Any) -> dict[str, Any]:
    """What a network learned from; how its sides were decided, which older cards do not say,
    follows from it."""
    return {key: value for key, value in data.items() if key != "split_by"}


def _seedless(recipe: object) -> dict[str, Any]:
    """A recipe as JSON, without its seed."""
    return {**json.loads(json.dumps(recipe)), "seed": None}


@click.command()
@click.argument("name")
@click.option(
    "--lake",
    "lake_path",
    type=LocalPath(exists=True),
    required=True,
    help="Where the networks are.",
)
@click.option("--at", help="Version of the lake that they were trained at.")
@click.option(
    "--cache", type=LocalPath(), help="Folder of prepared inputs; by default LAKE.inputs."
)
@click.option(
    "--out", type=LocalPath(), default=SHIPPED, help="Folder of the models that are shipped."
)
def main(name: str, lake_path: Path, at: str | None, cache: Path | None, out: Path) -> None:
    """Make a model that comes with the package of all seeds that the training recipe NAME has in a
    lake."""
    import flagdata
    from models.training import load as recipe_of
    from models.training import prepare_clips, prepare_films, sides_of

    recipe = recipe_of(name)
    check_folder(out / recipe.name)
    source = flagdata.open(lake_path)
    networks = {"kind": Kind.NETWORK, "name": recipe.name}
    rows = source.lake.rows(networks, columns=["artifact", "object", "recipe"]).to_pylist()
    wanted = _seedless(recipe.identity())
    members = [
        source.lake.object_path(row["object"])
        for row in rows
        if _seedless(column_json(row["recipe"], "recipe", artifact=row["artifact"])["recipe"])
        == wanted
    ]
    if not members:
        raise UsageError(
            f"no network {recipe.name!r} was trained by its recipe",
            where=str(lake_path),
            fix="train it",
        )
    folder = cache if cache is not None else Path(f"{str(lake_path).rstrip('/')}.inputs")
    workers = os.cpu_count() or 1
    train, validation = (sides_of(source, recipe, side, at=at) for side in ("train", "validation"))
    with progress(len(train), label="prepare", unit="clip") as advance:
        inputs = prepare_films(
            train,
            recipe.front_end,
            recipe.cropping,
            variants=recipe.variants,
            folder=folder,
            workers=workers,
            advance=advance,
            augment=recipe.augment,
            sequences=recipe.data.sequences,
            seed=recipe.seed,
        )
    with progress(len(validation), label="prepare", unit="clip") as advance:
        judged = prepare_clips(
            validation,
            recipe.front_end,
            recipe.cropping,
            folder=folder,
            workers=workers,
            advance=advance,
        )
    shipped = write(out / recipe.name, members, train=inputs, validation=judged, name=recipe.name)
    say(
        f"{len(members)} networks, spread by "
        f"{', '.join(f'{factor:.2f}' for factor in shipped.widening.tolist())}"
    )
