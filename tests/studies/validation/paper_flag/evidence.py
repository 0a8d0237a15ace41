"""Before and after on data no fit has seen: what models predict for each condition, and how wrong
they are.

Errors are natural logarithms of predicted over measured, so that twice too fast and half as fast
weigh alike, and 0.1 is 10 %. A model without flutter where flutter was measured has no prediction:
that counts as a factor of ten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy import stats

from flagdata.core.arrays import FloatArray
from flagdata.errors import UsageError
from tests.studies.validation.paper_flag.candidates import Load, Shear, loaded
from tests.studies.validation.paper_flag.sheet import Sheet, leading, onset

NEVER = math.log(10.0)
"""The error where a model has no prediction."""
_SPEEDS = np.arange(0.4, 20.01, 0.2)
_HIGHEST = 40.0  # m/s, of onsets
FACTORS = np.geomspace(0.25, 1.6, 94)
"""s that are tried, 2 % apart."""


class Kind(StrEnum):
    """What was measured."""

    FREQUENCY = "frequency"
    """Frequency of the flutter at a tunnel speed [Hz]."""
    WAVE = "wave speed"
    """Speed of the travelling wave at a tunnel speed [m/s]."""
    AMPLITUDE = "amplitude"
    """Largest first harmonic of the deflection, over the length, at a tunnel speed."""
    STOP = "stop speed"
    """Tunnel speed at which a sheet of a length stops fluttering [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Condition:
    """One measurement.

    Attributes:
        at: tunnel speed [m/s], or length of the sheet [m] for a stop speed.
        low, high: its interval at 90 %, NaN where it has none.
    """

    kind: Kind
    at: float
    value: float
    low: float = math.nan
    high: float = math.nan


class Predictor(Protocol):
    """A candidate over its loads."""

    @property
    def loads(self) -> Sequence[Load]: ...

    def predict(self, load: int, factors: FloatArray, condition: Condition) -> FloatArray:
        """(factor,) what the load at this index gives at `factors` times the tunnel's speed; NaN
        without flutter."""
        ...


class LinearTable:
    """Frequencies and onsets over loads, by linear stability; computed once.

    Args:
        bare: the filmed sheet without air.
        lengths: at which stop speeds will be asked for [m].
    """

    def __init__(
        self, loads: Sequence[Load], *, bare: Sheet, density: float, lengths: Sequence[float]
    ) -> None:
        self.loads = tuple(loads)
        self._bare = bare
        self._density = density
        self._lengths = np.array(sorted(set(lengths)))

    def _sheets(self, length: float) -> list[Sheet]:
        return [
            loaded(load, bare=self._bare, length=length, density=self._density)
            for load in self.loads
        ]

    @cached_property
    def _frequencies(self) -> FloatArray:
        """(load, speed) [Hz], NaN where no oscillation grows."""
        found = np.full((len(self.loads), len(_SPEEDS)), np.nan)
        for row, sheet in enumerate(self._sheets(self._bare.length)):
            for column, speed in enumerate(_SPEEDS):
                mode = leading(sheet, float(speed))
                if mode.growth > 1e-3 and mode.frequency > 0:
                    found[row, column] = mode.frequency
        return found

    @cached_property
    def _onsets(self) -> FloatArray:
        """(load, length) [m/s], NaN without."""
        columns = [
            [onset(sheet, highest=_HIGHEST) for sheet in self._sheets(float(h))]
            for h in self._lengths
        ]
        return np.array(columns).T

    def predict(self, load: int, factors: FloatArray, condition: Condition) -> FloatArray:
        """As `Predictor.predict`.

        Raises:
            UsageError: a kind that linear stability does not give, or a length that was not named.
        """
        if condition.kind is Kind.FREQUENCY:
            return np.interp(factors * condition.at, _SPEEDS, self._frequencies[load], right=np.nan)
        if condition.kind is Kind.STOP:
            column = int(np.abs(self._lengths - condition.at).argmin())
            if abs(self._lengths[column] - condition.at) < 1e-6:
                return self._onsets[load, column] / factors
            raise UsageError(
                f"no onset at {condition.at:g} m", where="linear table", fix="name the length"
            )
        raise UsageError(
            f"no {condition.kind} in linear stability", where="linear table", fix="simulate in time"
        )


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """A load and a factor that were fitted, and the mean square errors of the kinds fitted to,
    summed."""

    load: int
    factor: float
    loss: float


def errors(
    predictor: Predictor, load: int, factor: float, conditions: Sequence[Condition]
) -> FloatArray:
    """(condition,) logarithms of predicted over measured; NEVER where there is no prediction."""
    return _errors(predictor, load, np.array([factor]), conditions)[:, 0]


def _errors(
    predictor: Predictor, load: int, factors: FloatArray, conditions: Sequence[Condition]
) -> FloatArray:
    """(condition, factor)."""
    predicted = np.array([predictor.predict(load, factors, condition) for condition in conditions])
    predicted = predicted.reshape(len(conditions), len(factors))
    measured = np.array([condition.value for condition in conditions])[:, None]
    flutters = np.isfinite(predicted) & (predicted > 0)
    return np.where(flutters, np.log(np.where(flutters, predicted, 1.0) / measured), NEVER)


def fit(predictor: Predictor, shear: Shear, conditions: Sequence[Condition]) -> Fitted:
    """The load and, where it is free, the factor with the least loss; each kind of condition weighs
    alike."""
    factors = FACTORS if shear is Shear.FREE else np.ones(1)
    kinds = [[c for c in conditions if c.kind is kind] for kind in Kind]
    loss = np.array(
        [
            sum(
                (_errors(predictor, load, factors, part) ** 2).mean(axis=0)
                for part in kinds
                if part
            )
            for load in range(len(predictor.loads))
        ]
    )
    load, factor = np.unravel_index(int(loss.argmin()), loss.shape)
    return Fitted(load=int(load), factor=float(factors[factor]), loss=float(loss.min()))


def factor_that_meets(
    predictor: Predictor, load: int, conditions: Sequence[Condition], *, within: float
) -> float:
    """The factor at which the mean log error vanishes; NaN where none brings it within this of
    0."""
    mean = np.abs(_errors(predictor, load, FACTORS, conditions).mean(axis=0))
    best = int(mean.argmin())
    return float(FACTORS[best]) if mean[best] < within else math.nan


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A mean over conditions and Student's interval at 90 % about it; infinite for a single
    condition."""

    mean: float
    low: float
    high: float
    count: int

    @classmethod
    def of(cls, values: FloatArray) -> Interval:
        half = math.inf
        if len(values) > 1:
            half = float(
                stats.t.ppf(0.95, len(values) - 1) * values.std(ddof=1) / math.sqrt(len(values))
            )
        mean = float(values.mean())
        return cls(mean=mean, low=mean - half, high=mean + half, count=len(values))

    def as_dict(self) -> dict[str, float | int | None]:
        return {k: v if math.isfinite(v) else None for k, v in vars(self).items()}


def paired(before: FloatArray, after: FloatArray) -> Interval:
    """How much smaller the errors became, condition by condition: |before| − |after|."""
    return Interval.of(np.abs(before) - np.abs(after))
