"""The corrective field: the smooth steady force that fits best, where the library has no answer, or
half of one.

It is looked for last and only then: its modes are simulated along the data alone, and fitted to the
errors along the directions that the nulls know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from torch import Tensor

from measure.forecasting.calibrated_parameters import THETA
from measure.forecasting.regressors import FieldColumn, fields
from measure.forecasting.setting import Setting
from measure.inference.segment_evidence import Evidence
from measure.inference.whitened_misfit import WhitenedMisfit


@dataclass(frozen=True, kw_only=True)
class Mode:
    """One of the field's.

    Attributes:
        column: which.
        value, error: its coefficient, beside all others, and the standard error [m/s²].
    """

    column: FieldColumn
    value: float
    error: float


def corrective_field(
    setting: Setting,
    whitened: WhitenedMisfit,
    *,
    errors: Tensor | None = None,
    along: Sequence[int] = (),
) -> tuple[Mode, ...]:
    """Fits the modes of the corrective field together.

    Args:
        errors: (frame, marker, 3, segment) errors of a larger model [m]; None for those of the
            nominal one.
        along: columns of that model, whose strengths are fitted with the field.
    """
    forecaster, segments, modes = setting.forecaster, setting.segments, fields()
    nominal = [setting.calibration] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    changes = forecaster.sensitivities(modes, segments, nominal, base)[len(THETA) :]
    statistics = (
        whitened.statistics
        if errors is None
        else replace(whitened.statistics, r=whitened.projection.of(errors))
    )
    response = whitened.projection.response(changes)
    evidence = Evidence.of(statistics, whitened.speeds, whitened.null, further=response)
    first = statistics.r.shape[1]
    fit = evidence.fit([*along, *range(first, first + len(modes))])
    fitted = (fit.of(first + index) for index in range(len(modes)))
    return tuple(Mode(column=c, value=v, error=e) for c, (v, e) in zip(modes, fitted, strict=True))
