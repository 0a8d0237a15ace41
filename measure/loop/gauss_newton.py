"""Models fitted beyond the linear: linearised again where the last fit led, until they stay
(Gauss–Newton)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.errors import ErrorKind, FlagdataError
from measure.forecasting.calibrated_parameters import PRIOR, THETA, Calibration
from measure.forecasting.model import Model, errors_of, linearise_model
from measure.forecasting.observer import Forecaster
from measure.forecasting.regressors import Column, EffectColumn
from measure.forecasting.segments import Segments
from measure.inference.random_effect import NullModel
from measure.inference.segment_evidence import Evidence
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.probes.statistics import Statistics, reduce_errors

ROUNDS = 3
_FEW = 8
"""Shifts of the numerics that are fitted beside the few columns of a model: with 16, they take the
columns' place."""
_HALVINGS = 4
_TRIED = 4
"""Strengths across a prior of one sign from which a fit may begin."""
STAYS = 0.3
"""Standard errors below which a step is not worth another round."""
_LONGEST = 1.5
"""A step of the calibrated parameters beyond so many prior standard deviations is cut: the linear
model ends there."""


class FitDivergedError(FlagdataError):
    """A model whose predictions are not finite."""

    kind = ErrorKind.DIVERGED


@dataclass(frozen=True, kw_only=True, eq=False)
class Refined:
    """A model where Gauss–Newton led, linearised there.

    Attributes:
        model: fitted to all segments.
        chosen: its columns beside the calibrated parameters.
        errors: standard errors of its calibrated parameters and strengths, as Σ has them along all
            directions.
        statistics: at the model before the last step, `origin`, of all segments.
        origin: that model.
        anchor: calibration by all directions, about which the prior of the null model is.
        null: the null model of its columns.
        speeds: (segment,) of the wind [m/s].
        stays: whether another round would hardly move it.
    """

    model: Model
    chosen: tuple[int, ...]
    errors: tuple[float, ...]
    statistics: Statistics
    origin: Model
    anchor: Calibration
    null: NullModel
    speeds: FloatArray
    stays: bool

    def without(self, outside: BoolArray) -> Model:
        """Fits the same model to the other segments alone, one step from `origin`."""
        step, _ = _step(
            self.statistics.select(~outside),
            self.null,
            self.speeds[~outside],
            self.origin,
            self.anchor,
        )
        return self.origin.moved(cut(step))


def refine(
    forecaster: Forecaster,
    segments: Segments,
    whitened: WhitenedMisfit,
    chosen: Sequence[int],
    *,
    columns: Sequence[Column],
) -> Refined:
    """Fits the calibrated parameters and chosen columns to segments, from the linear fit of the
    statistics on; one effect alone from where across its prior least is left, if that is less.

    Every round uses the errors along the fitted columns alone, with their part of the null model.
    These alone would lead the calibrated parameters astray by what numerics leave, so that their
    prior is there the estimate by all directions before.

    Args:
        columns: the columns of the statistics, but for the calibrated parameters.

    Raises:
        DivergedError: the model's cloth does not stay one, at an eighth of the way from the nominal
            base model neither.
    """
    fit = whitened.evidence(whitened.statistics).fit(
        chosen, centre=Calibration().steps_from(whitened.origin)
    )
    chosen_columns = [columns[c - len(THETA)] for c in chosen]
    effects = tuple((column, 0.0) for column in chosen_columns if isinstance(column, EffectColumn))
    values = [*fit.value[: len(THETA)], *(fit.of(c)[0] for c in chosen)]
    model = Model(calibration=whitened.origin, effects=effects).moved(
        cut(np.array(values, dtype=np.float64))
    )
    model = _where_least_is_left(forecaster, segments, whitened, model)
    prior = np.array([fit.of(index)[1] for index in range(len(THETA))])
    part = replace(_part(whitened.null, [*range(len(THETA)), *chosen]), prior=prior)
    anchor = model.calibration
    reached = _round(
        forecaster, segments, model, part, whitened.speeds, tuple(chosen), anchor=anchor
    )
    for _ in range(ROUNDS - 1):
        if reached.stays:
            break
        reached = _round(
            forecaster, segments, reached.model, part, whitened.speeds, tuple(chosen), anchor=anchor
        )
    all_segments = np.ones(len(segments), dtype=bool)
    ((model, errors),) = finish_step(
        forecaster, segments, whitened, [reached.model], chosen, [all_segments]
    )
    return replace(reached, model=model, errors=errors)


def _where_least_is_left(
    forecaster: Forecaster, segments: Segments, whitened: WhitenedMisfit, model: Model
) -> Model:
    """Returns a model of one effect at the strength that leaves least, of the linear fit's and of
    some across what is
    expected: an effect that soon saturates, as springs along the hoist do, is far from what its
    first small step promises."""
    if len(model.effects) != 1:
        return model
    ((column, linear),) = model.effects
    tried = [
        replace(model, effects=((column, value),))
        for value in (linear, *_expected_strengths(column))
    ]
    misfits: list[float] = []
    for errors in errors_of(tried, forecaster, segments):
        finite = bool(errors.isfinite().all())
        misfits.append(whitened.of(errors).fit(()).remainder if finite else np.inf)
    return tried[int(np.argmin(misfits))] if np.isfinite(misfits).any() else model


def _expected_strengths(column: EffectColumn) -> list[float]:
    """Strengths beyond null across the prior: spaced by factors where all have one sign."""
    low, high = (end - column.described.null for end in column.described.prior)
    if low * high > 0:
        return [float(value) for value in np.geomspace(low, high, _TRIED)]
    return [share * end for end in (low, high) if end for share in (0.5, 1.0)]


def finish_step(
    forecaster: Forecaster,
    segments: Segments,
    whitened: WhitenedMisfit,
    models: Sequence[Model],
    chosen: Sequence[int],
    insides: Sequence[BoolArray],
) -> list[tuple[Model, tuple[float, ...]]]:
    """Moves models of the same columns by one linear step by all directions of the whitened misfit,
    each fitted to some segments; returns them with the standard errors of that step.

    By its own few directions a fit follows effects far from where they are linear, but cannot
    separate some of them from numerical errors; by all directions, it can.
    """
    errors_of_models = errors_of(models, forecaster, segments)
    stepped: list[tuple[Model, tuple[float, ...]]] = []
    for model, errors, inside in zip(models, errors_of_models, insides, strict=True):
        fit = (
            whitened.of(errors)
            .select(inside)
            .fit(chosen, centre=Calibration().steps_from(model.calibration))
        )
        step, spread = np.array([fit.of(column) for column in (*range(len(THETA)), *chosen)]).T
        moved = model.moved(cut(step)) if np.isfinite(step).all() else model
        stepped.append((moved, tuple(float(error) for error in spread)))
    return stepped


def _round(
    forecaster: Forecaster,
    segments: Segments,
    origin: Model,
    null: NullModel,
    speeds: FloatArray,
    chosen: tuple[int, ...],
    *,
    anchor: Calibration,
) -> Refined:
    for _ in range(_HALVINGS):
        measured = _linearise_models(forecaster, segments, origin)
        if np.isfinite(measured.r).all() and np.isfinite(measured.response).all():
            break
        origin = origin.halfway_to_nominal()
    else:
        raise FitDivergedError(
            "its cloth does not stay one",
            where=", ".join(column.name for column, _ in origin.effects) or "base model",
            fix="look at the recordings' residuals: no model of the library is near them",
        )
    step, errors = _step(measured, null, speeds, origin, anchor)
    return Refined(
        model=origin.moved(cut(step)),
        chosen=chosen,
        errors=tuple(float(e) for e in errors),
        statistics=measured,
        origin=origin,
        anchor=anchor,
        null=null,
        speeds=speeds,
        stays=bool(np.abs(step / errors).max() < STAYS),
    )


def cut(step: FloatArray) -> tuple[float, ...]:
    """Cuts a step along the calibrated parameters and strengths to no further than the linear model
    reaches."""
    longest = np.concatenate([_LONGEST * PRIOR, np.full(len(step) - len(PRIOR), np.inf)])
    return tuple(float(v) for v in np.clip(step, -longest, longest))


def _part(null: NullModel, places: list[int]) -> NullModel:
    return NullModel(
        coefficients=null.coefficients[:, places],
        covariance=null.covariance[np.ix_(places, places)],
        shifts=null.shifts[:_FEW, places],
        prior=null.prior,
    )


def _linearise_models(forecaster: Forecaster, segments: Segments, model: Model) -> Statistics:
    if any(column.double for column, _ in model.effects):
        forecaster = forecaster.double
    base, changes = linearise_model(model, forecaster, segments)
    return reduce_errors(base, changes, segments.recording, segments.noise, segments.counted)


def _step(
    statistics: Statistics, null: NullModel, speeds: FloatArray, model: Model, anchor: Calibration
) -> tuple[FloatArray, FloatArray]:
    """Takes one step of generalised least squares from here, under the prior about a calibration;
    with standard errors."""
    count = statistics.r.shape[1]
    chosen = range(len(THETA), count)
    fit = Evidence.of(statistics, speeds, null).fit(
        chosen, centre=anchor.steps_from(model.calibration)
    )
    value, error = zip(*(fit.of(column) for column in range(count)), strict=True)
    return np.array(value), np.array(error)
