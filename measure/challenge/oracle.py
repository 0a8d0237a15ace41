"""The error that the true model would have had, with the fitter's own numerics: what E_red is measured against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import torch

from measure.challenge.folder import ChallengeFolder
from measure.challenge.key import Key
from measure.challenge.recipe import effect_type
from measure.forecasting.calibration import Calibration
from measure.forecasting.setting import Setting
from measure.loop.validation import folds
from measure.observe.trajectory import Experiment
from sim.effects import Effect, apply
from sim.effects.gusts import Gusts


class Oracle(Protocol):
    """Knows the truth."""

    def __call__(self, folder: ChallengeFolder, key: Key, /) -> Mapping[str, float]:
        """Comparison, in the verdict's words → root mean square prediction error [m]; empty where it has none."""
        ...


def true_model(folder: ChallengeFolder, key: Key) -> Mapping[str, float]:
    """By predicting with the true cloth and effects; empty with gusts, whose course is in no model.

    Raises:
        InputError: recordings that the fitter cannot use.
    """
    kinds = [(effect_type(acting.effect), acting) for acting in key.effects]
    if any(issubclass(kind, Gusts) for kind, _ in kinds):
        return {}
    effects = [kind(**{acting.parameter: acting.value}) for kind, acting in kinds]
    calibration = Calibration(density=key.density, bending=key.bending, damping=key.damping)
    return oracle(folder.experiment(key.name), calibration, effects)


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
