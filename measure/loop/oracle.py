"""What the fit's own numerics leave of data whose truth is known: the error of the model with the true effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from measure.loop.columns import Calibration
from measure.loop.comparison import folds
from measure.loop.setting import Setting
from measure.observe.trajectory import Experiment
from sim.effects import Effect, apply


def oracle(experiment: Experiment, calibration: Calibration, effects: Sequence[Effect]) -> Mapping[str, float]:
    """Root mean square prediction error [m] on each comparison of the verdict, by the comparison's words.

    Args:
        calibration: the true factors on the nominal material, and its true damping.
        effects: the true ones, at their strengths.

    Raises:
        InputError: recordings that cannot be used together, or are too short.
    """
    torch.set_num_threads(1)
    setting = Setting.of(experiment)
    segments, forecaster = setting.segments, setting.forecaster
    system, state = apply(effects, *forecaster.system(segments, [calibration] * len(segments)))
    squared = (forecaster.errors(system, state, segments) ** 2).sum(2).mean((0, 1)).double().cpu().numpy()
    left_out = folds(segments, [float(u) for u in setting.speeds])
    return {fold.words: float(np.sqrt(squared[fold.outside].mean())) for fold in left_out}
