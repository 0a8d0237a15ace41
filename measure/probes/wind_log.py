"""What a logged wind may be off by: its gain, its direction and its clock, each with a prior.

The wind at the flag is U(t) = (1 + g) Rz(α) L(t + τ), L the logged one: the log lags by τ. To first
order in (g, α, τ) the errors of the predictions move by their sensitivities, found by simulation as
those of every other regressor. Each recording has nuisances of its own, since loggers are set up
and clocks are aligned anew for each. Like what numerics do, they are always fitted, under their
priors, and nothing that they explain counts as an effect.

A lag τ that is not small beside the time in which the wind changes is not of first order. It is
found beforehand from the course of the wind estimated from the errors, which for a log that lags is
L(t + τ)/L(t) − 1, and the log is moved by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.calibrated_parameters import Calibration
from measure.forecasting.observer import Forecaster
from measure.forecasting.segments import Segments
from measure.probes.wind_course import ALONG, Course
from measure.trajectories.trajectory import WindTrack

NUISANCES, DIRECTION = 3, 1
"""How many there are for each recording, and the place of the direction among them."""

_STEPS = (0.03, 0.05, 0.1)
"""Steps of the gain, the direction [rad] and the clock [s]: about as large as what is expected of
them."""

_REACH = 3.0
"""Prior standard deviations to either side within which a lag is sought."""
_LAGS = 121
_CALM = 0.3
"""Wind below which no share of a log is taken [m/s]."""


def misread(
    wind: WindTrack, *, gain: float = 0.0, direction: float = 0.0, clock: float = 0.0
) -> WindTrack:
    """Computes the wind at the flag where the log is off.

    Args:
        gain: share by which the wind is stronger than logged.
        direction: angle by which it blows further to the left, counter-clockwise seen from above
            [rad].
        clock: time by which the log lags behind the recording [s].
    """
    cosine, sine = np.cos(direction), np.sin(direction)
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return replace(wind.later(clock), velocity=(1 + gain) * wind.velocity @ turn)


def sensitivities(
    forecaster: Forecaster, segments: Segments, calibrations: Sequence[Calibration], base: Tensor
) -> list[Tensor]:
    """Computes the change of the predictions (frame, marker, 3, segment) [m] by a prior standard
    deviation of each nuisance.

    Args:
        base: errors of the base model [m].
    """
    batches = []
    for nuisance, step in enumerate(_STEPS):
        off = [step if k == nuisance else 0.0 for k in range(NUISANCES)]
        items = tuple(
            replace(item, wind=misread(item.wind, gain=off[0], direction=off[1], clock=off[2]))
            for item in segments.items
        )
        batches.append(forecaster.system(replace(segments, items=items), calibrations))
    errors = forecaster.errors_jointly(batches, segments)
    widths = np.array([item.wind.uncertainty for item in segments.items])  # (segment, nuisance)
    return [
        (base - stepped) / step * base.new_tensor(widths[:, nuisance])
        for nuisance, (stepped, step) in enumerate(zip(errors, _STEPS, strict=True))
    ]


def lags(course: Course, segments: Segments) -> tuple[float, ...]:
    """Estimates by how much each log lags, most probably, by the course of the wind along itself,
    (recording,) [s].

    Least squares of the windows about their mean, as large as they are, under the prior of the
    clock; 0 where the wind is steady or the clock is known.
    """
    count = course.score.shape[1]
    window = segments.cut.length // count
    weight = np.einsum("swpp->swp", course.curvature)[..., ALONG]
    value = course.score[..., ALONG] / np.maximum(weight, np.finfo(np.float64).tiny)
    times_in_segment = (segments.first + np.arange(count * window)) * segments.period
    lags_found: list[float] = []
    for index in np.unique(segments.recording):
        places = np.flatnonzero(segments.recording == index)
        wind = segments.items[places[0]].wind
        if wind.steady or not wind.clock:
            lags_found.append(0.0)
            continue
        times = np.stack([segments.items[index].start + times_in_segment for index in places])
        tried = np.linspace(-_REACH, _REACH, _LAGS) * wind.clock
        misfits = np.array(
            [
                _misfit(value[places], weight[places], _late(wind, times, lag, count))
                for lag in tried
            ]
        )
        size = max(float(misfits.min()) / value[places].size, np.finfo(np.float64).tiny)
        lags_found.append(float(tried[np.argmin(misfits / size + (tried / wind.clock) ** 2)]))
    return tuple(lags_found)


def _late(wind: WindTrack, times: FloatArray, lag: float, count: int) -> FloatArray:
    """Computes the share by which the wind is stronger than a log that lags, at times (segment,
    frame) [s], (segment, window)."""
    logged, true = (
        wind.at((times + shift).ravel())[:, 0].reshape(times.shape) for shift in (0.0, lag)
    )
    share = true / np.where(np.abs(logged) > _CALM, logged, np.inf) - 1
    return share.reshape(len(times), count, -1).mean(axis=2)


def _misfit(value: FloatArray, weight: FloatArray, expected: FloatArray) -> float:
    off = value - expected
    return float((weight * (off - (weight * off).sum() / weight.sum()) ** 2).sum())


def by_recording(moved: FloatArray, recording: IntArray) -> FloatArray:
    """Spreads (segment, row, nuisance) to (segment, row, nuisance · recording): each moves its own
    recording alone."""
    numbers = np.unique(recording)
    of_recording = (recording[:, None] == numbers).astype(np.float64)
    return np.einsum("srk,sn->srnk", moved, of_recording).reshape(*moved.shape[:2], -1)
