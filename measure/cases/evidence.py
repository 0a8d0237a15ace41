"""Before and after on data no fit has seen: each model's predictions of frequencies and of stop speeds.

Errors are natural logarithms of predicted over measured, so that twice too fast and half as fast weigh alike, and 0.1 is
10 %. A model that has no flutter at a speed has no frequency there: its error is that of the mode that decays slowest, and
it is said to have none. One that never flutters at a length has no stop speed; that counts as a factor of ten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from measure.cases.candidates import STRENGTHS, Candidate, Shear, loaded
from measure.cases.sheet import Sheet, leading, onset

NEVER = math.log(10.0)
"""The error of a stop speed where the model has none."""
_SPEEDS = np.arange(0.4, 14.01, 0.1)
_HIGHEST = 40.0  # m/s, of onsets
FACTORS = np.geomspace(0.25, 1.6, 94)
"""s that are tried, 2 % apart."""


class Target(StrEnum):
    """What is fitted."""

    FREQUENCY = "frequency"
    STOP = "stop"
    BOTH = "both"


@dataclass(frozen=True, kw_only=True)
class Observed:
    """Measurements of one group.

    Attributes:
        speeds, frequencies: (clip,) of the tunnel [m/s], and of the flutter [Hz].
        lengths, stops: (length,) [m], and the median tunnel speed at which flutter stops [m/s].
    """

    speeds: NDArray[np.float64]
    frequencies: NDArray[np.float64]
    lengths: NDArray[np.float64]
    stops: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Model:
    """A candidate of given strength, in s times the logged speed."""

    candidate: Candidate
    strength: float
    factor: float


class LinearTable:
    """Frequencies and onsets of a candidate over its strengths, by linear stability; computed once.

    Args:
        length: of the filmed sheet [m].
        lengths: at which onsets will be asked for [m].
    """

    def __init__(self, candidate: Candidate, *, bare: Sheet, density: float, lengths: Sequence[float]) -> None:
        self.candidate = candidate
        self._bare = bare
        self._density = density
        self._lengths = sorted(set(lengths))
        grid = STRENGTHS[candidate].grid()
        self.strengths = grid[:1] if candidate is Candidate.NONE else grid

    def _sheet(self, strength: float, length: float) -> Sheet:
        return loaded(self.candidate, strength, bare=self._bare, length=length, density=self._density)

    @cached_property
    def _modes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(strength, speed) log frequency and growth of the filmed sheet."""
        found = [
            [leading(self._sheet(float(k), self._bare.length), float(u)) for u in _SPEEDS] for k in self.strengths
        ]
        least = 1e-3  # Hz: a mode that does not oscillate (divergence) has no frequency
        frequency = np.array([[max(mode.frequency, least) for mode in row] for row in found])
        return np.log(frequency), np.array([[mode.growth for mode in row] for row in found])

    @cached_property
    def _onsets(self) -> NDArray[np.float64]:
        """(strength, length) [m/s], NaN without."""
        return np.array(
            [[onset(self._sheet(float(k), length), highest=_HIGHEST) for length in self._lengths] for k in self.strengths]
        )

    def frequency(self, strength: float, speed: float) -> tuple[float, bool]:
        """[Hz] of the leading mode at a speed at the sheet, and whether it grows."""
        row = int(np.abs(np.log(self.strengths / strength)).argmin())
        logarithm, growth = self._modes
        return (
            float(np.exp(np.interp(speed, _SPEEDS, logarithm[row]))),
            bool(np.interp(speed, _SPEEDS, growth[row]) > 1e-3),
        )

    def stop(self, strength: float, length: float) -> float:
        """[m/s] at the sheet, NaN without."""
        row = int(np.abs(np.log(self.strengths / strength)).argmin())
        return float(self._onsets[row, int(np.abs(np.array(self._lengths) - length).argmin())])

    def errors(self, model: Model, observed: Observed) -> Errors:
        """Of the model's predictions."""
        frequency = [self.frequency(model.strength, model.factor * u) for u in observed.speeds]
        stops = np.array([self.stop(model.strength, length) for length in observed.lengths]) / model.factor
        return Errors(
            frequency=np.log([f for f, _ in frequency]) - np.log(observed.frequencies),
            flutters=np.array([grows for _, grows in frequency], dtype=bool),
            stop=np.where(np.isfinite(stops), np.log(stops / observed.stops), NEVER),
            stops=np.isfinite(stops),
        )


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Logarithms of predicted over measured.

    Attributes:
        frequency, flutters: (clip,), and whether the model flutters there.
        stop, stops: (length,), and whether it has a stop speed.
    """

    frequency: NDArray[np.float64]
    flutters: NDArray[np.bool_]
    stop: NDArray[np.float64]
    stops: NDArray[np.bool_]

    def loss(self, target: Target) -> float:
        """Mean square."""
        parts = {
            Target.FREQUENCY: [(self.frequency**2).mean()],
            Target.STOP: [(self.stop**2).mean()],
            Target.BOTH: [(self.frequency**2).mean(), (self.stop**2).mean()],
        }
        return float(sum(parts[target]))


def fit(table: LinearTable, shear: Shear, observed: Observed, target: Target) -> Model:
    """The strength and, where it is free, the factor with the least loss on the grid of both."""
    factors = FACTORS if shear is Shear.FREE else np.ones(1)
    tried = [
        Model(candidate=table.candidate, strength=float(k), factor=float(s)) for k in table.strengths for s in factors
    ]
    return min(tried, key=lambda model: table.errors(model, observed).loss(target))


@dataclass(frozen=True, kw_only=True)
class Paired:
    """Mean of |error before| − |error after| over the same conditions, and Student's interval at 90 %."""

    mean: float
    low: float
    high: float
    count: int


def paired(before: NDArray[np.float64], after: NDArray[np.float64]) -> Paired:
    """How much smaller the errors became, condition by condition."""
    gain = np.abs(before) - np.abs(after)
    half = float(stats.t.ppf(0.95, len(gain) - 1) * gain.std(ddof=1) / math.sqrt(len(gain))) if len(gain) > 1 else math.inf
    return Paired(mean=float(gain.mean()), low=float(gain.mean() - half), high=float(gain.mean() + half), count=len(gain))
