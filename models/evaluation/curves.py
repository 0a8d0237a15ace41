"""Scores against what a model was given: how many sequences it was trained on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from flagdata.errors import InputError
from models.evaluation.bootstrap import ScoreEstimate


@dataclass(frozen=True, kw_only=True)
class LearningPoint:
    """RMSE of wind speed after training on so many sequences.

    Attributes:
        score: [m/s].
    """

    JSON_NAMES: ClassVar = ("label", "sequences", "rmse=score.value", "interval=score.interval")

    label: str
    sequences: int
    score: ScoreEstimate

    def __post_init__(self) -> None:
        check_point(f"learning curve of {self.label!r}", self.sequences, "sequences", self.score)


def check_point(where: str, size: int, noun: str, score: ScoreEstimate) -> None:
    """Refuses a point of a curve that makes no sense.

    Args:
        where: the curve, for messages.
        size: what the model was given, in so many of `noun`.

    Raises:
        InputError: nothing was given, or the score is no number with its interval.
    """
    low, high = score.quantity.interval
    if size < 1 or not 0 <= score.value < float("inf") or not low <= high:
        raise InputError(
            f"{score.value:g} [{low:g}, {high:g}] at {size} {noun} is no score with its interval",
            where=where,
            fix=f"give a positive number of {noun}, a finite score and the lower end of the "
            "interval first",
        )
