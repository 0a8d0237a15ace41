"""The corrective field: the smooth steady force that fits best, where the library has no answer.

It is looked for last and only then: its modes are simulated along the data alone, and fitted to the errors along the
directions that the nulls know.
"""

from __future__ import annotations

from dataclasses import dataclass

from measure.loop.columns import THETA, FieldColumn, fields
from measure.loop.inference import Evidence
from measure.loop.setting import Setting
from measure.loop.yardstick import Yardstick


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


def corrective_field(setting: Setting, yardstick: Yardstick) -> tuple[Mode, ...]:
    """Its modes, fitted together to what the nominal model leaves."""
    forecaster, segments, modes = setting.forecaster, setting.segments, fields()
    nominal = [setting.nominal] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    changes = forecaster.sensitivities(modes, segments, nominal, base)[len(THETA) :]
    evidence = Evidence.of(
        yardstick.found, yardstick.speeds, yardstick.null, beside=yardstick.projection.response(changes)
    )
    first = yardstick.found.r.shape[1]
    fit = evidence.fit(range(first, first + len(modes)))
    found = (fit.of(first + place) for place in range(len(modes)))
    return tuple(Mode(column=c, value=v, error=e) for c, (v, e) in zip(modes, found, strict=True))
