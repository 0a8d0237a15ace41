"""The gate of `measure.gate`, all of its checks together, as the measuring asks it: window by window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from measure.estimate.gate import Reason
from measure.gate.counted import COUNTED
from measure.gate.gate import Gate as Calibrated
from measure.gate.judgement import CONFIDENCE, Cause, judge
from measure.gate.tail_probability import level
from models.estimator import Estimator


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedGate:
    """A gate that was calibrated for a model.

    Attributes:
        model: whose training windows are compared with.
        calibrated: its checks, by clips that the model was not trained on.
        false_alarm: rate at which reasons are given.
    """

    model: Estimator
    calibrated: Calibrated
    false_alarm: float

    def judge(self, frames: NDArray[np.uint8], summary: NDArray[np.floating]) -> list[Reason]:
        found = judge(
            frames, self.model, self.calibrated, false_alarm=self.false_alarm, summary=summary, without=COUNTED
        )
        if not found.reasons:
            return [Reason(kind="familiar", what=f"no check is unusual, p = {found.p:.3f} over all checks", p=found.p)]
        # The first speaks for all checks together.
        return [_reason(cause, p=cause.p if place else found.p) for place, cause in enumerate(found.reasons)]

    def level(self, false_alarm: float) -> float:
        return level(len(self.calibrated.calibration), false_alarm, CONFIDENCE)


def _reason(cause: Cause, *, p: float) -> Reason:
    """What a statistic says: only that the window is unlike the training clips, and in which figure. Faults such as a
    moving camera are counted in the film (`measure.gate.counted`), and are stated from there."""
    if cause.blank or not cause.figure:
        return Reason(kind=cause.kind, what=cause.sentence, p=p, fix=cause.fix, blank=cause.blank)
    return Reason(kind="unlike-training", what=cause.figure, p=p)
