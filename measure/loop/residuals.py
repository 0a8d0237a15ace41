"""Where, when and at which frequencies the model errs, for the report."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from measure.forecasting.segments import Segments
from measure.loop.validation import Predictions
from measure.trajectories.trajectory import Experiment
from measure.verdict.verdict_record import Residual

_SHOWN = 50
"""Frames in motion: two seconds at 25 a second."""


def residuals(
    experiment: Experiment,
    segments: Segments,
    before: Predictions,
    after: Predictions | None,
    *,
    held_out: bool,
) -> tuple[Residual, ...]:
    """Computes the residuals of each recording, from predictions of all segments.

    Args:
        held_out: whether each recording's were made by models that were not fitted to it.
    """
    recording = segments.recording
    residuals_of: list[Residual] = []
    for index, trajectory in enumerate(experiment.recordings):
        places = np.flatnonzero(recording == index)
        first, second = (
            _join_segments(before.errors, places),
            None if after is None else _join_segments(after.errors, places),
        )
        counted = np.ones(first.shape[:2], dtype=bool)
        if segments.counted is not None:
            counted = np.concatenate([segments.counted[..., segment] for segment in places])
        starts = [segments.items[p].start + segments.first * segments.period for p in places]
        length = before.errors.shape[0]
        times = np.concatenate([start + np.arange(length) * segments.period for start in starts])
        frequencies, spectrum = _spectrum(first, segments.period)
        first_frames = slice(0, _SHOWN)
        predicted = _join_segments(before.predicted, places)[first_frames]
        residuals_of.append(
            Residual(
                recording=trajectory.name,
                speed=trajectory.wind.speed,
                held_out=held_out,
                times=_list(times),
                in_time=_list(_over(first, counted, 1)),
                in_time_after=[] if second is None else _list(_over(second, counted, 1)),
                markers=segments.markers.tolist(),
                in_space=_list(_over(first, counted, 0)),
                in_space_after=[] if second is None else _list(_over(second, counted, 0)),
                mean=(first.sum(axis=0) / np.maximum(counted.sum(axis=0), 1)[:, None]).tolist(),
                frequencies=_list(frequencies),
                spectrum=_list(spectrum),
                spectrum_after=[]
                if second is None
                else _list(_spectrum(second, segments.period)[1]),
                observed=np.where(
                    counted[first_frames, :, None], predicted + first[first_frames], np.nan
                ).tolist(),
                before=predicted.tolist(),
                after=[]
                if after is None
                else _join_segments(after.predicted, places)[first_frames].tolist(),
            )
        )
    return tuple(residuals_of)


def _join_segments(values: FloatArray, places: IntArray) -> FloatArray:
    """Joins one recording's segments one after another, (frame, marker, 3)."""
    return np.concatenate([values[..., segment] for segment in places])


def _over(errors: FloatArray, counted: BoolArray, axis: int) -> FloatArray:
    """Computes the root mean square distance over frames (0) or markers (1) [m], of what was
    tracked; NaN where nothing was."""
    count = counted.sum(axis=axis)
    total = (errors**2).sum(axis=2).sum(axis=axis)
    return np.sqrt(np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0))


def _spectrum(errors: FloatArray, period: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and mean one-sided power density of the errors' coordinates, summed over
    axes [m²/Hz]."""
    frequencies, density = welch(errors, fs=1 / period, axis=0, nperseg=min(50, len(errors)))
    return frequencies[1:], density.sum(axis=2).mean(axis=1)[1:]


def _list(values: FloatArray) -> list[float]:
    return [float(v) for v in values]
