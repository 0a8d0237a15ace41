"""One table of all models on the same clips: the contents of each row, and how its cells are
written."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import ClassVar

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from models.evaluation.bootstrap import LEVEL, Resamples, ScoreEstimate, estimate
from models.evaluation.predictions import AREA_WEIGHT, WIND, Predictions
from models.evaluation.predictive_calibration import LEVELS, coverage_values
from models.evaluation.scores import OF_UNIT, SCORES, rmse_bound
from models.evaluation.triplets import accuracy_values
from models.networks.targets import TARGETS

Values = Mapping[str, FloatArray]
"""Metric → (1 + draws,): its value in the data, then in each draw of sequences."""

OF_TARGETS = ("rmse", "relative_error", "bias", "r_squared", "pearson")
"""Scores that are shown of every target."""
_UNITS = {"rmse": "m/s", "bias": "m/s"}
"""Of the metrics of the table that are no ratios."""
_UNIT_OF = {target.name: target.unit for target in TARGETS.values()}
_NONE = "–"


@dataclass(frozen=True, kw_only=True)
class Row:
    """A model, or one run of it.

    Attributes:
        label: the model.
        run: counted from 1; None for the model, whose scores are means over its runs.
        runs: how many runs the row rests on.
        scores: by metric; a metric that the model has no output for is missing.
        spread: lowest and highest of the runs by metric; empty for one run.
        bound: the least RMSE [m/s] that goes with the accuracy: of several runs the mean of theirs,
            None without wind.
        parameters: of the network.
        milliseconds: a clip, mean over runs [ms].
        note: input size, epochs, what differs from the paper.
    """

    JSON_NAMES: ClassVar = (
        "label",
        "run",
        "runs",
        "scores",
        "range_of_runs",
        "bound",
        "parameters",
        "milliseconds",
        "note",
    )

    label: str
    run: int | None
    runs: int
    scores: dict[str, ScoreEstimate]
    spread: dict[str, tuple[float, float]]
    bound: float | None
    parameters: int
    milliseconds: float
    note: str

    @property
    def range_of_runs(self) -> dict[str, tuple[float, float]]:
        """Returns the spread of the metrics that all runs have."""
        return {name: ends for name, ends in self.spread.items() if np.isfinite(ends).all()}


@dataclass(frozen=True, kw_only=True)
class TargetRow:
    """Scores of one target by one model, means over its runs."""

    label: str
    target: str
    scores: dict[str, ScoreEstimate]


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A model's score less the reference's on the same draws of sequences; means over runs of
    both."""

    JSON_NAMES: ClassVar = ("label", "reference", "metric", "difference", "apart")

    label: str
    reference: str
    metric: str
    difference: ScoreEstimate

    @property
    def apart(self) -> bool:
        """Returns whether the interval of the difference leaves out zero."""
        ends = self.difference.interval
        return ends is not None and not ends[0] <= 0 <= ends[1]


def models(predictions: Sequence[Predictions]) -> dict[str, tuple[Predictions, ...]]:
    """Groups the runs by label, in the order given, all on the same clips.

    Raises:
        InputError: no predictions; clips, sequences or truths that differ; runs of one label that
            are not one model.
    """
    if not predictions:
        raise InputError(
            "there are no predictions", where="the table", fix="give those of at least one model"
        )
    for former, second in combinations(predictions, 2):
        check_same_clips(former, second)
    models_of: dict[str, tuple[Predictions, ...]] = {}
    for run in predictions:
        first = models_of.get(run.label, (run,))[0]
        same = (first.targets, first.parameters, first.samples is None, first.embedding is None)
        if same != (run.targets, run.parameters, run.samples is None, run.embedding is None):
            raise InputError(
                "two runs of it differ in targets, parameters, samples or embedding",
                where=f"model {run.label!r}",
                fix="give different models different labels",
            )
        models_of[run.label] = (*models_of.get(run.label, ()), run)
    return models_of


def check_same_clips(first: Predictions, second: Predictions) -> None:
    """Refuses two predictions that are not of the same clips in the same order.

    Raises:
        InputError: another number of clips, other sequences, or another truth of a target that both
            have.
    """
    where = f"{first.label!r} and {second.label!r}"
    fix = "evaluate all models on the same clips of the same split, in the same order"
    if not np.array_equal(first.group, second.group):
        raise InputError("the models were not tested on the same sequences", where=where, fix=fix)
    for target in set(first.targets) & set(second.targets):
        if not np.array_equal(
            first.truth[:, first.column(target)], second.truth[:, second.column(target)]
        ):
            raise InputError(
                f"the models were not tested on the same truth of {target}", where=where, fix=fix
            )


def metric_values(
    predictions: Predictions, resamples: Resamples, triplets: IntArray | None
) -> Values:
    """Computes every metric of the table that these predictions have an output for."""
    values = {}
    if WIND in predictions.targets:
        values = {
            name: SCORES[name].values(predictions, WIND, resamples)
            for name in ("rmse", "accuracy", "bias")
        }
    if AREA_WEIGHT in predictions.targets:
        values["area_weight_error"] = SCORES["relative_error"].values(
            predictions, AREA_WEIGHT, resamples
        )
    if predictions.samples is not None and WIND in predictions.targets:
        for level in LEVELS:
            values[_coverage_heading(level)] = coverage_values(predictions, WIND, level, resamples)
    if predictions.embedding is not None and triplets is not None:
        values["triplets"] = accuracy_values(predictions.embedding, triplets, resamples)
    return values


def _coverage_heading(level: float) -> str:
    return f"covered_{100 * level:.0f}"


def mean_values(runs: Sequence[Values]) -> Values:
    """Means over the runs of one model, draw by draw."""
    return {name: np.mean([run[name] for run in runs], axis=0) for name in runs[0]}


def rows(
    runs: tuple[Predictions, ...], values: Sequence[Values], resamples: Resamples
) -> tuple[Row, ...]:
    """Returns the model's row and, below it, its runs' if there are several."""
    first = runs[0]
    single = tuple(
        _row(
            predictions,
            resamples,
            run=number,
            runs=1,
            values=scores,
            spread={},
            bound=_bound(scores),
            speed=predictions.milliseconds,
        )
        for number, (predictions, scores) in enumerate(zip(runs, values, strict=True), start=1)
    )
    spread: dict[str, tuple[float, float]] = {}
    if len(runs) > 1:
        spread = {name: _ends([float(scores[name][0]) for scores in values]) for name in values[0]}
    bounds = [row.bound for row in single if row.bound is not None]
    mean_row = _row(
        first,
        resamples,
        run=None,
        runs=len(runs),
        values=mean_values(values),
        spread=spread,
        bound=float(np.mean(bounds)) if bounds else None,
        speed=float(np.mean([predictions.milliseconds for predictions in runs])),
    )
    notes = "; ".join(dict.fromkeys(predictions.note for predictions in runs if predictions.note))
    mean_row = replace(mean_row, note=notes)
    return (mean_row, *single) if len(runs) > 1 else (mean_row,)


def _row(
    predictions: Predictions,
    resamples: Resamples,
    *,
    run: int | None,
    runs: int,
    values: Values,
    spread: dict[str, tuple[float, float]],
    bound: float | None,
    speed: float,
) -> Row:
    return Row(
        label=predictions.label,
        run=run,
        runs=runs,
        scores={
            name: estimate(
                draws,
                name=name,
                unit=_UNITS.get(name, "1"),
                clips=predictions.clips,
                groups=resamples.groups,
            )
            for name, draws in values.items()
        },
        spread=spread,
        bound=bound,
        parameters=predictions.parameters,
        milliseconds=speed,
        note=predictions.note,
    )


def _bound(values: Values) -> float | None:
    return rmse_bound(float(values["accuracy"][0])) if "accuracy" in values else None


def _ends(values: list[float]) -> tuple[float, float]:
    return min(values), max(values)


def target_rows(runs: tuple[Predictions, ...], resamples: Resamples) -> tuple[TargetRow, ...]:
    """Scores every target of a model, means over its runs."""
    scored = []
    for target in runs[0].targets:
        values = {
            name: [SCORES[name].values(predictions, target, resamples) for predictions in runs]
            for name in OF_TARGETS
        }
        scores = {
            name: estimate(
                np.mean(of, axis=0),
                name=name,
                unit=_UNIT_OF[target] if name in OF_UNIT else "1",
                clips=runs[0].clips,
                groups=resamples.groups,
            )
            for name, of in values.items()
        }
        scored.append(TargetRow(label=runs[0].label, target=target, scores=scores))
    return tuple(scored)


def differences(
    values: Mapping[str, Values], reference: str, *, clips: int, groups: int, metrics: Sequence[str]
) -> tuple[Difference, ...]:
    """Computes paired differences of every other model against `reference`, for the metrics that
    both have.

    Args:
        values: of each label, means over its runs, all of the same resamples.
    """
    return tuple(
        Difference(
            label=label,
            reference=reference,
            metric=metric,
            difference=estimate(
                scores[metric] - values[reference][metric],
                name=metric,
                unit=_UNITS.get(metric, "1"),
                clips=clips,
                groups=groups,
            ),
        )
        for label, scores in values.items()
        if label != reference
        for metric in metrics
        if metric in scores and metric in values[reference]
    )


@dataclass(frozen=True, kw_only=True)
class TableColumn:
    """A column of the table: its heading, and its cell of a row as lines: the value first, what
    belongs to it below."""

    heading: str
    cell: Callable[[Row], tuple[str, ...]]


def number(value: float, digits: int) -> str:
    """Formats a number for people; a dash where it is undefined."""
    return f"{value:.{digits}f}".replace("-", "−") if np.isfinite(value) else _NONE


def digits(error: float) -> int:
    """Decimals that show an error to three significant digits, at least three."""
    return max(3, 2 - math.floor(math.log10(error))) if error > 0 else 3


def cell(score: ScoreEstimate | None, digits: int) -> tuple[str, ...]:
    """Formats a value, and its interval where it has one."""
    if score is None:
        return (_NONE,)
    if score.interval is None:
        return (number(score.value, digits), "no interval: one sequence")
    low, high = score.interval
    return (number(score.value, digits), f"[{number(low, digits)}, {number(high, digits)}]")


def _scored_cells(metric: str, digits: int) -> Callable[[Row], tuple[str, ...]]:
    def lines(row: Row) -> tuple[str, ...]:
        texts = cell(row.scores.get(metric), digits)
        if metric not in row.spread:
            return texts
        low, high = row.spread[metric]
        return (*texts, f"runs {number(low, digits)} to {number(high, digits)}")

    return lines


def _model(row: Row) -> tuple[str, ...]:
    if row.run is not None:
        return (f"{row.label}, run {row.run}",)
    return (row.label, f"mean of {row.runs} runs") if row.runs > 1 else (row.label,)


def _coverage(row: Row) -> tuple[str, ...]:
    scores = [row.scores.get(_coverage_heading(level)) for level in LEVELS]
    if any(score is None for score in scores):
        return (_NONE,)
    values = " / ".join(number(100 * score.value, 0) for score in scores if score is not None)
    ends = [
        "–".join(number(100 * end, 0) for end in s.interval)
        for s in scores
        if s is not None and s.interval is not None
    ]
    return (values, f"[{', '.join(ends)}]") if ends else (values,)


COLUMNS = (
    TableColumn(heading="model", cell=_model),
    TableColumn(heading="wind RMSE [m/s]", cell=_scored_cells("rmse", 3)),
    TableColumn(
        heading="bound",
        cell=lambda row: (_NONE if row.bound is None else f"≥ {number(row.bound, 3)}",),
    ),
    TableColumn(heading="Acc@0.5", cell=_scored_cells("accuracy", 3)),
    TableColumn(heading="wind bias [m/s]", cell=_scored_cells("bias", 3)),
    TableColumn(heading="area weight error / spread", cell=_scored_cells("area_weight_error", 3)),
    TableColumn(heading="wind covered [%] at 50 / 80 / 90", cell=_coverage),
    TableColumn(heading="triplet accuracy", cell=_scored_cells("triplets", 3)),
    TableColumn(heading="parameters", cell=lambda row: (f"{row.parameters:,}",)),
    TableColumn(heading="ms a clip", cell=lambda row: (number(row.milliseconds, 1),)),
    TableColumn(heading="note", cell=lambda row: (row.note or _NONE,)),
)
LEGEND = (
    f"Brackets: {100 * LEVEL:.0f} % intervals, sequences drawn with replacement; of several runs "
    "they are the mean's "
    "and do not include the scatter between training runs, which the range of the runs shows. "
    "Bound: "
    "0.5 √(1 − Acc@0.5) m/s, the least RMSE that goes with the accuracy. Area weight error / "
    "spread: RMSE over the "
    "standard deviation of the true area weight over the clips tested, which are draws of its "
    "prior; 1 for a constant "
    "prediction of the mean."
)
