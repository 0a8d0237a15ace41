"""Calibration of a held cloth on some recordings, by Gauss–Newton on the errors of runs from the first pose on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from measure.cases.held.model import NAMES, Cloth, Parameters, errors, predicted
from measure.cases.held.reading import Floats, Swing

STEPS = (0.3, 0.7, 0.7)
"""Steps of ln density, ln bending and ln damping, for their sensitivities; that of the lag is the model's velocity."""
PRIOR = (1.0, 1.0, 1.0, np.inf)
"""Standard deviations of the steps from the nominal cloth: a factor of e each; the lag is free."""
_LONGEST = (0.7, 1.0, 1.0, 0.1)
"""The longest step of each parameter in one iteration."""
_BOUNDS = ((0.2, 5.0), (0.05, 20.0), (0.1e-3, 0.1))  # factors on density and bending; damping [s]
_HUBER = 3.0  # robust standard deviations; the tracker loses a node now and then by centimetres
ITERATIONS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """A model beside a recording.

    Attributes:
        error: (frame, node, 3) observed less predicted [m]; NaN where nothing is compared.
        change: (4, frame, node, 3) of the predictions with each of `NAMES`, in the units of `Parameters.moved`.
    """

    error: Floats
    change: Floats


def linear(cloth: Cloth, swings: Sequence[Swing], at: Parameters) -> list[Linear]:
    """Errors of a model and their sensitivities, of all recordings in one batch."""
    steps = [(0.0,) * 4, *(tuple(s if k == place else 0.0 for k in range(4)) for place, s in enumerate(STEPS))]
    members = [(swing, at.moved(step)) for step in steps for swing in swings]
    models = predicted(cloth, [swing for swing, _ in members], [parameters for _, parameters in members])
    count = len(swings)
    return [_linear(swing, models[place::count], at.lag) for place, swing in enumerate(swings)]


def _linear(swing: Swing, models: Sequence[CubicSpline], lag: float) -> Linear:
    base = errors(swing, models[0], lag)
    own = np.clip(swing.times - lag, 0.0, swing.tool_times[-1])
    moved = [(base - errors(swing, model, lag)) / step for model, step in zip(models[1:], STEPS, strict=True)]
    slower = -models[0](own, 1)
    return Linear(error=base, change=np.stack([*moved, np.where(np.isnan(base), np.nan, slower)]))


def weights(error: Floats) -> Floats:
    """(frame, node) Huber's, of distances; 0 where nothing is compared."""
    distance = np.linalg.norm(error, axis=2)
    usual = float(np.nanmedian(distance)) / 1.538  # the median distance of three normal coordinates, σ = 1
    limit = _HUBER * usual
    return np.where(np.isnan(distance), 0.0, np.minimum(1.0, limit / np.maximum(distance, 1e-12)))


def calibrated(cloth: Cloth, swings: Sequence[Swing], start: Parameters) -> Parameters:
    """The parameters that fit these recordings best, under the prior about the nominal cloth.

    A frame's nodes err together and count as one vector.
    """
    found = start
    for _ in range(ITERATIONS):
        parts = linear(cloth, swings, found)
        normal, right = np.zeros((4, 4)), np.zeros(4)
        for part in parts:
            weight = weights(part.error)[..., None]
            error, change = (np.nan_to_num(values) for values in (part.error, part.change))  # of weight 0
            scale = (weight * error**2).sum() / max(weight.sum(), 1.0) * error.shape[1]
            normal += np.einsum("afnc,bfnc->ab", weight * change, change) / scale
            right += np.einsum("afnc,fnc->a", weight * change, error) / scale
        away = np.log([found.density, found.bending, found.damping / Parameters().damping])
        precision = 1 / np.square(PRIOR)
        normal += np.diag(precision)
        right[:3] -= precision[:3] * away
        step = np.clip(np.linalg.solve(normal, right), -np.array(_LONGEST), _LONGEST)
        found = _within(found.moved(step.tolist()))
    return found


def at_bounds(found: Parameters) -> tuple[str, ...]:
    """Names of the parameters that the calibration wanted beyond what it may."""
    values = (found.density, found.bending, found.damping)
    return tuple(
        name for name, value, bounds in zip(NAMES, values, _BOUNDS, strict=False) if np.isclose(value, bounds).any()
    )


def _within(found: Parameters) -> Parameters:
    density, bending, damping = (
        float(np.clip(value, *bounds))
        for value, bounds in zip((found.density, found.bending, found.damping), _BOUNDS, strict=True)
    )
    return Parameters(density=density, bending=bending, damping=damping, lag=found.lag)
