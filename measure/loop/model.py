"""A model of one cloth: the base model's calibration, and effects of the library at some strengths."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from measure.loop.columns import Calibration, EffectColumn
from measure.loop.forecast import Forecaster, Segments
from sim.effects import Effect, apply
from sim.state import State
from sim.system import System


@dataclass(frozen=True, kw_only=True)
class Model:
    """Base model and effects.

    Attributes:
        calibration: of the base model.
        effects: columns with their coefficients beyond null.
    """

    calibration: Calibration
    effects: tuple[tuple[EffectColumn, float], ...] = ()

    @property
    def acting(self) -> tuple[Effect, ...]:
        """The effects, their strengths kept to what is admissible."""
        return tuple(column.at(_kept(column, coefficient)) for column, coefficient in self.effects)

    def system(self, forecaster: Forecaster, segments: Segments) -> tuple[System, State]:
        """The batch of segments by this model."""
        return apply(self.acting, *forecaster.system(segments, [self.calibration] * len(segments)))

    def moved(self, steps: tuple[float, ...]) -> Model:
        """After steps along the calibrated parameters, then along each effect's strength."""
        own = len(steps) - len(self.effects)
        effects = tuple(
            (column, _kept(column, value + step))
            for (column, value), step in zip(self.effects, steps[own:], strict=True)
        )
        return replace(self, calibration=self.calibration.moved(steps[:own]), effects=effects)


def _kept(column: EffectColumn, coefficient: float) -> float:
    null, (least, most) = column.described.null, column.described.admissible
    return float(np.clip(null + coefficient, least, most)) - null
