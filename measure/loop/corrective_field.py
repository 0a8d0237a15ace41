"""The corrective field: the smooth steady force that fits best, where the library has no answer, or half of one.

It is looked for last and only then: its modes are simulated along the data alone, and fitted to the errors along the
directions that the nulls know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from torch import Tensor

from measure.forecasting.calibration import THETA
from measure.forecasting.regressors import FieldColumn, fields
from measure.forecasting.setting import Setting
from measure.inference.evidence import Evidence
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
    setting: Setting, whitened: WhitenedMisfit, *, left: Tensor | None = None, beside: Sequence[int] = ()
) -> tuple[Mode, ...]:
    """Its modes, fitted together.

    Args:
        left: (frame, marker, 3, segment) errors of a larger model [m]; None for those of the nominal one.
        beside: columns of that model, whose strengths are fitted with the field.
    """
    forecaster, segments, modes = setting.forecaster, setting.segments, fields()
    nominal = [setting.calibration] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    changes = forecaster.sensitivities(modes, segments, nominal, base)[len(THETA) :]
    found = whitened.found if left is None else replace(whitened.found, r=whitened.projection.of(left))
    response = whitened.projection.response(changes)
    evidence = Evidence.of(found, whitened.speeds, whitened.null, beside=response)
    first = found.r.shape[1]
    fit = evidence.fit([*beside, *range(first, first + len(modes))])
    fitted = (fit.of(first + place) for place in range(len(modes)))
    return tuple(Mode(column=c, value=v, error=e) for c, (v, e) in zip(modes, fitted, strict=True))
