"""Before and after on data that neither the choice of the terms nor the fit of either model has seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flagdata.rng import child_seed
from measure.loop.close import Setting
from measure.loop.comparison import paired, predict, root
from measure.loop.forecast import Segments
from measure.loop.model import Model
from measure.loop.nulls import NullBatch
from measure.propose.outcome import Retest

Floats = NDArray[np.float64]

_FLOOR_DURATION = 4.5  # s: two segments of each recording
_FLOOR_COPIES = 2
_ROOM = 0.02
"""Share of the squared error before that must lie above the floor, for a reduction to be a share of it."""


def retest(
    setting: Setting,
    untouched: Segments,
    before: Model,
    after: Model,
    *,
    control: Model | None,
    control_names: Sequence[str],
    words: str,
    seed: int,
) -> Retest:
    """Prediction errors of untouched segments by the models, paired by segment, beside what numerics leave.

    Args:
        control: the same freedom spent on other terms; None where there are none of another direction.
        control_names: which.
        words: which data.
        seed: of the recordings that the floor is of.
    """

    def squared(model: Model) -> Floats:
        return predict(setting.forecaster, untouched, model).squared

    first, second = squared(before), squared(after)
    wrong = None if control is None else squared(control)
    floor = _floor(setting, np.unique([s.recording for s in untouched.items]), after, seed)
    room = float(first.mean()) - min(float(floor.mean()), float(first.mean()))
    gained = float(first.mean() - second.mean())
    return Retest(
        what=words, segments=len(untouched), before=root(first), after=root(second), reduction=paired(first, second),
        floor=root(floor), share=gained / room if room > _ROOM * float(first.mean()) else None,
        control=None if wrong is None else root(wrong), apart=None if wrong is None else paired(wrong, second),
        control_names=tuple(control_names),
    )  # fmt: skip


def _floor(setting: Setting, recordings: NDArray[np.int64], model: Model, seed: int) -> Floats:
    """Mean squared errors of segments simulated from a model and predicted by it: what other numerics leave [m²]."""
    first = setting.experiment.recordings[0]
    speeds = np.tile(setting.speeds[recordings], _FLOOR_COPIES)
    batch = NullBatch(
        specimen=setting.experiment.specimen, markers=first.markers, rate=first.rate, duration=_FLOOR_DURATION,
        noise=first.noise, calibrations=(model.calibration,) * len(speeds), speeds=tuple(float(u) for u in speeds),
        seed=child_seed(seed, "floor"), effects=model.acting,
    )  # fmt: skip
    segments = Segments.of(batch.simulate())
    return predict(setting.forecaster, segments, model).squared
