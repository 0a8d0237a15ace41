"""Scores against what a model was given: how many sequences it was trained on, how many frames it
saw."""

from __future__ import annotations

from dataclasses import dataclass

from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True)
class LearningPoint:
    """RMSE of wind speed [m/s] after training on so many sequences, with its interval."""

    label: str
    sequences: int
    rmse: float
    interval: tuple[float, float]

    def __post_init__(self) -> None:
        _check(
            f"learning curve of {self.label!r}",
            self.sequences,
            "sequences",
            self.rmse,
            self.interval,
        )


@dataclass(frozen=True, kw_only=True)
class FramesPoint:
    """Triplet accuracy of a model that sees so many frames, with its interval."""

    label: str
    frames: int
    accuracy: float
    interval: tuple[float, float]

    def __post_init__(self) -> None:
        where = f"triplet accuracy of {self.label!r} against frames"
        _check(where, self.frames, "frames", self.accuracy, self.interval)
        if self.accuracy > 1:
            raise InputError(
                f"the triplet accuracy is {self.accuracy:g}, above 1",
                where=where,
                fix="give a share, not per cent",
            )


def _check(where: str, size: int, noun: str, value: float, interval: tuple[float, float]) -> None:
    low, high = interval
    if size < 1 or not 0 <= value < float("inf") or not low <= high:
        raise InputError(
            f"{value:g} [{low:g}, {high:g}] at {size} {noun} is no score with its interval",
            where=where,
            fix=f"give a positive number of {noun}, a finite score and the lower end of the "
            "interval first",
        )
