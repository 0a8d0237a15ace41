"""Gauss–Newton fits of models to projected errors: linearised again at each estimate until it
converges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.forecasting.model import Model
from measure.forecasting.regressors import EffectColumn
from measure.inference.random_effect import NullModel
from measure.loop.gauss_newton import ROUNDS, STAYS, cut
from measure.propose.projected import ProjectedSegments, evidence


@dataclass(frozen=True, kw_only=True)
class FittedModel:
    """A model with standard errors of its calibrated parameters and strengths, as the null model
    has them."""

    model: Model
    errors: tuple[float, ...]


def fit(
    projected: ProjectedSegments,
    null: NullModel,
    speeds: FloatArray,
    columns: Sequence[EffectColumn],
    start: Sequence[float],
) -> FittedModel:
    """Fits calibrated parameters and strengths, by Gauss and Newton.

    Args:
        speeds: (segment,) of the wind [m/s].
        start: steps from the nominal model to begin with: the linear fit there.
    """
    model = Model(calibration=Calibration(), effects=tuple((column, 0.0) for column in columns))
    step, errors = np.array(cut(np.array(start, dtype=np.float64))), np.zeros(len(start))
    for _ in range(ROUNDS):
        model = model.moved(tuple(step))
        step, errors = _step(projected, null, speeds, model)
        if np.abs(step / errors).max() < STAYS:
            break
    return FittedModel(model=model.moved(tuple(step)), errors=tuple(float(e) for e in errors))


def _step(
    projected: ProjectedSegments, null: NullModel, speeds: FloatArray, model: Model
) -> tuple[FloatArray, FloatArray]:
    """Takes one step of generalised least squares from a model, under the prior about the nominal
    calibration, and returns its standard errors."""
    projected_evidence = evidence(projected.at(model), speeds, null)
    fitted = projected_evidence.fit(
        range(len(THETA), projected_evidence.columns),
        centre=Calibration().steps_from(model.calibration),
    )
    value, error = np.array([fitted.of(column) for column in range(projected_evidence.columns)]).T
    return np.array(cut(value)), error
