"""How far out in the tail of plain clips a score lies, on one scale for all scores."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betainc

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

BODY = 0.8
"""Share of the plain clips below the start of a tail. Higher leaves fewer clips to estimate a tail
from; lower takes for a tail what is not yet one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ExponentialTails:
    """Exponential tails of scores, all of them suspicious when high.

    Attributes:
        start: (c,) `BODY` quantile of each score over plain clips.
        excess: (c,) mean excess over it, not less than the score's resolution.
    """

    start: FloatArray
    excess: FloatArray

    @classmethod
    def of(cls, scores: FloatArray, resolution: FloatArray) -> ExponentialTails:
        """Measure them on scores (n, c) of plain clips.

        Raises:
            InputError: fewer than 20 clips.
        """
        if len(scores) < 20:
            raise InputError(f"{len(scores)} clips are too few for a tail", fix="give at least 20")
        start = np.quantile(scores, BODY, axis=0)
        beyond = np.maximum(scores - start, 0)
        excess = beyond.sum(axis=0) / np.maximum((beyond > 0).sum(axis=0), 1)
        return cls(start=start, excess=np.maximum(excess, resolution))

    def surprise(self, scores: FloatArray) -> FloatArray:
        """Returns excesses (…, c) over the start of the tail in mean excesses: each one more is e
        times rarer."""
        return (scores - self.start) / self.excess


def level(count: int, false_alarm: float, confidence: float) -> float:
    """Chooses the p at or below which a clip is refused, so that the false-alarm rate keeps to what
    is stated.

    Given the calibration clips, the rate at which familiar clips have p ≤ k/(n + 1) is distributed
    as Beta(k, n + 1 − k) (Vovk, Asian Conference on Machine Learning 2012, proposition 2a). k is
    the largest at which this rate is at most `false_alarm` with probability `confidence`.

    Args:
        count: n, of the calibration clips.

    Raises:
        InputError: shares that are not between 0 and 1, or too few clips for the rate.
    """
    if not (0 < false_alarm < 1 and 0 < confidence < 1):
        raise InputError(
            f"the false-alarm rate is {false_alarm:g} and the confidence {confidence:g}",
            fix="give shares between 0 and 1",
        )
    k = np.arange(1, count + 1)
    admissible = np.flatnonzero(betainc(k, count + 1 - k, false_alarm) >= confidence)
    if len(admissible) == 0:
        fewest = int(np.ceil(np.log(1 - confidence) / np.log(1 - false_alarm)))
        raise InputError(
            f"{count} calibration clips are too few for a false-alarm rate of {false_alarm:g}",
            fix=f"give at least {fewest} clips, or a higher rate",
        )
    return float(k[admissible[-1]]) / (count + 1)
