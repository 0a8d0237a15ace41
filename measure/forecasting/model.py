"""A model of one cloth: the base model's calibration, and effects of the library at some
strengths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.forecasting.observer import WIDEST, Forecaster
from measure.forecasting.regressors import EffectColumn
from measure.forecasting.segments import Segments
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import Effect, apply


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
        return tuple(
            column.at(_admissible(column, coefficient)) for column, coefficient in self.effects
        )

    def system(self, forecaster: Forecaster, segments: Segments) -> tuple[System, State]:
        """Makes the batch of segments by this model."""
        return apply(self.acting, *forecaster.system(segments, [self.calibration] * len(segments)))

    def moved(self, steps: tuple[float, ...]) -> Model:
        """Moves the model by steps along the calibrated parameters, then along each effect's
        strength."""
        calibrated = len(steps) - len(self.effects)
        effects = tuple(
            (column, _admissible(column, value + step))
            for (column, value), step in zip(self.effects, steps[calibrated:], strict=True)
        )
        return replace(
            self, calibration=self.calibration.moved(steps[:calibrated]), effects=effects
        )

    def steps_from(self, origin: Model) -> tuple[float, ...]:
        """Computes the steps of `moved` that lead here from another model of the same effects."""
        strengths = (b - a for (_, a), (_, b) in zip(origin.effects, self.effects, strict=True))
        return (*self.calibration.steps_from(origin.calibration), *strengths)

    def take_step(self, parameter: int, size: float) -> tuple[Model, float]:
        """Takes a step along one parameter, and returns the step: back, where bounds cut the one
        ahead shorter."""
        count = len(THETA) + len(self.effects)
        ways = [
            self.moved(tuple(way if k == parameter else 0.0 for k in range(count)))
            for way in (size, -size)
        ]
        taken = [moved.steps_from(self)[parameter] for moved in ways]
        longer = int(abs(taken[1]) > abs(taken[0]) + 1e-9 * size)
        return ways[longer], taken[longer]

    def halfway_to_nominal(self) -> Model:
        """Returns the model halfway from here to the nominal base model."""
        nominal = Calibration()
        area_weight, bending, damping = (step / 2 for step in self.calibration.steps_from(nominal))
        return Model(
            calibration=nominal.moved((area_weight, bending, damping)),
            effects=tuple((column, coefficient / 2) for column, coefficient in self.effects),
        )


_SHARE = 0.1
"""Of a strength, by which it is stepped at least: a hoist of 10⁴ N/m² does not feel 20 more."""


def errors_of(models: Sequence[Model], forecaster: Forecaster, segments: Segments) -> list[Tensor]:
    """Computes the prediction errors (frame, marker, 3, segment) [m] of each model of the same
    effects on segments.

    They are members of one batch: small batches cost nearly as much as larger ones.
    """
    count, errors = len(segments), []
    parts = min(len(models), math.ceil(len(models) * count / WIDEST))
    for chosen in np.array_split(np.arange(len(models)), parts):
        members = [models[index] for index in chosen]
        copies = segments.select(list(range(count)) * len(members))
        batch = forecaster.system(
            copies, [model.calibration for model in members for _ in range(count)]
        )
        strengths = torch.tensor(
            [[value for _, value in model.effects] for model in members], dtype=torch.float64
        )
        acting = [
            column.at(strengths[:, index].repeat_interleave(count))
            for index, (column, _) in enumerate(members[0].effects)
        ]
        errors += forecaster.errors(*apply(acting, *batch), segments).split(count, dim=-1)
    return errors


def linearise_model(
    model: Model, forecaster: Forecaster, segments: Segments
) -> tuple[Tensor, list[Tensor]]:
    """Computes the errors of a model (frame, marker, 3, segment) [m] and, per unit, what each of
    its parameters takes away."""
    strengths = (max(column.step, _SHARE * abs(value)) for column, value in model.effects)
    sizes = [*(step for _, _, step in THETA), *strengths]
    steps = [model.take_step(index, size) for index, size in enumerate(sizes)]
    base, *errors = errors_of([model, *(moved for moved, _ in steps)], forecaster, segments)
    return base, [
        (base - changed) / taken for changed, (_, taken) in zip(errors, steps, strict=True)
    ]


def _admissible(column: EffectColumn, coefficient: float) -> float:
    null = column.described.null
    return column.described.nearest(null + coefficient) - null
