"""The errors of a verdict as arrays: by recording, and by marker, frame and frequency."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.answer.answer import Array
from flagdata.core.arrays import FloatArray
from measure.verdict.verdict_record import Verdict

_COURSES = {
    "time": ("times", "s", "in_time", "m"),
    "marker": ("markers", "m", "in_space", "m"),
    "frequency": ("frequencies", "Hz", "spectrum", "m2/Hz"),
}
"""Dimension → its places and their unit, the base model's errors along it and theirs."""


def arrays_of(verdict: Verdict) -> dict[str, Array]:
    """Returns name → array of a verdict's residuals; a shorter recording ends in NaN."""
    residuals = verdict.residuals
    if not residuals:
        return {}
    arrays = {
        "recording": Array(
            dimensions=("recording",),
            values=np.array([one.recording for one in residuals]),
            coordinate=True,
        ),
        "wind_speed": Array(
            dimensions=("recording",), values=np.array([one.speed for one in residuals]), unit="m/s"
        ),
    }
    for dimension, (places, unit, errors, of_errors) in _COURSES.items():
        dimensions = ("recording", dimension)
        axes = (*dimensions, "uv") if dimension == "marker" else dimensions
        at = _pad([getattr(one, places) for one in residuals])
        arrays[f"{dimension}_place"] = Array(dimensions=axes, values=at, unit=unit, coordinate=True)
        for suffix, model in (("", "before"), ("_after", "after")):
            values = [getattr(one, f"{errors}{suffix}") for one in residuals]
            if any(values):
                arrays[f"{errors}_{model}"] = Array(
                    dimensions=dimensions,
                    values=_pad(values, width=at.shape[1]),
                    unit=of_errors,
                    about=f"prediction error {model} adding what was named",
                )
    return arrays


def _pad(
    values: Sequence[Sequence[float] | Sequence[Sequence[float]]], width: int = 0
) -> FloatArray:
    """Stacks sequences of unequal length, NaN where one has ended."""
    arrays = [np.asarray(one, dtype=np.float64) for one in values]
    length = max([width, *(len(one) for one in arrays)])
    rest = next((one.shape[1:] for one in arrays if one.size), ())
    padded = np.full((len(arrays), length, *rest), np.nan)
    for row, one in zip(padded, arrays, strict=True):
        if one.size:
            row[: len(one)] = one
    return padded
