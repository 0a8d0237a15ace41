"""Networks beside what needs none, as a paper's table has it: `python -m tests.studies yardsticks
--help`.

Table, page and document are those of `flagdata evaluate`. Beside them stand ridge regression and
gradient boosting on hand-made features, triplet accuracies of clips of other lengths, what a linear
model reads from embeddings, an embedding in the plane, and what the paper printed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import click

from flagdata.api.learning import Evaluating
from flagdata.core.console import echo_lines, progress, say
from flagdata.core.files.addresses import local_path
from flagdata.core.stated import Stated
from flagdata.dataset import Pairs
from flagdata.dataset.lake_source import open_source
from flagdata.errors import InputError, UnknownNameError
from flagdata.verbs.verb_options import Result, option, options, verb
from models.evaluation import Predictions, evaluation_report
from models.evaluation.evaluate_command import Desk
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.trained.estimator import Estimator
from models.training import Prepared, prepare_films
from models.training.inputs import film_rows
from tests.studies.yardsticks.feature_baselines import check_stated, predictions
from tests.studies.yardsticks.readouts import (
    Films,
    FramesPoint,
    quantities,
    readouts,
    takes_any_length,
    triplet_accuracies,
)
from tests.studies.yardsticks.sections import Yardsticks, answer_beside
from tests.studies.yardsticks.tsne import layout


@options
class Measured(Evaluating):
    """Which networks are judged, on what, and what stands beside them."""

    handmade: bool = option("Add ridge and gradient boosting on hand-made features.", default=False)
    frames: tuple[int, ...] = option(
        "Triplet accuracy for clips of N frames (networks on maps only); may be repeated.",
        default=(),
        type=click.IntRange(min=4),
        metavar="N",
    )
    linear: bool = option(
        "How well a linear model predicts cloth parameters from each embedding.",
        default=False,
    )
    tsne: str | None = option(
        "Model whose embedding is drawn by t-SNE.", default=None, metavar="LABEL"
    )


@verb(Measured, example='yardsticks(["wave", "sdn"], lake="lake", at="v1", handmade=True)')
def yardsticks(chosen: Measured) -> Iterator[Result]:
    """Judge networks as flagdata evaluate does, beside a paper's yardsticks.

    \b
      python -m tests.studies yardsticks wave sdn --handmade --linear --lake lake --out evaluation
    """
    out = local_path(chosen.out)
    evaluation_report.check(out, name=chosen.name)
    source = open_source(chosen.lake)
    folder, workers, seed = chosen.inputs(source.lake), chosen.processes, chosen.seed
    weight = None if chosen.area_weight is None else Stated.of(chosen.area_weight)
    desk = Desk(source, chosen.dataset, chosen.at, folder, workers, seed, weight)
    found = desk.choose(chosen.models, chosen.side)
    pairs = desk.side(chosen.side)
    parameters = pairs.table.parameter_columns()
    # First: what no clip states and lengths that no film has are refused before the rest is
    # computed.
    if chosen.handmade:
        check_stated(desk.side("train"), pairs)
    if chosen.linear:
        quantities(parameters)
    films = partial(_films, pairs, folder, workers)
    triplets = _triplets([estimator for _, estimator in found], chosen.frames, films, seed=seed)
    judged = desk.judge(found, chosen.side)
    if chosen.handmade:
        judged.evaluated += predictions(
            desk.side("train"), pairs, cache=folder, workers=workers, seed=seed, bars=progress
        )
    evaluation = desk.evaluation(judged, side=chosen.side, reference=chosen.reference)
    beside = Yardsticks(
        frames=triplets,
        reads=readouts(judged.shown, parameters, data=evaluation.data, seed=seed)
        if chosen.linear
        else (),
        layout=None
        if chosen.tsne is None
        else layout(_labelled(judged.shown, chosen.tsne), seed=seed),
    )
    answer, words = answer_beside(evaluation, beside)
    evaluation_report.write_answer(answer, words, out, name=chosen.name)
    yield Result("evaluation", answer.document, answer=answer)
    echo_lines(words)
    for written in evaluation_report.names(chosen.name):
        say(str(out / written))


def _labelled(shown: Sequence[Predictions], label: str) -> Predictions:
    """Returns the first run of a model; raises UnknownNameError."""
    for run in shown:
        if run.label == label:
            return run
    raise UnknownNameError.of("model", label, [run.label for run in shown])


def _films(
    pairs: Pairs, folder: Path, workers: int, front_end: FrontEnd, cropping: Cropping
) -> Prepared:
    """Prepares one clip of each film of a side."""
    count = len(film_rows(pairs, sequences=None, seed=0))
    with progress(count, f"prepare {front_end.frames} frames", "film") as advance:
        return prepare_films(
            pairs,
            front_end,
            cropping,
            variants=1,
            folder=folder,
            workers=workers,
            advance=advance,
        )


def _triplets(
    chosen: Sequence[Estimator], frames: Sequence[int], films: Films, *, seed: int
) -> list[FramesPoint]:
    """Computes triplet accuracies of the networks on maps, by label, for clips of so many
    frames."""
    labels: dict[str, list[Estimator]] = {}
    for estimator in chosen:
        if takes_any_length(estimator):
            labels.setdefault(estimator.name, []).append(estimator)
    if frames and not labels:
        raise InputError(
            "none of the networks is one on maps",
            where="--frames",
            fix="name one, such as wave or sdn, or leave --frames out",
        )
    return [
        point
        for runs in labels.values()
        for point in triplet_accuracies(runs, frames, films, seed=seed)
    ]
