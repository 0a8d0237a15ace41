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

    def steps_from(self, other: Model) -> tuple[float, ...]:
        """Steps of `moved` that lead here from another model of the same effects."""
        strengths = (b - a for (_, a), (_, b) in zip(other.effects, self.effects, strict=True))
        return (*self.calibration.steps_from(other.calibration), *strengths)

    def halved(self) -> Model:
        """Halfway from here to the nominal base model."""
        nominal = Calibration()
        density, bending, damping = (step / 2 for step in self.calibration.steps_from(nominal))
        return Model(
            calibration=nominal.moved((density, bending, damping)),
            effects=tuple((column, coefficient / 2) for column, coefficient in self.effects),
        )


def _kept(column: EffectColumn, coefficient: float) -> float:
    null, (least, most) = column.described.null, column.described.admissible
    return float(np.clip(null + coefficient, least, most)) - null
