"""`flagdata train`: a network from the pairs of a lake.

A trained model as an artifact of the lake: weights and card in one object, its row in one commit.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.api.learning import Training
from flagdata.core.console import echo, progress, say
from flagdata.core.files.checksums import write_sums
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, code_version
from flagdata.core.schema import Kind
from flagdata.core.workload import announce_work
from flagdata.dataset import Pairs
from flagdata.errors import ConflictError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.lake.remaking import Remade
from flagdata.verbs.verb_options import AsJson, Result, verb
from models.trained.model_folder import WEIGHTS, read_card, write_card, write_tensors
from models.training.steps import Trained
from models.training.training_page import PAGE, JudgedClips, judge_clips, training_answer
from models.training.training_recipe import TrainingRecipe

PARENTS = 100
"""Recordings that a model's row names as what it was made from, at most; their number is in its
recipe."""


def data_identity(lake: Lake, train: Pairs, validation: Pairs, *, at: str | None) -> dict[str, Any]:
    """Identifies what a training learns from: the version of the lake, the pairs' fingerprints, and
    how the sides were decided."""
    return {
        "at": at,
        "view": [f"{part.branch}@{part.version}" for part in lake.view(at)],
        "train": train.fingerprint,
        "validation": validation.fingerprint,
        "split_by": train.split_by,
    }


def recordings_of(train: Pairs, validation: Pairs) -> list[str]:
    """Ids of the recordings that a training learns from, sorted."""
    return sorted({*train.table.recording.tolist(), *validation.table.recording.tolist()})


def network_artifact(
    lake: Lake,
    recipe: TrainingRecipe,
    data: dict[str, Any],
    recordings: Sequence[str],
    *,
    branch: str,
) -> Artifact:
    """Makes the row of a model without its result; its identity, hence, is what goes in: recipe,
    data and seed.

    Its parents are the first `PARENTS` of the recordings that the branch shows: of thousands, ids
    in order are a random sample. The fingerprints in its recipe state all data exactly.
    """
    ingredients = {
        "recipe": recipe.identity(),
        "data": {key: data[key] for key in ("train", "validation")},
        "recordings": len(recordings),
    }
    visible = lake.rows({"artifact": recordings}, at=branch, columns=["artifact"])[
        "artifact"
    ].to_pylist()
    parents = sorted(visible)[:PARENTS]
    return Artifact(
        kind=Kind.NETWORK, name=recipe.name, recipe=ingredients, seed=recipe.seed, parents=parents
    )


def card_of(
    recipe: TrainingRecipe, data: dict[str, Any], trained: Trained, *, batches: dict[str, Any]
) -> dict[str, Any]:
    """Describes a model, as JSON."""
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
        "cropping": json_values(recipe.cropping),
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
    judged: JudgedClips | None,
    page: Callable[[dict[str, Any]], str],
) -> tuple[Artifact, dict[str, Any], Remade | None]:
    """Commits a model and returns its row and card; one that is there already is kept, unless its
    object is damaged or
    missing: what was done about that is returned, too. A recording that was withdrawn
    from the branch since the training began is not among its parents.

    Args:
        judged: clips that validated; None of a network without targets.
        page: makes the training's page from the model's card.

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
        (staged / PAGE).write_text(page(card), encoding="utf-8")
        if judged is not None:
            judged.write(staged)
        write_sums(staged)
        best = {"epochs": card["epochs"], "best": card["best"], "parameters": card["parameters"]}
        artifact = replace(artifact, object=transaction.put(staged), parameters=canonical(best))
        transaction.add(artifact)
    return (
        transaction.result.artifacts[artifact.id],
        card,
        transaction.result.healed.get(artifact.id),
    )


_LONGEST_WAIT = timedelta(days=7)
_PREPARED = 0.05
"""s of one core for a crop: its maps take 0.03 to 0.04 (docs/results/bench-models.json), decoding
its film the rest."""

if TYPE_CHECKING:
    from collections.abc import Callable

    from flagdata.answer.answer import Answer
    from flagdata.dataset import Pairs, Source
    from flagdata.lake import Artifact
    from models.training.checkpoint import Standing
    from models.training.training_recipe import TrainingRecipe


@verb(Training, example='flagdata.train("flow", lake="lake", at="v1")')
def train(chosen: Training) -> Iterator[Result]:
    """Train a network on the clips of a lake and commit it as an artifact.

    RECIPE is a TOML file, or a recipe of the catalog: flow, wave, sdn and the networks they are
    compared with. Each film is decoded and filtered once, into the cache; steps then read from
    there. A training that was stopped or killed goes on from its last checkpoint when the command
    is given again.

    \b
      flagdata train flow --at v1 --lake lake
      torchrun --nproc-per-node 2 -m flagdata.cli train flow --at v1 --lake lake
    """
    from models.training.training_recipe import load

    loaded = load(str(chosen.recipe))
    if chosen.seed is not None:
        loaded = replace(loaded, seed=chosen.seed)
    if chosen.sequences is not None:
        loaded = replace(loaded, data=replace(loaded.data, sequences=chosen.sequences))
    answer = train_and_publish(loaded, chosen, bars=progress)
    if isinstance(chosen, AsJson) and _among_several() and os.environ["RANK"] != "0":
        return  # of the commands of a torchrun the first prints
    yield Result("train", answer.document, answer=answer)
    say(answer.sentence)
    trained = answer.document
    echo(f"{trained['artifact']}  network {trained['name']}, seed {trained['seed']}")


def _among_several() -> bool:
    """Returns whether this is one of several processes of a torchrun."""
    return "RANK" in os.environ and int(os.environ.get("WORLD_SIZE", "1")) > 1


def train_and_publish(
    recipe: TrainingRecipe,
    chosen: Training,
    *,
    bars: Callable[[int, str, str], AbstractContextManager[Callable[[int], None]]],
) -> Answer:
    """Prepares, trains and publishes; returns how far the training came. Of a torchrun the first
    rank publishes, and all return the same.

    Raises:
        FlagdataError: see `models.training.steps.Training.complete`,
            `flagdata.dataset.Source.pairs`.
    """
    import torch
    from torch import distributed as ranks

    from flagdata.core.files.file_locks import alone_in
    from flagdata.core.provenance import digest
    from flagdata.dataset.lake_source import open_source
    from flagdata.lake.remaking import present, said
    from models.training.beginning import check_clips
    from models.training.checkpoint import check_folder
    from models.training.inputs import film_rows, prepare_clips, prepare_films
    from models.training.steps import Training as Steps

    recipe.check()
    at, branch, workers, device = chosen.at, chosen.branch, chosen.processes, chosen.device
    if chosen.run is not None:
        check_folder(chosen.run)
    source = open_source(chosen.lake)
    source.lake.check_writable()
    cache = chosen.inputs(source.lake)
    train_pairs, validation_pairs = (
        sides_of(source, recipe, side, at=at) for side in ("train", "validation")
    )
    data = data_identity(source.lake, train_pairs, validation_pairs, at=at)
    recordings = recordings_of(train_pairs, validation_pairs)
    wanted = network_artifact(source.lake, recipe, data, recordings, branch=branch).id
    if source.lake.rows({"artifact": wanted}, at=branch, columns=["artifact"]).num_rows:
        existing = present(source.lake, source.lake.artifact(wanted, at=branch))
        if existing.whole is not None:
            say("this model was trained before")
            return answer_of_model(recipe, source.lake, existing.whole, validation_pairs)
        say(
            "this model was trained before, but its object is damaged or missing: it is trained "
            "again"
        )
    films = film_rows(train_pairs, sequences=recipe.data.sequences, seed=recipe.seed)
    check_clips(recipe, source.lake, train_pairs, validation_pairs, films=films, at=at)
    torch.set_num_threads(max(1, workers))
    several = _among_several()
    if several:
        device = device_of_rank(device)
        # The others wait while the first prepares the inputs, which takes hours where there are
        # many films.
        ranks.init_process_group("gloo" if device == "cpu" else "nccl", timeout=_LONGEST_WAIT)
    folder = (
        chosen.run if chosen.run is not None else cache / f"run-{recipe.name}-{digest(wanted)[:12]}"
    )
    locks = ExitStack()
    try:
        first = not several or ranks.get_rank() == 0
        if first:
            locks.enter_context(alone_in(folder, occupied=partial(_refuse, folder)))
        if several and not first:
            ranks.barrier()  # the first prepares the inputs for all
        if first:
            say(
                announce_work(
                    f"preparing {len(films)} films and {len(validation_pairs)} clips",
                    _PREPARED * (len(films) * recipe.variants + len(validation_pairs)),
                    workers=workers,
                    kept="what was prepared before is kept and taken up",
                )
            )
        with bars(len(films), f"{recipe.name}: prepare", "film") as advance:
            train_inputs = prepare_films(
                train_pairs,
                recipe.front_end,
                recipe.cropping,
                variants=recipe.variants,
                folder=cache,
                workers=workers,
                advance=advance,
                augment=recipe.augment,
                sequences=recipe.data.sequences,
                seed=recipe.seed,
            )
        with bars(
            len(validation_pairs), f"{recipe.name}: prepare what validates", "clip"
        ) as advance:
            validation_inputs = prepare_clips(
                validation_pairs,
                recipe.front_end,
                recipe.cropping,
                folder=cache,
                workers=workers,
                advance=advance,
            )
        if several and first:
            ranks.barrier()
        identity = {
            "recipe": recipe.identity(),
            "train": data["train"],
            "validation": data["validation"],
        }
        training = Steps(
            recipe=recipe,
            train=train_inputs.in_memory(),
            validation=validation_inputs.in_memory(),
            identity=identity,
            run=folder,
            device=torch.device(device),
            bars=bars,
        )
        if first:
            say(f"order of the first epoch: {training.batches.order_hash(0)}")
        standing = training.begin()
        if first:
            if standing.has_begun:
                say(
                    "the training goes on from its checkpoint: "
                    f"{_place(standing, recipe.optimiser.epochs)}"
                )
            if left := recipe.optimiser.epochs - len(standing.course.epochs):
                say(
                    announce_work(
                        f"training for up to {left} {'more ' if standing.has_begun else ''}epochs",
                        training.length(left) * workers,
                        workers=workers,
                        kept="an interrupted training goes on from its last checkpoint",
                    )
                )
        done = training.complete(standing)
        if several:
            ranks.barrier()  # no rank leaves while another still talks to it
        if first:
            judged = judge_clips(recipe, done.learner, training.validation)
            row, card, healed = publish(
                source.lake,
                recipe,
                data,
                recordings,
                done,
                batches=training.batches.state(),
                branch=branch,
                judged=judged,
                page=lambda card: training_answer(recipe, card, judged, validation_pairs).page,
            )
            if healed is not None:
                say(said(row.id, healed))
            answer = training_answer(recipe, card, judged, validation_pairs, artifact=row)
            if several:
                ranks.broadcast_object_list([row.id])
        else:
            published: list[Any] = [None]
            ranks.broadcast_object_list(published)
            row = source.lake.artifact(published[0], at=branch)
            answer = answer_of_model(recipe, source.lake, row, validation_pairs)
    finally:
        locks.close()
        if several:
            ranks.destroy_process_group()
    return answer


def answer_of_model(recipe: TrainingRecipe, lake: Lake, row: Artifact, pairs: Pairs) -> Answer:
    """Returns how far the training of a model of a lake came.

    Args:
        pairs: that validated it.

    Raises:
        CorruptError: the model is damaged.
    """
    folder = lake.object_path(str(row.object))
    judged = JudgedClips.read(folder, recipe)
    return training_answer(recipe, read_card(folder), judged, pairs, artifact=row)


def _place(standing: Standing, epochs: int) -> str:
    """Says where a training stands that was taken up."""
    done, steps = len(standing.course.epochs), standing.running[1]
    if steps:
        return f"from step {steps + 1} of epoch {done + 1} of {epochs}"
    return (
        f"from epoch {done + 1} of {epochs}" if done < epochs else f"all {epochs} epochs are done"
    )


def device_of_rank(device: str) -> str:
    """Chooses where this of several processes computes: each on a GPU of its own.

    Raises:
        UsageError: one GPU is named for all.
    """
    if device == "cpu":
        return device
    import torch

    if device != "cuda":
        raise UsageError(
            f"all processes of torchrun would compute on {device!r}",
            where="--device",
            fix="give cuda, then each takes a GPU of its own",
        )
    own = f"cuda:{os.environ.get('LOCAL_RANK', '0')}"
    torch.cuda.set_device(own)
    return own


def _refuse(folder: Path) -> None:
    raise ConflictError(
        "another training is under way in this folder",
        where=str(folder),
        fix="wait until it has ended, or name another folder by --run",
    )


def sides_of(source: Source, recipe: TrainingRecipe, side: str, *, at: str | None) -> Pairs:
    """Reads the pairs of one side of a recipe's data set.

    Raises:
        UnknownNameError: the lake has no such data set.
        NotFoundError, RefusedError: there are none, or the sides leak.
    """
    recipe.data.check(source.lake, at=at)
    return source.pairs(recipe.data.rows, at=at, split=side, seed=recipe.seed)
