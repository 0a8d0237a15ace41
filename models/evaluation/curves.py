"""Scores against what a model was given: how many sequences it was trained on, how many frames it
saw."""

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
        _check(f"learning curve of {self.label!r}", self.sequences, "sequences", self.score)


@dataclass(frozen=True, kw_only=True)
class FramesPoint:
    """Triplet accuracy of a model that sees so many frames."""

    JSON_NAMES: ClassVar = ("label", "frames", "accuracy=score.value", "interval=score.interval")

    label: str
    frames: int
    score: ScoreEstimate

    def __post_init__(self) -> None:
        where = f"triplet accuracy of {self.label!r} against frames"
        _check(where, self.frames, "frames", self.score)
        if self.score.value > 1:
            raise InputError(
                f"the triplet accuracy is {self.score.value:g}, above 1",
                where=where,
                fix="give a share, not per cent",
            )


def _check(where: str, size: int, noun: str, score: ScoreEstimate) -> None:
    low, high = score.quantity.interval
    if size < 1 or not 0 <= score.value < float("inf") or not low <= high:
        raise InputError(
            f"{score.value:g} [{low:g}, {high:g}] at {size} {noun} is no score with its interval",
            where=where,
            fix=f"give a positive number of {noun}, a finite score and the lower end of the "
            "interval first",
        )
