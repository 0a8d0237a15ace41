"""Models run on recordings and times that they were not fitted to, beside the numerical floor.

The floor is what numerics leave: the error at which a model predicts recordings of itself that
others simulated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from scipy.stats import t as student

from flagdata.answer import Quantity
from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.rng import child_seed
from measure.forecasting.model import Model, errors_of
from measure.forecasting.observer import Forecaster
from measure.forecasting.segments import Segments
from measure.forecasting.setting import Setting
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.gauss_newton import Refined, finish_step
from measure.nulls import tracks, winds
from measure.nulls.null_simulation import NullBatch
from measure.trajectories.attachment_anchors import as_seen
from measure.verdict.criteria import CRITERIA
from measure.verdict.verdict_record import Comparison

_DURATION = 4.5  # s: two segments of each recording
_ENOUGH = 3
"""Segments of a recording beyond which two may be left out."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fold:
    """Segments that are left out of a fit, and what is left out in words."""

    words: str
    outside: BoolArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """Refitted models run on what they were not fitted to.

    Attributes:
        comparisons: one a fold.
        apart: (segment,) half misfit (see `whitened_misfit`) of the control less that of the
            effect, each segment of the recordings left out in turn (of a single recording: of its
            last part); None without a control.
        recording: (segment,) what was left out together with each.
        rises: whether squared errors on all that was left out in turn are larger with the effect
            than without.
    """

    comparisons: tuple[Comparison, ...] = ()
    apart: FloatArray | None = None
    recording: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    rises: bool = False

    @property
    def control(self) -> Quantity | None:
        """Control less after, a segment [nat]; None without a control."""
        return None if self.apart is None else a_segment(self.apart, self.recording)


def total_error(values: FloatArray, recording: IntArray) -> float:
    """Computes the standard error of a sum over segments (segment,) that are drawn within
    recordings.

    Recordings are strata: that an effect helps more in strong wind than in light wind is no chance.
    Where one has a single segment, segments are taken to be drawn from all.
    """
    if len(values) < 2:
        return math.inf
    return math.sqrt(
        sum(len(part) * float(np.var(part, ddof=1)) for part in _strata(values, recording))
    )


def _strata(values: FloatArray, recording: IntArray) -> list[FloatArray]:
    strata = [values[recording == index] for index in np.unique(recording)]
    return strata if min(len(part) for part in strata) > 1 else [values]


@dataclass(frozen=True, kw_only=True, eq=False)
class Predictions:
    """What one model says of segments: errors and predicted markers (frame, marker, 3, segment)
    [m]."""

    errors: FloatArray
    predicted: FloatArray

    @property
    def squared(self) -> FloatArray:
        """(segment,) mean squared distance [m²]."""
        return _squared_distance(self.errors)


def folds(segments: Segments, speeds: Sequence[float]) -> tuple[Fold, ...]:
    """Leaves each recording out in turn, where there are two or more, and the last part of every
    recording: a third, but two segments of four or more, so that chance within a recording
    shows."""
    recording = segments.recording
    result: list[Fold] = []
    if len(np.unique(recording)) > 1:
        result += [
            Fold(words=f"recording at {speeds[index]:.1f} m/s, unseen", outside=recording == index)
            for index in np.unique(recording)
        ]
    late = np.zeros(len(recording), dtype=bool)
    for index in np.unique(recording):
        in_recording = np.flatnonzero(recording == index)
        late[
            in_recording[-max(2 if len(in_recording) > _ENOUGH else 1, len(in_recording) // 3) :]
        ] = True
    if not late.all():
        result.append(Fold(words="last part of each recording, unseen", outside=late))
    return tuple(result)


def predict(
    forecaster: Forecaster,
    segments: Segments,
    model: Model,
) -> Predictions:
    """Predictions of segments by a model."""
    errors, predicted = forecaster.run(*model.system(forecaster, segments), segments)
    return Predictions(errors=_array(errors), predicted=_array(predicted))


def _array(values: torch.Tensor) -> FloatArray:
    return values.double().cpu().numpy()


@dataclass(frozen=True, kw_only=True, eq=False)
class LeftOut:
    """What a model leaves of segments it was not fitted to: (segment,) mean squared distances [m²],
    half misfits."""

    squared: FloatArray
    misfit: FloatArray


def left_out(
    forecaster: Forecaster,
    segments: Segments,
    fitted: Refined,
    whitened: WhitenedMisfit,
    outsides: Sequence[BoolArray],
) -> list[LeftOut]:
    """Computes what a model leaves, each time fitted to the other segments alone."""
    begun = [fitted.without(outside) for outside in outsides]
    ended = finish_step(
        forecaster, segments, whitened, begun, fitted.chosen, [~outside for outside in outsides]
    )
    models = [model for model, _ in ended]
    return measure_left_out(forecaster, segments, models, whitened, outsides, fitted.chosen)


def measure_left_out(
    forecaster: Forecaster,
    segments: Segments,
    models: Sequence[Model],
    whitened: WhitenedMisfit,
    outsides: Sequence[BoolArray],
    chosen: Sequence[int] = (),
) -> list[LeftOut]:
    """Computes what models leave as they are; what each leaves along the nuisances and chosen
    columns is fitted to the other segments."""
    errors_of_models = errors_of(models, forecaster, segments)
    return [
        LeftOut(
            squared=_squared_distance(_array(errors))[outside] / segments.tracked[outside],
            misfit=whitened.of(errors).left_out(outside, chosen),
        )
        for errors, outside in zip(errors_of_models, outsides, strict=True)
    ]


def _squared_distance(errors: FloatArray) -> FloatArray:
    """Computes the mean squared distance, (segment,) [m²]."""
    return (errors**2).sum(axis=2).mean(axis=(0, 1))


def compare(
    fold: Fold,
    *,
    recording: IntArray,
    frames: int,
    before: LeftOut,
    after: LeftOut,
    control: LeftOut | None,
    control_name: str,
    floor: FloatArray,
) -> Comparison:
    """Errors of the segments left out.

    Args:
        recording: (segment,) of those left out.
        floor: (segment,) mean squared distances of data simulated from the larger model, which it
            predicts with other numerics [m²].
    """
    old, new = before.squared, after.squared
    return Comparison(
        what=fold.words,
        frames=frames,
        before=root(old),
        after=root(new),
        reduction=paired_difference(old, new),
        floor=root(floor),
        share=share_removed(old, new, floor),
        control=None if control is None else root(control.squared),
        control_name=control_name,
        apart=None if control is None else a_segment(control.misfit - after.misfit, recording),
    )


def share_removed(before: FloatArray, after: FloatArray, floor: FloatArray) -> float | None:
    """Computes the share of the mean square above the floor that is gone after; None where there is
    hardly anything above it.

    Args:
        before, after, floor: (segment,) mean squared distances [m²].
    """
    most = float(before.mean())
    above = most - min(float(floor.mean()), most)
    return float(before.mean() - after.mean()) / above if above > CRITERIA.room * most else None


def a_segment(values: FloatArray, recording: IntArray) -> Quantity:
    """Averages misfits over segments, drawn within recordings, with Student's interval [nat]."""
    value, reach = float(values.mean()), math.inf
    if len(values) > 1:
        free = len(values) - len(_strata(values, recording))
        quantile = float(student.ppf(0.5 + CRITERIA.interval / 2, free))
        reach = quantile * total_error(values, recording) / len(values)
    return Quantity.of(
        value=value, low=value - reach, high=value + reach, unit="1", level=CRITERIA.interval
    )


def root(squared: FloatArray) -> Quantity:
    """Computes the root of the mean over segments, with Student's interval of the mean, through the
    root [m]."""
    mean = float(squared.mean())
    reach = _reach(squared)
    return Quantity.of(
        value=math.sqrt(mean),
        low=math.sqrt(max(mean - reach, 0.0)),
        high=math.sqrt(mean + reach),
        unit="m",
        level=CRITERIA.interval,
    )


def paired_difference(before: FloatArray, after: FloatArray) -> Quantity:
    """Computes the difference of roots of means, paired by segment: linear in the squares, for
    which Student's interval is valid."""
    slope = 1 / (math.sqrt(float(before.mean())) + math.sqrt(float(after.mean())))
    value, reach = slope * float((before - after).mean()), slope * _reach(before - after)
    return Quantity.of(
        value=value, low=value - reach, high=value + reach, unit="m", level=CRITERIA.interval
    )


def _reach(values: FloatArray) -> float:
    if len(values) < 2:
        return math.inf
    quantile = float(student.ppf(0.5 + CRITERIA.interval / 2, len(values) - 1))
    return quantile * float(values.std(ddof=1)) / math.sqrt(len(values))


def numerical_floor(
    setting: Setting, recordings: IntArray, model: Model, *, copies: int, seed: int
) -> tuple[IntArray, FloatArray]:
    """Computes the error that a model makes on data simulated from itself with other numerics.

    Each simulation has the wind, the way it is held and the noise of one recording, and the
    predictions are made as those of the recordings are.

    Args:
        setting: the experiment, and how it is predicted.
        recordings: (n,) indices of the recordings that are simulated again.
        model: which is simulated, and then predicts.
        copies: simulations of each recording.
        seed: of turbulence and noise.

    Returns:
        (segment,) the recording in whose wind it is, and its mean squared distance [m²].
    """
    first = setting.experiment.recordings[0]
    simulated = np.tile(recordings, copies)
    speeds = tuple(float(u) for u in setting.speeds[simulated])
    floor_seed = child_seed(seed, "floor")
    recorded, specimen = setting.experiment.recordings, setting.experiment.specimen
    batch = NullBatch(
        specimen=specimen,
        markers=first.markers,
        rate=1 / setting.segments.period,
        duration=_DURATION,
        noise=first.noise,
        calibrations=(model.calibration,) * len(simulated),
        speeds=speeds,
        winds=winds.like(recorded, speeds, duration=_DURATION, seed=floor_seed),
        tracks=tracks.like(
            recorded, specimen.seats, len(speeds), duration=_DURATION, seed=floor_seed
        ),
        seed=floor_seed,
        effects=model.acting,
    )
    trajectories = batch.simulate()
    segments = Segments.of(trajectories)
    forecaster = replace(setting.forecaster, specimen=as_seen(batch.specimen, trajectories))
    squared = predict(forecaster, segments, model).squared
    return simulated[segments.recording], squared
