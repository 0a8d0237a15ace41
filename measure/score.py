"""How far estimates are from ground truth, with intervals that respect that clips of one recording are not independent.

RMSE and Acc@0.5 are the paper's two figures (Runia et al. 2020, tables 2 and 3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flagdata.errors import InputError

Statistic = Callable[[NDArray[np.float64]], float]


def rmse(error: NDArray[np.float64]) -> float:
    """Root of the mean squared error."""
    return float(np.sqrt(np.mean(np.square(error))))


def accuracy_within(limit: float) -> Statistic:
    """The share of errors of magnitude at most `limit`; Acc@0.5 is `accuracy_within(0.5)`."""

    def share(error: NDArray[np.float64]) -> float:
        return float(np.mean(np.abs(error) <= limit))

    return share


@dataclass(frozen=True, kw_only=True)
class Score:
    """A statistic of errors with its interval.

    Attributes:
        value: over all errors.
        low, high: bounds at `level`.
        count: number of errors.
        groups: number of independent groups (recordings, days, seeds); the interval rests on these, not on `count`.
    """

    value: float
    low: float
    high: float
    level: float
    count: int
    groups: int

    def __str__(self) -> str:
        level = f"{self.level:.0%}"
        return f"{self.value:.3g} [{self.low:.3g}, {self.high:.3g}] {level}, n = {self.count} in {self.groups} groups"


def score(
    estimate: ArrayLike,
    truth: ArrayLike,
    *,
    group: Sequence[str],
    rng: np.random.Generator,
    statistic: Statistic = rmse,
    level: float = 0.9,
    resamples: int = 2000,
) -> Score:
    """The statistic of `estimate - truth` with a percentile interval by cluster bootstrap over `group`.

    Whole groups are drawn with replacement (Davison and Hinkley 1997, section 3.8), so that thirty clips of one gusty
    afternoon do not pass for thirty measurements.

    Args:
        estimate, truth: (n,), same unit.
        group: (n,) what each pair belongs to.

    Raises:
        InputError: lengths that disagree, values that are not finite, or fewer than two groups, which have no interval.
    """
    error = np.asarray(estimate, dtype=np.float64) - np.asarray(truth, dtype=np.float64)
    labels = np.asarray(group)
    if error.ndim != 1 or labels.shape != error.shape or not np.all(np.isfinite(error)):
        raise InputError(
            f"estimates and truths of shape {error.shape} with {labels.shape} groups",
            fix="give finite vectors of one length",
        )
    names, index = np.unique(labels, return_inverse=True)
    if len(names) < 2:
        raise InputError("one group has no interval", fix="evaluate on two or more recordings")
    members = [error[index == i] for i in range(len(names))]
    draws = rng.integers(0, len(names), size=(resamples, len(names)))
    values = [statistic(np.concatenate([members[i] for i in draw])) for draw in draws]
    low, high = np.quantile(values, [(1 - level) / 2, (1 + level) / 2])
    return Score(
        value=statistic(error), low=float(low), high=float(high), level=level, count=len(error), groups=len(names)
    )
