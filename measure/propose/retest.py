"""Before and after on data that neither the choice of the terms nor the fit of either model has seen."""

from __future__ import annotations

from measure.loop.comparison import paired, predict, root
from measure.loop.forecast import Forecaster, Segments
from measure.loop.model import Model
from measure.propose.outcome import Retest


def retest(forecaster: Forecaster, untouched: Segments, before: Model, after: Model, *, words: str) -> Retest:
    """Prediction errors of untouched segments by both models, paired by segment.

    Args:
        words: which data.
    """
    squared = [predict(forecaster, untouched, model).squared for model in (before, after)]
    return Retest(
        what=words, segments=len(untouched), before=root(squared[0]), after=root(squared[1]),
        reduction=paired(*squared),
    )  # fmt: skip
