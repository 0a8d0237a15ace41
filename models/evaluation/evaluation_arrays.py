"""The scores of an evaluation as arrays over models, targets and bins of the wind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flagdata.answer.answer import Array
from flagdata.core.arrays import FloatArray
from models.evaluation.bootstrap import ScoreEstimate
from models.evaluation.evaluation import Evaluation
from models.evaluation.score_table import OF_TARGETS

_ABOUT = {
    "rmse": "root mean square error of the wind",
    "accuracy": "share of clips whose wind is off by at most 0.5 m/s",
    "bias": "mean of estimated less true wind",
    "area_weight_error": "root mean square error of the area weight over its spread",
    "triplets": "share of triplets with the clip of the same simulation nearer",
    "relative_error": "root mean square error over the spread of the truth",
    "r_squared": "coefficient of determination",
    "pearson": "correlation of estimate and truth",
}


def arrays_of(evaluation: Evaluation) -> dict[str, Array]:
    """Returns each score over its dimensions, and beside it its interval, with a dimension "end":
    low, high. What a model does not give is NaN."""
    models = list(dict.fromkeys(row.label for row in evaluation.rows))
    targets = list(dict.fromkeys(row.target for row in evaluation.targets))
    bins = sorted({b.wind for model in evaluation.wind_errors for b in model.bins})
    of_model = {row.label: row.scores for row in evaluation.rows if row.run is None}
    arrays = {
        "model": Array(dimensions=("model",), values=np.array(models), coordinate=True),
        "end": Array(dimensions=("end",), values=np.array(["low", "high"]), coordinate=True),
    }
    for name in dict.fromkeys(name for scores in of_model.values() for name in scores):
        scores = {(label,): of[name] for label, of in of_model.items() if name in of}
        arrays |= _score(name, scores, {"model": models}, name)
    arrays["target"] = Array(dimensions=("target",), values=np.array(targets), coordinate=True)
    for name in OF_TARGETS:
        scores = {(row.label, row.target): row.scores[name] for row in evaluation.targets}
        dimensions = {"model": models, "target": targets}
        arrays |= _score(f"target_{name}", scores, dimensions, name)
    if bins:
        arrays["wind"] = Array(
            dimensions=("wind",),
            values=np.mean(bins, axis=1),
            unit="m/s",
            about="middle of the bin of the true wind",
            coordinate=True,
        )
        for name in ("rmse", "bias"):
            scores = {
                (model.label, b.wind): getattr(b, name)
                for model in evaluation.wind_errors
                for b in model.bins
            }
            dimensions = {"model": models, "wind": bins}
            arrays |= _score(f"{name}_by_wind", scores, dimensions, name)
    return arrays


def _score(
    name: str,
    scores: Mapping[Any, ScoreEstimate],
    dimensions: Mapping[str, Sequence[object]],
    metric: str,
) -> dict[str, Array]:
    """Returns a score and its interval, by the places on its dimensions that it is known at."""
    shape = tuple(len(places) for places in dimensions.values())
    values, ends = np.full(shape, np.nan), np.full((*shape, 2), np.nan)
    for key, score in scores.items():
        at = tuple(places.index(one) for one, places in zip(key, dimensions.values(), strict=True))
        values[at] = score.value
        ends[at] = _finite(score.quantity.interval)
    units = {score.quantity.unit for score in scores.values()}
    about = _ABOUT.get(metric, metric.replace("_", " "))
    unit = units.pop() if len(units) == 1 else "SI"
    return {
        name: Array(dimensions=tuple(dimensions), values=values, unit=unit, about=about),
        f"{name}_interval": Array(
            dimensions=(*dimensions, "end"),
            values=ends,
            unit=unit,
            about=f"90 % interval over sequences: {about}",
        ),
    }


def _finite(ends: tuple[float, float]) -> FloatArray:
    return np.where(np.isfinite(ends), ends, np.nan)
