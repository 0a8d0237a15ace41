"""`flagdata evaluate`: trained networks on clips that they never saw, in one table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flagdata.api.learning import Evaluating
from flagdata.core.console import echo_lines, progress, say
from flagdata.core.files.addresses import local_path
from flagdata.core.provenance import canonical
from flagdata.core.stated import Stated
from flagdata.timebase import NANOSECONDS
from flagdata.verbs.verb_options import Result, verb

if TYPE_CHECKING:
    import pyarrow as pa

    from flagdata.core.arrays import FloatArray, IntArray
    from flagdata.dataset import Pairs, Source
    from flagdata.dataset.pair_table import PairTable
    from flagdata.lake import Artifact
    from models.evaluation.curves import LearningPoint
    from models.evaluation.evaluation import Evaluation
    from models.evaluation.predictions import Predictions
    from models.maps.frontend import FrontEnd
    from models.trained.estimator import Estimator
    from models.training.inputs import Prepared
    from models.training.training_recipe import DataSpec

_BEFORE: dict[str, tuple[str, ...]] = {
    "train": (),
    "validation": ("train",),
    "test": ("train", "validation"),
}
"""Side → the sides that a network has learned from, or was selected by, before it is judged on
it."""


@verb(Evaluating, example='flagdata.evaluate(["flow", "sdn"], lake="lake", at="v1")')
def evaluate(chosen: Evaluating) -> Iterator[Result]:
    """Judge trained networks on one side of a data set and write the table.

    MODEL is a network of the lake by its name (all seeds of it) or the beginning of its id, or
    "shipped" for the one of flags that comes with the package, "shipped/NAME" for another. The
    clips are those of --at; networks are taken from the heads of main and of the branch of --at, so
    that a tag older than a network can be judged. Clips are cut and resampled to what each network
    takes. Networks that were trained on a part of the sequences make the learning curve.

    \b
      flagdata evaluate flow sdn --at v1 --lake lake --out evaluation
    """
    from flagdata.dataset.lake_source import open_source
    from models.evaluation import evaluation_report

    out = local_path(chosen.out)
    evaluation_report.check(out, name=chosen.name)
    source = open_source(chosen.lake)
    folder = chosen.inputs(source.lake)
    weight = None if chosen.area_weight is None else Stated.of(chosen.area_weight)
    desk = Desk(source, chosen.dataset, chosen.at, folder, chosen.processes, chosen.seed, weight)
    judged = desk.judge(desk.choose(chosen.models, chosen.side), chosen.side)
    evaluation = desk.evaluation(judged, side=chosen.side, reference=chosen.reference)
    answer = evaluation_report.write(evaluation, out, name=chosen.name)
    yield Result("evaluation", answer.document, answer=answer)
    echo_lines(evaluation_report.markdown(evaluation))
    for written in evaluation_report.names(chosen.name):
        say(str(out / written))


def refuse_learned(
    catalog: pa.Table, learned: Iterable[DataSpec], *, dataset: str, side: str
) -> None:
    """Refuses clips of a sequence or session that a network learned from, or was selected by, in
    whatever data set. The training side is judged as what it is.

    Args:
        catalog: rows of the lake.
        learned: the data sets of each network.
        dataset, side: to be judged.

    Raises:
        RefusedError: one is.
    """
    from flagdata.dataset.sides import explicit_sides
    from flagdata.dataset.splits import ExplicitSplit
    from models.training.training_recipe import DataSpec

    evaluated = {f"{side} of {dataset}": DataSpec(datasets=(dataset,)).where(side)}
    for datasets in {data.datasets for data in learned}:
        data = DataSpec(datasets=datasets)
        before = {
            f"{side_before} of {', '.join(datasets)}": data.where(side_before)
            for side_before in _BEFORE[side]
        }
        explicit_sides(catalog, ExplicitSplit(where={**evaluated, **before}))


def label_networks(found: Sequence[tuple[Artifact, Estimator]]) -> list[tuple[Artifact, Estimator]]:
    """Names networks of one name so that those of one training, which differ by their seeds alone,
    have one label.

    Where the recipe or the data changed meanwhile, the beginning of an artifact's identity is
    added.
    """
    trainings: dict[str, str] = {}
    keys = []
    for row, estimator in found:
        card = _card(estimator)
        recipe = {key: value for key, value in card["recipe"].items() if key != "seed"}
        recipe["data"] = {**recipe["data"], "sequences": None}  # a learning curve is of several
        data = {side: (card.get("data") or {}).get(side) for side in ("train", "validation")}
        keys.append(canonical({"recipe": recipe, "data": data}))
        trainings.setdefault(keys[-1], f"{estimator.name} {row.id[:8]}")
    if len(trainings) < 2:
        return list(found)
    return [
        (row, replace(model, name=trainings[key]))
        for (row, model), key in zip(found, keys, strict=True)
    ]


@dataclass(kw_only=True)
class Judged:
    """What models said of the clips of one side.

    Attributes:
        evaluated: models of the table.
        learned: networks of the lake, what each learned from, and what it said.
        curves: labels of networks that make a learning curve.
    """

    evaluated: list[Predictions] = field(default_factory=list)
    learned: list[tuple[Artifact, DataSpec, Predictions]] = field(default_factory=list)
    curves: set[str] = field(default_factory=set)

    @property
    def shown(self) -> list[Predictions]:
        """Returns the models of the table: those of learning curves where there are no others."""
        return self.evaluated or [predictions for *_, predictions in self.learned]


class Desk:
    """Where models are judged: a data set, and what was prepared of it."""

    def __init__(
        self,
        source: Source,
        dataset: str,
        at: str | None,
        cache: Path,
        workers: int,
        seed: int,
        area_weight: Stated | None,
    ) -> None:
        self._source, self._dataset, self._at = source, dataset, at
        self._known = {} if area_weight is None else {"area_weight": area_weight}
        self._cache, self._workers, self._seed = cache, workers, seed
        self._pairs: dict[str, Pairs] = {}
        self._head_of: dict[str, str] = {}
        self._prepared: dict[tuple[str, str], Prepared] = {}

    def choose(
        self, names: Sequence[str], side: str
    ) -> Sequence[tuple[Artifact | None, Estimator]]:
        """Finds networks by name that did not learn from the clips of a side and can judge them.

        Raises:
            InputError: films too short or too slow for a network, or that state none of its
                targets.
            RefusedError: a clip that one has learned from.
            UnknownNameError: no such network.
        """
        from models.training.training_recipe import DataSpec

        chosen = self._models(names)
        trained_on = [
            DataSpec.of_identity(_card(estimator)["recipe"]["data"]) for _, estimator in chosen
        ]
        refuse_learned(self._catalog(), trained_on, dataset=self._dataset, side=side)
        self._check([estimator for _, estimator in chosen], side)
        return chosen

    def judge(self, chosen: Sequence[tuple[Artifact | None, Estimator]], side: str) -> Judged:
        """Predicts the clips of a side by networks that were chosen for it."""
        from models.training.training_recipe import DataSpec

        judged = Judged()
        for row, estimator in chosen:
            predictions = self._predictions(estimator, side)
            data = DataSpec.of_identity(_card(estimator)["recipe"]["data"])
            if data.sequences is None or row is None:
                judged.evaluated.append(predictions)
            else:
                judged.curves.add(predictions.label)
            if row is not None:
                judged.learned.append((row, data, predictions))
        return judged

    def evaluation(self, judged: Judged, *, side: str, reference: str | None) -> Evaluation:
        """Scores the predictions for the clips of a side."""
        from models.evaluation.evaluation import evaluate as scored

        return scored(
            judged.shown,
            data=f"{self._dataset}, {side} side, at {self._at or 'head'}{self._statement_text}",
            seed=self._seed,
            reference=reference,
            learning=_points(
                [
                    (data.sequences or self._sequences(row, data), predictions)
                    for row, data, predictions in judged.learned
                    if predictions.label in judged.curves
                ]
            ),
            unseen=side != "train",
            split=side,
            split_by=self.side(side).split_by,
        )

    @cached_property
    def _heads(self) -> tuple[str, ...]:
        """Branches at whose heads networks are sought: main, to which `train` commits, and the one
        that is judged."""
        from flagdata.lake.refs import MAIN

        lake = self._source.lake
        shown = lake.view(self._at)[0].branch
        return (MAIN, shown) if shown in lake.refs.branches() else (MAIN,)

    def _catalog(self) -> pa.Table:
        """Reads the rows of the version that is judged and of the heads that networks come from,
        each once."""
        import pyarrow as pa

        lake = self._source.lake
        views = dict.fromkeys(lake.view(at) for at in (self._at, *self._heads))
        rows = pa.concat_tables([lake.table(view) for view in views])
        return rows.take(
            np.sort(
                np.unique(rows["artifact"].to_numpy(zero_copy_only=False), return_index=True)[1]
            )
        )

    def _check(self, chosen: Sequence[Estimator], side: str) -> None:
        """Checks that the clips of a side can be judged, before any is prepared.

        Raises:
            InputError: their films are too short or too slow for a model, or state none of its
                targets.
        """
        from models.evaluation.predict import judged_targets
        from models.networks.learner import Loss
        from models.training.stated_films import StatedFilms

        pairs = self.side(side)
        parameters = pairs.table.parameter_columns()
        films = StatedFilms.of(self._source.lake, pairs, at=self._at)
        for estimator in chosen:
            films.check_judged(estimator.front_end, estimator.cropping, model=estimator.name)
            fitted_on = []
            if estimator.learners[0].objective is Loss.CONTRASTIVE:
                fitted_on.append(self.side("train").table.parameter_columns())
            judged_targets(estimator, parameters, *fitted_on)

    def _models(self, names: Sequence[str]) -> list[tuple[Artifact | None, Estimator]]:
        from flagdata.core.schema import Kind
        from flagdata.errors import UnknownNameError
        from flagdata.lake.naming import COLUMNS, meant
        from models.trained import estimator

        lake = self._source.lake
        rows: dict[str, Mapping[str, Any]] = {}
        for head in self._heads:
            of_head = lake.rows({"kind": Kind.NETWORK}, at=head, columns=COLUMNS).to_pylist()
            rows |= {
                row["artifact"]: {**row, "head": head}
                for row in of_head
                if row["artifact"] not in rows
            }
        chosen: list[tuple[Artifact | None, Estimator]] = []
        for name in names:
            if name == "shipped" or name.startswith("shipped/"):
                ours = estimator.load_shipped(name.partition("/")[2] or estimator.DEFAULT)
                chosen.append(
                    (None, replace(ours, name=f"{ours.name}, as shipped"))
                )  # beside its seeds, if they are
                continue
            same = {row["artifact"]: row["head"] for row in meant(rows.values(), name)}
            if not same:
                raise UnknownNameError.of(
                    "network", name, sorted({row["name"] for row in rows.values()} | {"shipped"})
                )
            self._head_of |= same
            found = [lake.artifact(artifact, at=same[artifact]) for artifact in sorted(same)]
            chosen += label_networks(
                [(row, estimator.load(lake.object_path(str(row.object)))) for row in found]
            )
        return chosen

    def side(self, side: str) -> Pairs:
        """Returns the clips of a side of the data set."""
        from models.training.training_recipe import DataSpec

        if side not in self._pairs:
            self._pairs[side] = self._of(DataSpec(datasets=(self._dataset,)), side)
        return self._pairs[side]

    def _of(self, data: DataSpec, side: str) -> Pairs:
        data.check(self._source.lake, at=self._at)
        return self._source.pairs(data.rows, at=self._at, split=side)

    def _clips(self, side: str, estimator: Estimator) -> Prepared:
        from models.training.inputs import prepare_clips

        key = (side, estimator.front_end.hash)
        if key not in self._prepared:
            pairs = self.side(side)
            with progress(
                len(pairs), f"prepare {estimator.front_end.maps} of {side}", "clip"
            ) as advance:
                self._prepared[key] = prepare_clips(
                    pairs,
                    estimator.front_end,
                    estimator.cropping,
                    folder=self._cache,
                    workers=self._workers,
                    advance=advance,
                )
        return self._prepared[key]

    def _predictions(self, estimator: Estimator, side: str) -> Predictions:
        from models.evaluation.predict import predict, time_a_clip
        from models.networks.learner import Loss

        contrast = estimator.learners[0].objective is Loss.CONTRASTIVE
        return predict(
            estimator,
            self._clips(side, estimator),
            label=estimator.name,
            note=_note(estimator, self.side(side).table),
            seed=self._seed,
            milliseconds=time_a_clip(estimator, self.side(side)),
            known=self._known,
            fitted_on=self._clips("train", estimator) if contrast else None,
        )

    @property
    def _statement_text(self) -> str:
        """Describes in words what the user stated about all clips."""
        return "".join(
            f", area weight given as {statement.text} kg/m² (which only distributions use)"
            for statement in self._known.values()
        )

    def _sequences(self, network: Artifact, data: DataSpec) -> int:
        """Counts the sequences of these data sets that a network learned from, at the head that it
        comes from."""
        pairs = self._source.pairs(data.rows, at=self._head_of[network.id], split="train")
        return len(set(pairs.table.seed.tolist()))


def _card(estimator: Estimator) -> Any:
    return estimator.card


def _note(estimator: Estimator, table: PairTable) -> str:
    card = _card(estimator)
    shape = estimator.front_end
    size = f"{shape.frames}×{shape.size}×{shape.size}{_cut_out_of(table, shape)}"
    best = card.get("best") or {}
    epochs = f", {card['epochs']} epochs, best {best['number'] + 1}" if best else ""
    return f"{size}, {shape.maps}{epochs}, seed {card['seed']}"


def _cut_out_of(table: PairTable, shape: FrontEnd) -> str:
    """Says which clips the network's are cut out of; nothing where they are the catalog's as they
    are."""
    from models.training.timed_film import frame_rate, has_rate

    seconds = (table.end - table.start) / NANOSECONDS
    of = (
        ""
        if (table.frame_count == shape.frames).all()
        else f" of clips of {_from_to(table.frame_count)} frames"
    )
    if has_rate(table.frame_count, seconds, shape.rate).all():
        return of
    rates = _from_to(frame_rate(table.frame_count, seconds))
    return f" at {shape.rate:g} Hz{of or ' of clips'} at {rates} Hz"


def _from_to(values: FloatArray | IntArray) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"


def _points(learned: Sequence[tuple[int, Predictions]]) -> list[LearningPoint]:
    """Computes the RMSE of wind against the number of sequences, of each run; none where one
    sequence is judged, since that gives no interval."""
    from flagdata.core.rng import stream
    from models.evaluation.bootstrap import Resamples, estimate
    from models.evaluation.curves import LearningPoint
    from models.evaluation.predictions import WIND
    from models.evaluation.scores import SCORES

    points = []
    for sequences, run in sorted(learned, key=lambda point: (point[1].label, point[0])):
        resamples = Resamples.of(run.group, generator=stream(0, "learning"))
        if resamples.groups < 2:
            continue
        rmse = estimate(
            SCORES["rmse"].values(run, WIND, resamples),
            name="rmse",
            unit="m/s",
            clips=len(run.group),
            groups=resamples.groups,
        )
        points.append(LearningPoint(label=run.label, sequences=sequences, score=rmse))
    return points
