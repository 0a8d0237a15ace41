"""The tables of an evaluation, for its page and in Markdown."""

from __future__ import annotations

from flagdata.answer.answer import Cell, Table
from models.evaluation import score_table
from models.evaluation.evaluation import Evaluation

_METRICS = {
    "rmse": "wind RMSE [m/s]",
    "accuracy": "Acc@0.5",
    "area_weight_error": "area weight error / spread",
    "triplets": "triplet accuracy",
}
_SCORES = {
    "rmse": "RMSE (SI)",
    "relative_error": "RMSE / spread",
    "bias": "bias (SI)",
    "r_squared": "R²",
    "pearson": "Pearson r",
}


def models(evaluation: Evaluation) -> Table:
    """Lists each model, and below it its runs, with the main scores."""
    return Table(
        columns=[column.heading for column in score_table.COLUMNS],
        rows=[[column.cell(row) for column in score_table.COLUMNS] for row in evaluation.rows],
        caption=score_table.LEGEND,
    )


def differences(evaluation: Evaluation) -> Table | None:
    """Lists the models' scores less the reference's."""
    by_model: dict[str, dict[str, score_table.Difference]] = {}
    for difference in evaluation.differences:
        by_model.setdefault(difference.label, {})[difference.metric] = difference
    if not by_model:
        return None
    metrics = [name for name in _METRICS if any(name in of for of in by_model.values())]

    def cell(of: dict[str, score_table.Difference], name: str) -> Cell:
        if name not in of:
            return "–"
        lines = score_table.cell(of[name].difference, 3)
        return (*lines, "beyond the interval") if of[name].apart else lines

    return Table(
        columns=("model", *(_METRICS[name] for name in metrics)),
        rows=[(label, *(cell(of, name) for name in metrics)) for label, of in by_model.items()],
    )


def targets(evaluation: Evaluation) -> Table:
    """Lists the scores of every target by every model."""
    order = list(dict.fromkeys(row.target for row in evaluation.targets))

    def cells(row: score_table.TargetRow) -> list[Cell]:
        decimals = score_table.digits(row.scores["rmse"].value)
        return [
            score_table.cell(row.scores[name], decimals if name in ("rmse", "bias") else 3)
            for name in _SCORES
        ]

    return Table(
        columns=("target", "model", *_SCORES.values()),
        rows=[
            (row.target, row.label, *cells(row))
            for row in sorted(evaluation.targets, key=lambda row: order.index(row.target))
        ],
    )


def learning(evaluation: Evaluation) -> Table | None:
    """Lists the points of the learning curve."""
    if not evaluation.learning:
        return None
    return Table(
        columns=("model", "sequences", "wind RMSE [m/s]"),
        rows=[
            (p.label, f"{p.sequences:,}", score_table.cell(p.score, 3)) for p in evaluation.learning
        ],
    )
