"""Before and after on data that neither the choice of the terms nor a fit of the models used."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.core.arrays import BoolArray
from measure.forecasting.model import Model
from measure.forecasting.setting import Setting
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.validation import (
    LeftOut,
    a_segment,
    measure_left_out,
    numerical_floor,
    paired_difference,
    root,
    share_removed,
)
from measure.propose.outcome import Retest

_FLOOR_COPIES = 2


def retest(
    setting: Setting,
    whitened: WhitenedMisfit,
    used: BoolArray,
    before: Model,
    after: Model,
    *,
    control: Model | None,
    control_names: Sequence[str],
    words: str,
    seed: int,
) -> Retest:
    """Compares prediction errors of untouched segments by the models, paired by segment, beside
    what numerics leave.

    Args:
        whitened: of all segments.
        used: (segment,) those that the models were fitted to, and that what is left of the numerics
            is fitted to.
        control: the same freedom spent on other terms; None where there are none of another
            direction.
        control_names: which.
        words: which data.
        seed: of the recordings that the floor is of.
    """

    def misfits_left(model: Model) -> LeftOut:
        return measure_left_out(setting.forecaster, setting.segments, [model], whitened, [~used])[0]

    first, second, recording = misfits_left(before), misfits_left(after), setting.recording[~used]
    wrong = None if control is None else misfits_left(control)
    _, floor = numerical_floor(
        setting, np.unique(recording), after, copies=_FLOOR_COPIES, seed=seed
    )
    return Retest(
        what=words,
        segments=int((~used).sum()),
        before=root(first.squared),
        after=root(second.squared),
        reduction=paired_difference(first.squared, second.squared),
        helped=a_segment(first.misfit - second.misfit, recording),
        floor=root(floor),
        share=share_removed(first.squared, second.squared, floor),
        control=None if wrong is None else root(wrong.squared),
        apart=None if wrong is None else a_segment(wrong.misfit - second.misfit, recording),
        control_names=tuple(control_names),
    )
