"""Calibration of a held cloth on some recordings, by Gauss–Newton on the errors of runs from the
first pose on.

What the tracker does (`tracker.py`) and effects of the library are fitted beside the cloth where
they are sought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from flagdata.core.arrays import FloatArray
from tests.studies.validation.robot_cloth.model import (
    NAMES,
    Cloth,
    Parameters,
    described,
    predicted,
)
from tests.studies.validation.robot_cloth.reading import Swing
from tests.studies.validation.robot_cloth.tracker import (
    CAMERA,
    LATENCY,
    OFFSETS,
    TRACKER,
    Tracker,
    errors,
    instants,
    latencies,
    left,
    upper,
)

STEPS = (0.3, 0.7, 0.7)
"""Steps of ln density, ln bending and ln damping, for their sensitivities; that of the lag is the
model's velocity."""
PRIOR = (1.0, 1.0, 1.0, np.inf)
"""Standard deviations of the steps from the nominal cloth: a factor of e each; the lag and all
effects are free."""
STIFFNESSES = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Of a frame's latency [m/s]; the one is taken by which the lower halves of the fitted recordings
err least."""
_OF_RANGE = 0.1  # step of an effect's strength, as a share of its prior's range
_LONGEST = (0.7, 1.0, 1.0, 0.1)
"""The longest step of each parameter in one iteration."""
_BOUNDS = ((0.2, 5.0), (0.05, 20.0), (0.1e-3, 0.1))  # factors on density and bending; damping [s]
_HUBER = 3.0  # robust standard deviations; the tracker loses a node now and then by centimetres
ITERATIONS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A model of cloth and tracker.

    Attributes:
        parameters: of the cloth, with the strengths of effects.
        tracker: how its nodes are measured.
        sought: names of the tracker's effects that were fitted.
    """

    parameters: Parameters
    tracker: Tracker
    sought: tuple[str, ...] = ()

    @classmethod
    def start(cls, swings: Sequence[Swing], parameters: Parameters) -> Fit:
        """Parameters as they are, and a tracker that errs in nothing."""
        return cls(parameters=parameters, tracker=Tracker.faultless(swings))

    def with_effect(self, name: str) -> Fit:
        """To be fitted with one more effect, of the tracker or of the library, whose strength is
        none yet."""
        if name in TRACKER:
            return replace(self, sought=(*self.sought, name))
        strengths = {**self.parameters.strengths, name: described(name).null}
        return replace(self, parameters=replace(self.parameters, strengths=strengths))


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """A model beside a recording.

    Attributes:
        error: (frame, node, 3) observed less predicted [m]; NaN where nothing is compared.
        change: (4 + effects, frame, node, 3) of the predictions with each of `NAMES` and of the
            effects, in the units of `Parameters.moved`.
    """

    error: FloatArray
    change: FloatArray


def linear(
    cloth: Cloth, swings: Sequence[Swing], fit: Fit
) -> tuple[list[Linear], list[CubicSpline]]:
    """Errors of a model and their sensitivities, of all recordings in one batch; and the runs of
    the model itself."""
    at = fit.parameters
    effects = [_step(name, value) for name, value in at.strengths.items()]
    sizes = {
        0: STEPS[0],
        1: STEPS[1],
        2: STEPS[2],
        **{4 + k: step for k, step in enumerate(effects)},
    }
    width = 4 + len(effects)
    steps = [
        (0.0,) * width,
        *(tuple(s if k == place else 0.0 for k in range(width)) for place, s in sizes.items()),
    ]
    members = [(swing, at.moved(step)) for step in steps for swing in swings]
    models = predicted(
        cloth, [swing for swing, _ in members], [parameters for _, parameters in members]
    )
    count = len(swings)
    made = [
        _linear(swing, models[place::count], fit, list(sizes.values()))
        for place, swing in enumerate(swings)
    ]
    return made, models[:count]


def _step(effect: str, value: float) -> float:
    """Of a strength, away from the end of its range that it is at."""
    low, high = described(effect).prior
    step = _OF_RANGE * (high - low)
    return step if described(effect).admits(value + step) else -step


def _linear(
    swing: Swing, models: Sequence[CubicSpline], fit: Fit, sizes: Sequence[float]
) -> Linear:
    lag, tracker = fit.parameters.lag, fit.tracker
    late = latencies(swing, models[0], tracker, lag)
    base = errors(swing, models[0], tracker, lag, late)
    moved = [
        (base - errors(swing, m, tracker, lag, late)) / size
        for m, size in zip(models[1:], sizes, strict=True)
    ]
    slower = -models[0](instants(swing, lag, late), 1) @ (np.eye(3) + tracker.camera).T
    moved.insert(NAMES.index("lag"), np.where(np.isnan(base), np.nan, slower))
    return Linear(error=base, change=np.stack(moved))


def weights(error: FloatArray) -> FloatArray:
    """(frame, node) Huber's, of distances; 0 where nothing is compared."""
    distance = np.linalg.norm(error, axis=2)
    usual = (
        float(np.nanmedian(distance)) / 1.538
    )  # the median distance of three normal coordinates, σ = 1
    limit = _HUBER * usual
    return np.where(np.isnan(distance), 0.0, np.minimum(1.0, limit / np.maximum(distance, 1e-12)))


def calibrated(
    cloth: Cloth, swings: Sequence[Swing], start: Fit, *, iterations: int = ITERATIONS
) -> Fit:
    """The parameters, and what is sought of the tracker, that fit these recordings best, under the
    prior about the nominal cloth.

    A frame's nodes err together and count as one vector.
    """
    found = start
    for _ in range(iterations):
        parts, runs = linear(cloth, swings, found)
        found = _stepped(_observed(found, swings, runs, parts), swings, runs, parts)
    if OFFSETS not in found.sought:
        return found
    runs = predicted(cloth, swings, [found.parameters] * len(swings))
    return _with_offsets(
        found, np.concatenate(left(swings, runs, found.tracker, found.parameters.lag))
    )


def _observed(
    fit: Fit, swings: Sequence[Swing], runs: Sequence[CubicSpline], parts: Sequence[Linear]
) -> Fit:
    """With the offsets and, where latencies are sought, their stiffness by these runs."""
    fit = _with_offsets(fit, np.concatenate([part.error for part in parts]))
    if LATENCY not in fit.sought:
        return fit
    tried = [replace(fit.tracker, stiffness=value) for value in STIFFNESSES]
    return replace(
        fit, tracker=min(tried, key=lambda own: _of_lower(swings, runs, own, fit.parameters.lag))
    )


def _with_offsets(fit: Fit, error: FloatArray) -> Fit:
    """Offsets that leave no node with a mean error."""
    if OFFSETS not in fit.sought:
        return fit
    return replace(
        fit, tracker=replace(fit.tracker, offsets=fit.tracker.offsets + np.nanmean(error, axis=0))
    )


def _of_lower(
    swings: Sequence[Swing], runs: Sequence[CubicSpline], tracker: Tracker, lag: float
) -> float:
    """Mean square error of the lower halves [m²]."""
    below = ~upper(swings[0].side)
    return float(
        np.mean([np.nanmean(error[:, below] ** 2) for error in left(swings, runs, tracker, lag)])
    )


def _stepped(
    fit: Fit, swings: Sequence[Swing], runs: Sequence[CubicSpline], parts: Sequence[Linear]
) -> Fit:
    """One step of Gauss and Newton, of the parameters and the camera's map together."""
    at, tracker = fit.parameters, fit.tracker
    late = [latencies(swing, run, tracker, at.lag) for swing, run in zip(swings, runs, strict=True)]
    error = np.concatenate(
        [errors(s, r, tracker, at.lag, own) for s, r, own in zip(swings, runs, late, strict=True)]
    )
    change = np.concatenate([part.change for part in parts], axis=1)
    free = change.shape[0]
    if CAMERA in fit.sought:
        places = [
            run(instants(s, at.lag, own)) - tracker.about
            for s, run, own in zip(swings, runs, late, strict=True)
        ]
        change = np.concatenate([change, _mapped(np.concatenate(places))])
    if OFFSETS in fit.sought:
        change = change - np.nanmean(
            np.where(np.isnan(error), np.nan, change), axis=1, keepdims=True
        )
    weight = weights(error)[..., None]
    error, change = (np.nan_to_num(values) for values in (error, change))  # of weight 0
    scale = (weight * error**2).sum() / max(weight.sum(), 1.0) * error.shape[1]
    normal = np.einsum("afnc,bfnc->ab", weight * change, change) / scale
    right = np.einsum("afnc,fnc->a", weight * change, error) / scale
    away = np.log([at.density, at.bending, at.damping / Parameters().damping])
    precision = 1 / np.square(PRIOR)
    normal[:4, :4] += np.diag(precision)
    right[:3] -= precision[:3] * away
    # Where offsets are fitted they take the shift in, which then stays as it is.
    step = np.linalg.pinv(normal, rcond=1e-10, hermitian=True) @ right
    longest = np.array(
        [*_LONGEST, *(4 * abs(_step(name, value)) for name, value in at.strengths.items())]
    )
    parameters = _within(at.moved(np.clip(step[:free], -longest, longest).tolist()))
    if CAMERA in fit.sought:
        mapped = step[free:].reshape(3, 4)
        tracker = replace(
            tracker, camera=tracker.camera + mapped[:, :3], shift=tracker.shift + mapped[:, 3]
        )
    return replace(fit, parameters=parameters, tracker=tracker)


def _mapped(places: FloatArray) -> FloatArray:
    """(12, frame, node, 3) what each element of the camera's map does, by rows of A and of the
    shift."""
    made = np.zeros((3, 4, *places.shape))
    for row in range(3):
        made[row, :3, ..., row] = np.moveaxis(places, -1, 0)
        made[row, 3, ..., row] = 1.0
    return made.reshape(12, *places.shape)


def at_bounds(found: Parameters) -> tuple[str, ...]:
    """Names of the parameters that the calibration wanted beyond what it may."""
    values = (found.density, found.bending, found.damping)
    return tuple(
        name
        for name, value, bounds in zip(NAMES, values, _BOUNDS, strict=False)
        if np.isclose(value, bounds).any()
    )


def _within(found: Parameters) -> Parameters:
    density, bending, damping = (
        float(np.clip(value, *bounds))
        for value, bounds in zip(
            (found.density, found.bending, found.damping), _BOUNDS, strict=True
        )
    )
    return replace(found, density=density, bending=bending, damping=damping)
