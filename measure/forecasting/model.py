"""A model of one cloth: the base model's calibration, and effects of the library at some strengths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from measure.forecasting.calibration import THETA, Calibration
from measure.forecasting.observer import WIDEST, Forecaster
from measure.forecasting.regressors import EffectColumn
from measure.forecasting.segments import Segments
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
        """The effects, their strengths clipped to what is admissible."""
        return tuple(column.at(_admissible(column, coefficient)) for column, coefficient in self.effects)

    def system(self, forecaster: Forecaster, segments: Segments) -> tuple[System, State]:
        """The batch of segments by this model."""
        return apply(self.acting, *forecaster.system(segments, [self.calibration] * len(segments)))

    def moved(self, steps: tuple[float, ...]) -> Model:
        """After steps along the calibrated parameters, then along each effect's strength."""
        own = len(steps) - len(self.effects)
        effects = tuple(
            (column, _admissible(column, value + step))
            for (column, value), step in zip(self.effects, steps[own:], strict=True)
        )
        return replace(self, calibration=self.calibration.moved(steps[:own]), effects=effects)

    def steps_from(self, other: Model) -> tuple[float, ...]:
        """Steps of `moved` that lead here from another model of the same effects."""
        strengths = (b - a for (_, a), (_, b) in zip(other.effects, self.effects, strict=True))
        return (*self.calibration.steps_from(other.calibration), *strengths)

    def stepped(self, place: int, size: float) -> tuple[Model, float]:
        """After a step along one parameter, with the step: back, where bounds cut the one ahead shorter."""
        count = len(THETA) + len(self.effects)
        ways = [self.moved(tuple(way if k == place else 0.0 for k in range(count))) for way in (size, -size)]
        taken = [moved.steps_from(self)[place] for moved in ways]
        longer = int(abs(taken[1]) > abs(taken[0]) + 1e-9 * size)
        return ways[longer], taken[longer]

    def halved(self) -> Model:
        """Halfway from here to the nominal base model."""
        nominal = Calibration()
        density, bending, damping = (step / 2 for step in self.calibration.steps_from(nominal))
        return Model(
            calibration=nominal.moved((density, bending, damping)),
            effects=tuple((column, coefficient / 2) for column, coefficient in self.effects),
        )


_SHARE = 0.1
"""Of a strength, by which it is stepped at least: a hoist of 10⁴ N/m² does not feel 20 more."""


def errors_of(models: Sequence[Model], forecaster: Forecaster, segments: Segments) -> list[Tensor]:
    """What each model of the same effects leaves of segments: (frame, marker, 3, segment) errors [m].

    They are members of one batch: small batches cost nearly as much as larger ones.
    """
    count, found = len(segments), []
    for chosen in np.array_split(np.arange(len(models)), math.ceil(len(models) * count / WIDEST)):
        own = [models[place] for place in chosen]
        copies = segments.select(list(range(count)) * len(own))
        batch = forecaster.system(copies, [model.calibration for model in own for _ in range(count)])
        strengths = torch.tensor([[value for _, value in model.effects] for model in own], dtype=torch.float64)
        acting = [
            column.at(strengths[:, place].repeat_interleave(count)) for place, (column, _) in enumerate(own[0].effects)
        ]
        found += forecaster.errors(*apply(acting, *batch), segments).split(count, dim=-1)
    return found


def linearised(model: Model, forecaster: Forecaster, segments: Segments) -> tuple[Tensor, list[Tensor]]:
    """The errors of a model (frame, marker, 3, segment) [m] and, per unit, what each of its parameters takes away."""
    strengths = (max(column.step, _SHARE * abs(value)) for column, value in model.effects)
    sizes = [*(step for _, _, step in THETA), *strengths]
    steps = [model.stepped(place, size) for place, size in enumerate(sizes)]
    base, *errors = errors_of([model, *(moved for moved, _ in steps)], forecaster, segments)
    return base, [(base - own) / taken for own, (_, taken) in zip(errors, steps, strict=True)]


def _admissible(column: EffectColumn, coefficient: float) -> float:
    null = column.described.null
    return column.described.nearest(null + coefficient) - null
