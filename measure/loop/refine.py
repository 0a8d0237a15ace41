"""Models fitted beyond the linear: linearised again where the last fit led, until they stay (Gauss–Newton)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import FlagdataError
from measure.loop.columns import PRIOR, THETA, Calibration, Column, EffectColumn
from measure.loop.forecast import Forecaster, Segments
from measure.loop.inference import Evidence
from measure.loop.model import Model
from measure.loop.statistics import Statistics
from measure.loop.yardstick import Yardstick

Floats = NDArray[np.float64]

_ROUNDS = 3
_HALVINGS = 4
_STAYS = 0.3
"""Standard errors below which a step is not worth another round."""
_LONGEST = 1.5
"""A step of the calibrated parameters beyond so many prior standard deviations is cut: the linear model ends there."""


class DivergedError(FlagdataError):
    """A model whose predictions are not finite."""

    kind = "diverged"


@dataclass(frozen=True, kw_only=True, eq=False)
class Refined:
    """A model where Gauss–Newton led, linearised there.

    Attributes:
        model: fitted to all segments.
        chosen: its columns beside the calibrated parameters.
        errors: standard errors of its calibrated parameters and strengths, as Σ has them.
        statistics: at the model before the last step, `origin`, of all segments; responses to its own columns as there.
        origin: that model.
        yardstick: the measure.
        stays: whether another round would hardly move it.
    """

    model: Model
    chosen: tuple[int, ...]
    errors: tuple[float, ...]
    statistics: Statistics
    origin: Model
    yardstick: Yardstick
    stays: bool

    def without(self, outside: NDArray[np.bool_]) -> Model:
        """The same model fitted to the other segments alone, one step from `origin`."""
        evidence = self.yardstick.evidence(self.statistics).select(~outside)
        step, _ = _step(evidence, self.chosen, self.origin)
        return self.origin.moved(_cut(step))


def refine(
    forecaster: Forecaster,
    segments: Segments,
    yardstick: Yardstick,
    chosen: Sequence[int],
    *,
    weighed: Sequence[Column],
) -> Refined:
    """Fit the calibrated parameters and chosen columns to segments, from the linear fit on.

    Args:
        weighed: the columns of the statistics, but for the calibrated parameters.

    Raises:
        DivergedError: the model's cloth does not stay one, at an eighth of the effects' strengths neither.
    """
    fit = yardstick.evidence(yardstick.found).fit(chosen)
    own = [weighed[c - len(THETA)] for c in chosen]
    effects = tuple((column, 0.0) for column in own if isinstance(column, EffectColumn))
    values = [*fit.value[: len(THETA)], *(fit.of(c)[0] for c in chosen)]
    model = Model(calibration=Calibration(), effects=effects).moved(_cut(np.array(values, dtype=np.float64)))
    reached = _round(forecaster, segments, model, yardstick, tuple(chosen))
    for _ in range(_ROUNDS - 1):
        if reached.stays:
            break
        reached = _round(forecaster, segments, reached.model, yardstick, tuple(chosen))
    return reached


def _round(
    forecaster: Forecaster, segments: Segments, origin: Model, yardstick: Yardstick, chosen: tuple[int, ...]
) -> Refined:
    for _ in range(_HALVINGS):
        found = _linearised(forecaster, segments, origin, yardstick, chosen)
        if np.isfinite(found.r).all() and np.isfinite(found.response).all():
            break
        origin = replace(origin, effects=tuple((column, strength / 2) for column, strength in origin.effects))
    else:
        raise DivergedError(
            "its cloth does not stay one", where=", ".join(column.name for column, _ in origin.effects) or "base model",
            fix="look at the recordings' residuals: no model of the library is near them",
        )  # fmt: skip
    step, errors = _step(yardstick.evidence(found), chosen, origin)
    return Refined(
        model=origin.moved(_cut(step)), chosen=chosen, errors=tuple(float(e) for e in errors), statistics=found,
        origin=origin, yardstick=yardstick, stays=bool(np.abs(step / errors).max() < _STAYS),
    )  # fmt: skip


def _cut(step: Floats) -> tuple[float, ...]:
    longest = np.concatenate([_LONGEST * PRIOR, np.full(len(step) - len(PRIOR), np.inf)])
    return tuple(float(v) for v in np.clip(step, -longest, longest))


def _linearised(
    forecaster: Forecaster, segments: Segments, model: Model, yardstick: Yardstick, chosen: tuple[int, ...]
) -> Statistics:
    """Statistics at a model, with the responses to its own columns there."""

    def left(at: Model) -> Floats:
        return yardstick.projection.of(forecaster.errors(*at.system(forecaster, segments), segments))

    r = left(model)
    response = yardstick.found.response.copy()
    sizes = [*(step for _, _, step in THETA), *(column.step for column, _ in model.effects)]
    for place, (column, size) in enumerate(zip([*range(len(THETA)), *chosen], sizes, strict=True)):
        moved = model.moved(tuple(size if k == place else 0.0 for k in range(len(sizes))))
        response[:, :, column] = (r - left(moved)) / size
    return replace(yardstick.found, r=r, response=response)


def _step(evidence: Evidence, chosen: Sequence[int], model: Model) -> tuple[Floats, Floats]:
    """Of generalised least squares from here, under the prior about the nominal calibration; with standard errors."""
    fit = evidence.fit(chosen, centre=Calibration().steps_from(model.calibration))
    value, error = zip(*(fit.of(column) for column in (*range(len(THETA)), *chosen)), strict=True)
    return np.array(value), np.array(error)
