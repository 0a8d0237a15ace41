"""The verdict on films in numbers: which effects may be missing, how strong, and what the cloth is
with them.

verdict = close_loop(recordings, FilmLoopOptions(calibration=...), folder=..., workers=2)
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.special import ndtr

from flagdata.answer import Bound, Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Severity
from flagdata.core.json_values import json_values
from flagdata.core.provenance import code_version
from measure.cloth.design import Weighable, filmed
from measure.cloth.films_statement import state_verdict
from measure.cloth.flag_prior import CLOTH
from measure.cloth.loop import (
    FilmLoopOptions,
    SolvedLoop,
    solve,
)
from measure.cloth.model_evidence import (
    Fit,
    expected_strength,
    fit_model,
    hypothesis,
    quantiles,
)
from measure.cloth.observed_recording import Observed
from measure.cloth.simulations import deviation_of, of_recordings
from measure.cloth.unseen_windows import compare_models
from measure.forecasting.setting import Stage
from measure.forecasting.strengths import what_copies, why_unweighed
from measure.posterior_ends import span
from measure.verdict.criteria import CRITERIA
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.verdict_record import Candidate, NullTest, Parameter, Power, Verdict

SEEN = 2.0
"""Standard errors below which even a strong effect is not seen."""
_EVEN = 1000
"""Draws of a posterior that are taken evenly from importance samples."""


def close_loop(
    recordings: Sequence[Observed],
    options: FilmLoopOptions,
    *,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> Verdict:
    """Finds the verdict on recordings of one flag.

    Args:
        recordings: each cut to what is to be used; in different winds they say most.
        folder: where simulations are kept.
        workers: processes that simulate.
        stage: called with what is simulated, and how many flags of how many are done.

    Raises:
        InputError: recordings that too few simulations resemble.
        CorruptError: a kept batch that cannot be read.
    """
    begun = time.monotonic()
    verdict = verdict_of(solve(recordings, options, folder=folder, workers=workers, stage=stage))
    return replace(verdict, seconds=time.monotonic() - begun)


def verdict_of(outcome: SolvedLoop) -> Verdict:
    """Returns the verdict in numbers and sentences."""
    decision, options = outcome.judged, outcome.options
    weight = options.area_weight
    uncertainty = None if weight is None else deviation_of(weight) / weight.middle
    has = filmed(options.calibration.flag, uncertainty)
    effects = outcome.weighing.effects
    names = tuple(dict.fromkeys(effects[number].column.effect for number in decision.named))
    acting = outcome.best if decision.named else None
    rest = [
        number for number in np.argsort(-decision.probability) if number not in decision.confident
    ]
    comparisons = compare_models(
        outcome.recordings,
        outcome.halves,
        outcome.sights,
        effect=None if acting is None else acting[0],
        control=effects[rest[0]] if rest and acting is not None else None,
        area_weight=options.area_weight,
        seed=options.calibration.seed,
    )
    verdict = Verdict(
        conclusion=decision.conclusion,
        named=names,
        words="",
        test=_test(outcome),
        parameters=_parameters(outcome),
        ranking=_ranking(outcome),
        comparisons=comparisons,
        residuals=(),
        provenance={
            "seed": options.calibration.seed,
            "code": code_version(),
            "criteria": json_values(replace(CRITERIA, level=options.level)),
            "options": options.recipe(),
        },
        power=_power(outcome),
        unweighed=tuple(why_unweighed(has).items()),
        copied=tuple(what_copies(has).items()),
        open=decision.open,
        findings=tuple(
            (f.kind, f.what) for f in outcome.findings if f.severity is not Severity.NOTE
        ),
    )
    unseen = [
        effect.column.effect
        for effect, errors in zip(effects, outcome.sensitivity.tolist(), strict=True)
        if errors < SEEN
    ]
    return state_verdict(
        verdict,
        outcome.recordings,
        has_weight=options.area_weight is not None,
        unseen=tuple(dict.fromkeys(unseen)),
        departing=tuple(
            departure for departure in outcome.departures if abs(departure.deviations) >= SEEN
        ),
    )


def _test(outcome: SolvedLoop) -> NullTest:
    scored, level, suspected = (
        outcome.judged.scored,
        outcome.options.level,
        outcome.options.suspected,
    )
    nulls, statistic = scored.nulls, scored.statistic
    low, high = nulls.interval(statistic, level=CRITERIA.interval)
    return NullTest(
        statistic=statistic,
        null=nulls.null.tolist(),
        kinds=nulls.count,
        level=level,
        p_value=Quantity.of(
            value=scored.p_value, low=low, high=high, unit="1", level=CRITERIA.interval
        ),
        critical=nulls.critical(level),
        open=low <= level <= high,
        settling=nulls.settling(statistic, at=level, level=CRITERIA.interval)
        if low <= level <= high
        else None,
        effective=nulls.effective,
        correlation=nulls.correlation,
        tail=nulls.tail(statistic),
        suspected="" if suspected is None else suspected.words,
        nulls=f"{len(nulls.null)} flags of {nulls.count} meshes and methods in the same minutes of "
        "wind, over "
        "the priors of cloth, view and anemometer",
    )


def _power(outcome: SolvedLoop) -> tuple[Power, ...]:
    """Lists the power for each effect, the surest first."""
    effects, power = outcome.weighing.effects, outcome.judged.scored.power
    return tuple(
        Power(
            effect=effects[number].column.effect,
            parameter=effects[number].column.parameter,
            strength=expected_strength(outcome.sights, effects[number]),
            unit=effects[number].column.unit,
            share=float(power[number]),
        )
        for number in np.argsort(-power, kind="stable").tolist()
    )


def _parameters(outcome: SolvedLoop) -> tuple[Parameter, ...]:
    """Estimates area weight, bending and damping, of the base model and with the effect."""
    before = _cloths(outcome, None, outcome.base)
    after = None
    if outcome.judged.named and outcome.best is not None:
        after = _cloths(outcome, *outcome.best)
    parameters = []
    for number, quantity in enumerate(CLOTH):
        later = None if after is None else after[number]
        parameters.append(
            Parameter(
                name=quantity.name,
                before=before[number][0],
                after=None if later is None else later[0],
                shift=None
                if later is None
                else (later[0].point - before[number][0].point) / before[number][1],
            )
        )
    return tuple(parameters)


def _cloths(
    outcome: SolvedLoop, effect: Weighable | None, fit: Fit
) -> list[tuple[Quantity, float]]:
    cloth, _, _ = hypothesis(outcome.sights, effect).values(fit.scores[0])
    return [_marginal(cloth[quantity.name], fit.weights[0], quantity.unit) for quantity in CLOTH]


def _marginal(values: FloatArray, weights: FloatArray, unit: str) -> tuple[Quantity, float]:
    tail = (1 - CRITERIA.interval) / 2
    low, middle, high = quantiles(values, weights, (tail, 0.5, 1 - tail))
    mean = float(weights @ values)
    sigma = float(np.sqrt(weights @ np.square(values - mean)))
    return Quantity.of(value=middle, low=low, high=high, unit=unit, level=CRITERIA.interval), sigma


def strength_of(effect: Weighable, fit: Fit) -> Quantity:
    """Estimates a strength, its interval widened by what meshes and cloths do to effects, as on
    trajectories; a bound where the posterior leans on an end of what is assumed of it
    (`measure.posterior_ends`)."""
    shares = ndtr(fit.scores[0][:, -1])  # the last coordinate
    strengths, factor = (
        effect.prior.at(shares),
        float(np.exp(CRITERIA.reach * CRITERIA.strength_factor)),
    )
    marginal, _ = _marginal(strengths, fit.weights[0], effect.column.unit)
    if (bound := _bound(effect, strengths, shares, fit.weights[0], factor=factor)) is not None:
        return bound
    value, size, null = marginal.point, abs(marginal.point), effect.column.described.null
    inward, outward = size * (1 - 1 / factor), size * (factor - 1)
    below, above = (inward, outward) if value > 0 else (outward, inward)
    return Quantity.of(
        value=null + value,
        low=null + value - float(np.hypot(below, value - marginal.low)),
        high=null + value + float(np.hypot(above, marginal.high - value)),
        unit=marginal.unit,
        level=marginal.level,
    )


def _bound(
    effect: Weighable,
    strengths: FloatArray,
    shares: FloatArray,
    weights: FloatArray,
    *,
    factor: float,
) -> Quantity | None:
    """Returns a strength that is known on one side only; None of one with two ends.

    Args:
        strengths, shares: (n,) of it beyond null, and their places in its prior, of importance
            samples.
        weights: (n,) of them, of sum 1.
        factor: factor by which a strength may be off.
    """
    even = (np.arange(_EVEN) + 0.5) / _EVEN
    drawn = np.minimum(np.searchsorted(np.cumsum(weights), even), len(weights) - 1)
    interval = span(
        strengths[drawn],
        shares[drawn],
        level=CRITERIA.interval,
        limits=(0.0, np.inf) if effect.low > 0 else (-np.inf, np.inf),
        assumed=(effect.low, effect.high),
    )
    if interval.bound is None:
        return None
    least = interval.bound is Bound.LEAST
    end = (
        interval.high
        if interval.bound is Bound.MOST
        else interval.low
        if least
        else float(np.median(strengths[drawn]))
    )
    # A bound gives way by the factor: upwards where it is one from above, and towards zero where it
    # holds a size.
    wider = end / factor if (end > 0) == least else end * factor
    null = effect.column.described.null
    ends = {Bound.LEAST: (wider, interval.high), Bound.MOST: (interval.low, wider)}.get(
        interval.bound, (interval.low, interval.high)
    )
    return Quantity.of(
        value=null + (end if interval.bound is Bound.NOTHING else wider),
        low=null + ends[0],
        high=null + ends[1],
        unit=effect.column.unit,
        level=interval.level,
        bound=interval.bound,
    )


def _ranking(outcome: SolvedLoop) -> tuple[Candidate, ...]:
    decision, weighing = outcome.judged, outcome.weighing
    experiment = of_recordings(outcome.sights, outcome.recordings, outcome.options.area_weight)
    candidates = []
    for number in np.argsort(-decision.probability).tolist():
        effect = weighing.effects[number]
        fit = fit_model(outcome.sights, experiment, effect, seed=outcome.options.calibration.seed)
        candidates.append(
            Candidate(
                effect=effect.column.effect,
                parameter=effect.column.parameter,
                strength=strength_of(effect, fit),
                z=float(decision.scored.z[number]),
                p_value=float(decision.scored.alone[number]),
                p_family=float(decision.scored.family[number]),
                gain=float(weighing.factors[0, number]),
                gain_error=float("nan"),
                behind=0.0,
                leftover=float(decision.leftover[number]),
                null=effect.column.described.null,
                probability=float(decision.probability[number]),
                why_not=_why_not(outcome, number),
            )
        )
    return tuple(candidates)


def _why_not(outcome: SolvedLoop, index: int) -> str:
    decision = outcome.judged
    if index in decision.named:
        return ""
    if decision.conclusion in NOT_REJECTED:
        return "the base model is not rejected"
    if decision.leftover[index] <= outcome.options.level:
        return "what remains with it is larger than in null experiments"
    if index in decision.confident:
        return "another effect explains more"
    return f"its probability is {decision.probability[index]:.1g}, given that one effect is missing"
