"""A trained model as an artifact of the lake: weights and card in one object, its row in one commit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from flagdata.checksums import write_sums
from flagdata.dataset import Pairs
from flagdata.lake import Artifact, Lake
from flagdata.lake.healing import Healing
from flagdata.provenance import canonical, code_version
from flagdata.schema import Kind
from models.storage import WEIGHTS, write_card, write_tensors
from models.training.recipe import TrainingRecipe
from models.training.steps import Trained

CURVES = "curves.png"
PARENTS = 100
"""Recordings that a model's row names as what it was made from, at most; their number is in its recipe."""


def data_identity(lake: Lake, train: Pairs, validation: Pairs, *, at: str | None) -> dict[str, Any]:
    """What a training learns from: the version of the lake and the pairs' fingerprints."""
    return {
        "at": at,
        "view": [f"{part.branch}@{part.version}" for part in lake.view(at)],
        "train": train.fingerprint,
        "validation": validation.fingerprint,
    }


def recordings_of(train: Pairs, validation: Pairs) -> list[str]:
    """Ids of the recordings that a training learns from, sorted."""
    return sorted({*train.table.recording.tolist(), *validation.table.recording.tolist()})


def network_artifact(
    lake: Lake, recipe: TrainingRecipe, data: dict[str, Any], recordings: Sequence[str], *, branch: str
) -> Artifact:
    """The row of a model without its result; its identity, hence, is what goes in: recipe, data and seed.

    Its parents are the first `PARENTS` of the recordings that the branch shows: of thousands, ids in order are a random
    sample. The fingerprints in its recipe state all data exactly.
    """
    held = {
        "recipe": recipe.identity(),
        "data": {key: data[key] for key in ("train", "validation")},
        "recordings": len(recordings),
    }
    shown = lake.rows({"artifact": recordings}, at=branch, columns=["artifact"])["artifact"].to_pylist()
    parents = sorted(shown)[:PARENTS]
    return Artifact(kind=Kind.NETWORK, name=recipe.name, recipe=held, seed=recipe.seed, parents=parents)


def card_of(
    recipe: TrainingRecipe, data: dict[str, Any], trained: Trained, *, batches: dict[str, Any]
) -> dict[str, Any]:
    """The description of a model, as JSON."""
    learner = trained.learner
    best = trained.course.best
    return {
        "name": recipe.name,
        "title": recipe.title,
        "recipe": recipe.identity(),
        "recipe_hash": recipe.hash,
        "data": data,
        "code_version": code_version(),
        "seed": recipe.seed,
        "batches": batches,
        "front_end": asdict(recipe.front_end),
        "cropping": recipe.cropping.as_dict(),
        "parameters": sum(weights.numel() for weights in learner.network.parameters()),
        "epochs": len(trained.course.epochs),
        "best": None if best is None else asdict(best),
        "seconds": trained.seconds,
        "course": trained.course.as_list(),
    }


def publish(
    lake: Lake,
    recipe: TrainingRecipe,
    data: dict[str, Any],
    recordings: Sequence[str],
    trained: Trained,
    *,
    batches: dict[str, Any],
    branch: str,
) -> tuple[Artifact, dict[str, Any], Healing | None]:
    """Commit a model and return its row and card; one that is there already is kept, unless its object is damaged or
    missing: what was done about that is returned, too. A recording that was withdrawn
    from the branch since the training began is not among its parents.

    Raises:
        FlagdataError: the disk refuses it.
    """
    artifact = network_artifact(lake, recipe, data, recordings, branch=branch)
    with lake.transaction(f"train {recipe.name}, seed {recipe.seed}", branch=branch) as transaction:
        staged = transaction.staging(".model")
        staged.mkdir()
        write_tensors(staged / WEIGHTS, trained.learner.state_dict())
        card = card_of(recipe, data, trained, batches=batches)
        write_card(staged, card)
        (staged / CURVES).write_bytes(trained.course.picture())
        write_sums(staged)
        best = {"epochs": card["epochs"], "best": card["best"], "parameters": card["parameters"]}
        artifact = replace(artifact, object=transaction.put(staged), parameters=canonical(best))
        transaction.add(artifact)
    return transaction.result.artifacts[artifact.id], card, transaction.result.healed.get(artifact.id)
