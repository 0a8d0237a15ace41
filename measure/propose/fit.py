"""Gauss–Newton fits of models to projected errors: linearised again at each estimate until it converges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from measure.forecasting.calibration import THETA, Calibration
from measure.forecasting.model import Model
from measure.forecasting.regressors import EffectColumn
from measure.inference.random_effect import NullModel
from measure.loop.gauss_newton import ROUNDS, STAYS, cut
from measure.propose.projected import ProjectedSegments, evidence

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """A model with standard errors of its calibrated parameters and strengths, as the null model has them."""

    model: Model
    errors: tuple[float, ...]


def fit(
    projected: ProjectedSegments,
    null: NullModel,
    speeds: Floats,
    columns: Sequence[EffectColumn],
    start: Sequence[float],
) -> Fitted:
    """Calibrated parameters and strengths, by Gauss and Newton.

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
    return Fitted(model=model.moved(tuple(step)), errors=tuple(float(e) for e in errors))


def _step(projected: ProjectedSegments, null: NullModel, speeds: Floats, model: Model) -> tuple[Floats, Floats]:
    """One step of generalised least squares from a model, under the prior about the nominal calibration, and its
    standard errors."""
    own = evidence(projected.at(model), speeds, null)
    found = own.fit(range(len(THETA), own.columns), centre=Calibration().steps_from(model.calibration))
    value, error = np.array([found.of(column) for column in range(own.columns)]).T
    return np.array(cut(value)), error
