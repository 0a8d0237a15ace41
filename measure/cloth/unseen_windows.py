"""Errors on windows that a model was not fitted to: each observable in its unit, beside the scatter
of replicates.

The model is calibrated on one half of each recording and predicts the means of the other half, both
ways; where there are several recordings, also on all but one of them, in turn. Errors are of means
over windows, since single windows scatter by chaos whatever the model is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from flagdata.errors import RefusedError
from measure.cloth.design import Weighable
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.model_evidence import Sight, fit_model, hypothesis
from measure.cloth.observed_recording import LEAST_WINDOWS, Observed
from measure.cloth.simulations import Simulations, of_recordings, part_of, sights_of
from measure.observables import OBSERVABLES
from measure.verdict.criteria import CRITERIA
from measure.verdict.verdict_record import Comparison

_DRAWS = 500


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """What was predicted of windows that were not fitted.

    Attributes:
        observed: (observable,) mean over them; NaN where they do not show one.
        before, after, control: predicted by the base model, with the effect, with the best wrong
            one.
        scatter: (observable,) standard deviation of replicates.
        windows: how many.
    """

    observed: FloatArray
    before: FloatArray
    after: FloatArray | None
    control: FloatArray | None
    scatter: FloatArray
    windows: int


@dataclass(frozen=True, kw_only=True, eq=False)
class _Task:
    """Sights that are fitted, and those that are predicted: (place of the fitted one or None,
    sight, observed)."""

    fitted: tuple[tuple[Sight, Observed], ...]
    predicted: tuple[tuple[int | None, Sight, Observed], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Halves:
    """The two halves of a recording, each with the model that is fitted to simulations of it.

    Attributes:
        number: of the recording.
        first, second: model and windows.
    """

    number: int
    first: tuple[Sight, Observed]
    second: tuple[Sight, Observed]


def compare_models(
    recordings: Sequence[Observed],
    halves: Sequence[Halves],
    sights: Sequence[Sight],
    *,
    effect: Weighable | None,
    control: Weighable | None,
    area_weight: Stated | None = None,
    seed: int,
) -> tuple[Comparison, ...]:
    """Comparisons for each observable: on other halves, and on recordings left out.

    Args:
        halves: of the recordings that have them, see `halve_recordings`.
        sights: of whole recordings.
        effect: that is named; None for none.
        control: the best wrong effect; None for none.
        area_weight: of a cloth that was weighed [kg/m²].
    """
    comparisons: list[Comparison] = []
    for words, tasks in (
        ("other halves", _other_halves(halves)),
        ("recordings left out", _left_out(recordings, sights)),
    ):
        predictions = [
            predicted
            for task in tasks
            for predicted in _predict_windows(
                task, effect=effect, control=control, area_weight=area_weight, seed=seed
            )
        ]
        for column, name in enumerate(OBSERVED):
            shown_by = [
                prediction
                for prediction in predictions
                if math.isfinite(prediction.observed[column] + prediction.before[column])
            ]
            if shown_by:
                comparisons.append(
                    _comparison(f"{name}, {words}", name, column, shown_by, control, seed=seed)
                )
    return tuple(comparisons)


def _other_halves(halves: Sequence[Halves]) -> list[_Task]:
    """Fits all first halves and predicts all second ones, and the other way round."""
    if not halves:
        return []
    sides = [tuple(pair.first for pair in halves), tuple(pair.second for pair in halves)]
    return [
        _Task(fitted=a, predicted=tuple((place, s, o) for place, (s, o) in enumerate(b)))
        for a, b in permutations(sides, 2)
    ]


def halve_recordings(
    recordings: Sequence[Observed], simulations: Simulations
) -> tuple[tuple[Halves, ...], tuple[Finding, ...]]:
    """Returns the halves of the recordings that have two, and a warning for each of which one
    cannot be fitted.

    Recordings that are too short have none, nor have rows of a table against wind, whose windows
    are the same.
    """
    halves: list[Halves] = []
    whole: list[Finding] = []
    for number, recording in enumerate(recordings):
        if len(recording.readings) < 2 * LEAST_WINDOWS or recording.place:
            continue
        middle, own = len(recording.readings) // 2, simulations.of([number])
        try:
            first, second = (
                _half(recording, own, part) for part in (slice(0, middle), slice(middle, None))
            )
        except RefusedError as error:
            what = (
                f"{recording.name}: one half of it shows no observable that a model can be fitted "
                "to, so that no half "
                f"of it predicts the other: {error.what}"
            )
            whole.append(Finding.of("half-without-readings", what, fix=error.fix))
        else:
            halves.append(Halves(number=number, first=first, second=second))
    return tuple(halves), tuple(whole)


def _half(recording: Observed, simulations: Simulations, windows: slice) -> tuple[Sight, Observed]:
    (model,) = sights_of([recording], simulations, windows=[windows])
    return model, part_of(recording, windows)


def _left_out(recordings: Sequence[Observed], sights: Sequence[Sight]) -> list[_Task]:
    """Leaves each recording out, to be predicted by all others."""
    pairs = list(zip(sights, recordings, strict=True))
    if len(pairs) < 2:
        return []
    return [
        _Task(fitted=(*pairs[:number], *pairs[number + 1 :]), predicted=((None, *pairs[number]),))
        for number in range(len(pairs))
    ]


def _predict_windows(
    task: _Task,
    *,
    effect: Weighable | None,
    control: Weighable | None,
    area_weight: Stated | None,
    seed: int,
) -> list[Prediction]:
    sights = [sight for sight, _ in task.fitted]
    experiment = of_recordings(sights, [recording for _, recording in task.fitted], area_weight)
    rng = stream(seed, "films", "places")

    def means(which: Weighable | None) -> list[FloatArray]:
        """Predicts (observable,) of each predicted sight."""
        fit = fit_model(sights, experiment, which, seed=seed)
        cloth, places, strength = hypothesis(sights, which).values(fit.scores[0])
        columns = []
        for fitted_number, sight, _ in task.predicted:
            values = (
                places[fitted_number]
                if fitted_number is not None
                else {q.name: q.at(rng.random(len(fit.weights[0]))) for q in sight.quantities}
            )
            mean, _ = sight.predict(
                {**cloth, **values}, None if which is None else which.name, strength
            )
            full = np.full(len(sight.used), np.nan)
            full[sight.used] = fit.weights[0] @ mean
            columns.append(full[: len(OBSERVED)])
        return columns

    responding = all(
        added is None
        or all(added.name in s.responses for s in (*sights, *(p for _, p, _ in task.predicted)))
        for added in (effect, control)
    )
    before = means(None)
    after = means(effect) if effect is not None and responding else None
    wrong = means(control) if control is not None and responding else None
    result = []
    for number, (_, sight, recording) in enumerate(task.predicted):
        scatter = np.full(len(sight.used), np.nan)
        scatter[sight.used] = sight.emulator.deviations
        result.append(
            Prediction(
                observed=recording.summary[: len(OBSERVED)],
                before=before[number],
                after=None if after is None else after[number],
                control=None if wrong is None else wrong[number],
                scatter=scatter[: len(OBSERVED)],
                windows=len(recording.readings),
            )
        )
    return result


def _comparison(
    words: str,
    name: str,
    index: int,
    predictions: Sequence[Prediction],
    control: Weighable | None,
    *,
    seed: int,
) -> Comparison:
    """Compares root mean squares over the predicted parts, with intervals by the scatter of
    replicates."""
    unit = OBSERVABLES[name].unit
    observed, scatter = (
        np.array([getattr(prediction, key)[index] for prediction in predictions])
        for key in ("observed", "scatter")
    )
    noise = scatter * stream(seed, "films", "unseen", words).standard_normal(
        (_DRAWS, len(predictions))
    )

    def errors(predicted: Sequence[FloatArray]) -> tuple[float, FloatArray]:
        off = observed - np.array([prediction[index] for prediction in predicted])
        return float(np.sqrt(np.square(off).mean())), np.sqrt(np.square(off + noise).mean(axis=1))

    before = errors([prediction.before for prediction in predictions])
    with_effect = [prediction.after for prediction in predictions if prediction.after is not None]
    with_control = [
        prediction.control for prediction in predictions if prediction.control is not None
    ]
    after, wrong = (
        errors(with_effect) if with_effect else None,
        errors(with_control) if with_control else None,
    )
    floor = float(np.sqrt(np.square(scatter).mean()))
    reduction = None if after is None else (before[0] - after[0], before[1] - after[1])
    error_before = _estimate(before, unit)
    return Comparison(
        what=words,
        frames=sum(prediction.windows for prediction in predictions),
        before=error_before,
        after=_estimate(after, unit),
        reduction=_estimate(reduction, unit),
        floor=Quantity.of(value=floor, low=floor, high=floor, unit=unit, level=CRITERIA.interval),
        share=None
        if reduction is None or error_before.low <= floor
        else reduction[0] / (before[0] - floor),
        control=None if wrong is None else _estimate(wrong, unit),
        control_name="" if wrong is None or control is None else control.column.effect,
    )


def _estimate(value_and_draws: tuple[float, FloatArray] | None, unit: str) -> Quantity:
    if value_and_draws is None:
        return Quantity.of(
            value=math.nan, low=math.nan, high=math.nan, unit=unit, level=CRITERIA.interval
        )
    value, draws = value_and_draws
    tails = [(1 - CRITERIA.interval) / 2, (1 + CRITERIA.interval) / 2]
    low, high = np.quantile(draws, tails).tolist()
    return Quantity.of(
        value=value, low=min(low, value), high=max(high, value), unit=unit, level=CRITERIA.interval
    )
