"""Power curves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

# Priors of the power curve, so that it exists where all or none were detected. The slope on ln
# strength: a threshold on a statistic that grows as strength and has unit scatter at a threshold of
# 2 to 4 gives 2 to 6 (Gaussian ogive × 1.7).
_SLOPE, _SLOPE_SPREAD = 4.0, 0.5
_GROUP_SPREAD = 0.7
_STEP = 1e-3


@dataclass(frozen=True, kw_only=True)
class Power:
    """Chance of detection against strength: 1/(1 + (s/s½)^(−a)), s½ of each group, a common to all.

    Attributes:
        slope: a.
        half: group → s½ and its 90 % bounds (Laplace approximation), in the strength's unit.
        overall: the same for a group outside those graded.
    """

    slope: float
    half: dict[str, tuple[float, float, float]]
    overall: tuple[float, float, float]

    def at(self, strength: FloatArray, group: str | None = None) -> FloatArray:
        """The chance at strengths of any shape, of a group or of one outside those graded."""
        half = self.overall[0] if group is None else self.half[group][0]
        return expit(self.slope * np.log(np.asarray(strength) / half))

    @classmethod
    def fitted(
        cls, strength: Sequence[float], group: Sequence[str], detected: Sequence[bool]
    ) -> Power:
        """The most probable curve: logistic in ln strength, with groups scattered by a factor e^0.7
        about a common s½, and a slope of 4 within a factor e^0.5. With few cases a group's s½ leans
        on the others'.

        Raises:
            InputError: no cases, lengths that differ, or a strength that is not positive.
        """
        if not strength or not len(strength) == len(group) == len(detected) or min(strength) <= 0:
            raise InputError(
                f"{len(strength)} strengths, {len(group)} groups, {len(detected)} outcomes",
                where="power curve",
                fix="give one of each for every case, strengths above 0",
            )
        x, hit = np.log(np.asarray(strength)), np.asarray(detected, dtype=np.float64)
        names = sorted(set(group))
        index = np.array([names.index(name) for name in group])
        middle, spread = float(np.median(x)), max(float(np.ptp(x)), 1.0)

        def loss(p: FloatArray) -> float:
            slope, common, offsets = math.exp(p[0]), p[1], p[2:]
            margin = slope * (x - common - offsets[index])
            fit = np.logaddexp(0.0, np.where(hit > 0, -margin, margin)).sum()
            prior = ((p[0] - math.log(_SLOPE)) / _SLOPE_SPREAD) ** 2 + (
                offsets**2
            ).sum() / _GROUP_SPREAD**2
            return float(fit + prior / 2 + ((common - middle) / spread) ** 2 / 2)

        start = np.concatenate([[math.log(_SLOPE), middle], np.zeros(len(names))])
        best = minimize(loss, start, method="BFGS").x
        covariance = np.linalg.inv(_hessian(loss, best))

        def bounds(direction: FloatArray) -> tuple[float, float, float]:
            value, error = (
                float(direction @ best),
                math.sqrt(float(direction @ covariance @ direction)),
            )
            return math.exp(value), math.exp(value - 1.645 * error), math.exp(value + 1.645 * error)

        unit = np.eye(len(best))
        half = {name: bounds(unit[1] + unit[2 + i]) for i, name in enumerate(names)}
        return cls(slope=math.exp(best[0]), half=half, overall=bounds(unit[1]))


def _hessian(loss: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    """By central differences, whose error of h² is far below the parameters' own uncertainty."""
    steps = _STEP * np.eye(len(at))
    rows = [
        [loss(at + a + b) - loss(at + a - b) - loss(at - a + b) + loss(at - a - b) for b in steps]
        for a in steps
    ]
    return np.array(rows) / (4 * _STEP**2)
