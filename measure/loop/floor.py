"""What numerics leave: the error at which a model predicts recordings of itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.rng import child_seed
from measure.loop.comparison import predict
from measure.loop.forecast import Segments
from measure.loop.model import Model
from measure.loop.nulls import NullBatch
from measure.loop.setting import Setting
from measure.observe.anchors import as_seen

Floats = NDArray[np.float64]

_DURATION = 4.5  # s: two segments of each recording


def numerical_floor(
    setting: Setting, recordings: NDArray[np.int64], model: Model, *, copies: int, seed: int
) -> tuple[NDArray[np.int64], Floats]:
    """Errors of segments simulated from a model by other numerics and predicted by it.

    Args:
        recordings: of the experiment, in whose winds is simulated.
        copies: simulations of each.

    Returns:
        (segment,) the recording in whose wind it is, and its mean squared distance [m²].
    """
    first = setting.experiment.recordings[0]
    simulated = np.tile(recordings, copies)
    batch = NullBatch(
        specimen=setting.experiment.specimen, markers=first.markers, rate=1 / setting.segments.period,
        duration=_DURATION,
        noise=first.noise, calibrations=(model.calibration,) * len(simulated),
        speeds=tuple(float(u) for u in setting.speeds[simulated]),
        seed=child_seed(seed, "floor"), effects=model.acting,
    )  # fmt: skip
    made = batch.simulate()
    segments = Segments.of(made)
    forecaster = replace(setting.forecaster, specimen=as_seen(batch.specimen, made))
    squared = predict(forecaster, segments, model).squared
    return simulated[segments.recording], squared
