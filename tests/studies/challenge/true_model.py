"""Prediction errors of the true model with the fitter's own numerics, against which E_red is
measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import torch

from measure.forecasting import Calibration, Setting
from measure.loop import folds
from measure.trajectories import Experiment
from sim.effects import Effect, Gusts, apply
from tests.studies.challenge.answer_key import AnswerKey
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.recipe import effect_type


class ReferenceErrors(Protocol):
    """Errors of the best attainable model of a set."""

    def __call__(self, folder: ChallengeFolder, key: AnswerKey, /) -> Mapping[str, float]:
        """Comparison, in the verdict's words → root mean square prediction error [m]; empty where
        it has none."""
        ...


def true_model_errors(folder: ChallengeFolder, key: AnswerKey) -> Mapping[str, float]:
    """Errors of the true cloth and effects; empty with gusts, since no model holds their time
    series.

    Raises:
        InputError: recordings that the fitter cannot use.
    """
    kinds = [(effect_type(acting.effect), acting) for acting in key.effects]
    if any(issubclass(kind, Gusts) for kind, _ in kinds):
        return {}
    effects = [kind(**{acting.parameter: acting.value}) for kind, acting in kinds]
    calibration = Calibration(area_weight=key.density, bending=key.bending, damping=key.damping)
    return prediction_errors(folder.experiment(key.name), calibration, effects)


def prediction_errors(
    experiment: Experiment, calibration: Calibration, effects: Sequence[Effect]
) -> Mapping[str, float]:
    """Root mean square prediction error [m] on each comparison of the verdict, by the comparison's
    words.

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
    squared = (
        (forecaster.errors(system, state, segments) ** 2).sum(2).mean((0, 1)).double().cpu().numpy()
    )
    left_out = folds(segments, [float(u) for u in setting.speeds])
    return {fold.words: float(np.sqrt(squared[fold.outside].mean())) for fold in left_out}
