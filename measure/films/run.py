"""Closing the loop on films with logs of the wind: recordings in, a verdict in numbers and sentences out.

    verdict = close_loop(recordings, Options(calibration=...), folder=..., workers=2)

`recordings` are `measure.calibrate.observed.Observed`, of a film (`measure.calibrate.filmed`), of a table of
observables, or built directly; `calibration` are the options of `flagdata calibrate`. Simulations are kept in the
folder by their design: a run that was interrupted goes on, and a second one simulates nothing.

What recordings can show: how far each effect moves them, beyond what cloth, view and anemometer can imitate.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr

from flagdata.arrays import FloatArray
from flagdata.errors import InputError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.provenance import code_version
from measure.calibrate.calibrate import Options as Calibrating
from measure.calibrate.observed import Observed, constant_wind
from measure.calibrate.prior import CLOTH
from measure.calibrate.scatter import TAKEN_APART
from measure.ends import Bound, span
from measure.films.departures import Departure, departures, root_mean_square
from measure.films.evidence import Experiments, Fit, Sight, quantiles
from measure.films.judge import Judged, judge
from measure.films.library import Weighable, weighable
from measure.films.score_test import score
from measure.films.simulations import Simulations, gathered, of_base, of_nulls, of_recordings, shown_by
from measure.films.statement import stated
from measure.films.unseen import compared
from measure.films.weigh import Weighing, directions, expected, fitted, hypothesis, misfits, weigh
from measure.forecasting.setting import Stage
from measure.forecasting.strengths import Suspicion
from measure.verdict.criteria import CRITERIA
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.record import Candidate, Estimate, NullTest, Parameter, Power, Verdict

STRONG = 0.9
"""Share of the prior of strengths at which an effect counts as strong."""
SEEN = 2.0
"""Standard errors below which even a strong effect is not seen."""
_DIFFERENCE = 1e-3


def sensitivity(sights: Sequence[Sight], effects: Sequence[Weighable], base: Fit, observed: Experiments) -> FloatArray:
    """(effect,) standard errors by which the strong effect moves the summaries, what a change of cloth, view and
    anemometer makes up for left out.

    Args:
        base: the base model fitted to the recordings, about whose cloth and view it is found.
        observed: the recordings.
    """
    own = hypothesis(sights, None)
    at = base.weights[:1] @ base.scores[0]
    moved = np.concatenate([at, at + _DIFFERENCE * np.eye(at.shape[1])])
    mean, _, weight = own.predicted(moved)
    off = observed.repeated(len(moved)).off(weight)
    slopes = np.concatenate([own.scatter.white @ (mean[1:] - mean[0]).T, (off[1:] - off[0])[None]]) / _DIFFERENCE
    # What the prior lets them make up for: ridge regression on slopes, the scores' prior being standard normal.
    left = np.eye(len(slopes)) - slopes @ np.linalg.solve(slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T)
    cloth, places, _ = own.values(at)
    found = []
    for effect in effects:
        strength = effect.prior.at(np.array([STRONG]))
        parts = []
        for sight, place in zip(sights, places, strict=True):
            with_it, _ = sight.model.predict({**cloth, **place}, effect.name, strength)
            without, _ = sight.model.predict({**cloth, **place})
            parts.append((with_it - without)[0])
        column = np.concatenate([own.scatter.white @ np.concatenate(parts), [0.0]])
        found.append(float(np.sqrt(column @ left @ column)))
    return np.array(found)


_EVEN = 1000
"""Draws of a posterior that are taken evenly from importance samples."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """How the loop is closed.

    Attributes:
        calibration: the flag, its view, the number of simulations and the seed, as for `flagdata calibrate`.
        area_weight: mean and standard deviation of a cloth that was weighed [kg/m²]; None for the prior of all cloths.
        level: of the test.
        kinds: of numerics among null experiments.
        only: names of the effects that are weighed; empty for all.
        suspected: the effect with its sign that was suspected before the recordings were looked at, along which alone
            is looked; None to look along all.

    Raises:
        UsageError: a level or number that makes no sense, or an effect that is not weighed.
    """

    calibration: Calibrating
    area_weight: tuple[float, float] | None = None
    level: float = CRITERIA.level
    kinds: int = CRITERIA.film_kinds
    only: tuple[str, ...] = ()
    suspected: Suspicion | None = None

    def __post_init__(self) -> None:
        if not 0 < self.level < 1 or self.kinds < CRITERIA.fewest_kinds:
            raise UsageError(
                f"{self.kinds} kinds of numerics cannot test at a level of {self.level!r}",
                where="close-loop",
                fix=f"give a level between 0 and 1, and {CRITERIA.fewest_kinds} kinds or more",
            )
        known = [one.name for one in weighable(self.calibration.flag)]
        if unknown := set(self.only) - set(known):
            raise UsageError(f"{', '.join(sorted(unknown))}: not weighed on films", fix=f"give {', '.join(known)}")

    @property
    def effects(self) -> tuple[Weighable, ...]:
        """That are weighed."""
        return tuple(one for one in weighable(self.calibration.flag) if not self.only or one.name in self.only)

    def recipe(self) -> dict[str, Any]:
        """JSON values."""
        return {
            **self.calibration.recipe(),
            "area_weight": None if self.area_weight is None else list(self.area_weight),
            "test_level": self.level,
            "kinds": self.kinds,
            "only": list(self.only),
            "suspected": None if self.suspected is None else self.suspected.words,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """All that a verdict was made from.

    Attributes:
        options, recordings, simulations, sights: what went in.
        weighing: of the recordings.
        judged: what was decided.
        base: the base model fitted to the recordings.
        best: the most probable effect's model fitted to them; None where nothing was weighed.
        departures: of the observables from the base model, the farthest first.
        sensitivity: (effect,) standard errors by which each moves the recordings where it is strong.
        together: whether what is unknown of the cloth was taken as the same in all recordings.
        left_out: a warning for each recording whose simulations do not show what it shows.
    """

    options: Options
    recordings: tuple[Observed, ...]
    simulations: Simulations
    sights: tuple[Sight, ...]
    weighing: Weighing
    judged: Judged
    base: Fit
    best: tuple[Weighable, Fit] | None
    departures: tuple[Departure, ...]
    sensitivity: FloatArray
    together: bool
    left_out: tuple[Finding, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """On the recordings."""
        own = (finding for one in self.recordings for finding in one.findings)
        apart = [] if self.together else [TAKEN_APART]
        return (*self.left_out, *constant_wind(self.recordings), *own, *apart)


def close_loop(
    recordings: Sequence[Observed],
    options: Options,
    *,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> Verdict:
    """The verdict on recordings of one flag.

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


def solve(
    recordings: Sequence[Observed],
    options: Options,
    *,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> Outcome:
    """What a verdict is made from; as `close_loop`."""
    if not recordings:
        raise InputError("no recordings", where="close-loop", fix="give one or more")
    effects, seed = options.effects, options.calibration.seed
    simulations = gathered(
        recordings, options.calibration, effects, kinds=options.kinds, folder=folder, workers=workers, stage=stage
    )
    recordings, simulations, sights, left_out = shown_by(recordings, simulations)
    effects = tuple(one for one in effects if all(one.name in own.model.responses for own in sights))
    null, kinds = of_nulls(sights, recordings, simulations, options.area_weight, seed=seed)
    model = of_base(sights, recordings, simulations, options.area_weight, seed=seed)
    seen = of_recordings(sights, recordings, options.area_weight)
    scored = score(seen, model, null, kinds, directions(sights, effects, options.suspected), level=options.level)
    base = fitted(sights, seen, None, seed=seed)
    departing = departures(recordings, sights, base)
    own = weigh(sights, seen, effects, seed=seed)
    judged = judge(
        own, misfits(sights, null, effects), kinds, scored, level=options.level, departure=root_mean_square(departing)
    )
    best = None
    if effects:
        first = effects[judged.confident[0]]
        best = first, fitted(sights, seen, first, seed=seed)
    return Outcome(
        options=options,
        recordings=recordings,
        left_out=left_out,
        simulations=simulations,
        sights=sights,
        weighing=own,
        judged=judged,
        base=base,
        best=best,
        departures=departing,
        sensitivity=sensitivity(sights, effects, base, seen),
        together=hypothesis(sights, None).scatter.together,
    )


def verdict_of(outcome: Outcome) -> Verdict:
    """The verdict in numbers and sentences."""
    judged, options = outcome.judged, outcome.options
    effects = outcome.weighing.effects
    named = tuple(dict.fromkeys(effects[place].column.effect for place in judged.named))
    acting = outcome.best if judged.named else None
    others = [place for place in np.argsort(-judged.probability) if place not in judged.confident]
    comparisons = compared(
        outcome.recordings,
        outcome.simulations,
        outcome.sights,
        effect=None if acting is None else acting[0],
        control=effects[others[0]] if others and acting is not None else None,
        weighed=options.area_weight,
        seed=options.calibration.seed,
    )
    verdict = Verdict(
        conclusion=judged.conclusion,
        named=named,
        words="",
        test=_test(outcome),
        parameters=_parameters(outcome),
        ranking=_ranking(outcome),
        comparisons=comparisons,
        residuals=(),
        provenance={
            "seed": options.calibration.seed,
            "code": code_version(),
            "criteria": CRITERIA.as_dict(),
            "options": options.recipe(),
        },
        power=_power(outcome),
        open=judged.open,
        findings=tuple((f.kind, f.what) for f in outcome.findings if f.severity is not Severity.NOTE),
    )
    unseen = [
        one.column.effect for one, errors in zip(effects, outcome.sensitivity.tolist(), strict=True) if errors < SEEN
    ]
    return stated(
        verdict,
        outcome.recordings,
        weighed=options.area_weight is not None,
        unseen=tuple(dict.fromkeys(unseen)),
        departing=tuple(one for one in outcome.departures if abs(one.deviations) >= SEEN),
    )


def _test(outcome: Outcome) -> NullTest:
    scored, level, suspected = outcome.judged.scored, outcome.options.level, outcome.options.suspected
    nulls, statistic = scored.nulls, scored.statistic
    low, high = nulls.interval(statistic, level=CRITERIA.interval)
    return NullTest(
        statistic=statistic,
        null=nulls.null.tolist(),
        kinds=nulls.count,
        level=level,
        p_value=Estimate(value=scored.p_value, low=low, high=high, unit="1", level=CRITERIA.interval),
        critical=nulls.critical(level),
        open=low <= level <= high,
        settling=nulls.settling(statistic, at=level, level=CRITERIA.interval) if low <= level <= high else None,
        effective=nulls.effective,
        correlation=nulls.correlation,
        tail=nulls.tail(statistic),
        suspected="" if suspected is None else suspected.words,
        nulls=f"{len(nulls.null)} flags of {nulls.count} meshes and methods in the same minutes of wind, over "
        "the priors of cloth, view and anemometer",
    )


def _power(outcome: Outcome) -> tuple[Power, ...]:
    """Of each effect, the surest first."""
    effects, power = outcome.weighing.effects, outcome.judged.scored.power
    return tuple(
        Power(
            effect=effects[place].column.effect,
            parameter=effects[place].column.parameter,
            strength=expected(outcome.sights, effects[place]),
            unit=effects[place].column.unit,
            share=float(power[place]),
        )
        for place in np.argsort(-power, kind="stable").tolist()
    )


def _parameters(outcome: Outcome) -> tuple[Parameter, ...]:
    """Area weight, bending and damping, of the base model and with the effect."""
    before = _cloths(outcome, None, outcome.base)
    after = None
    if outcome.judged.named and outcome.best is not None:
        after = _cloths(outcome, *outcome.best)
    made = []
    for place, one in enumerate(CLOTH):
        later = None if after is None else after[place]
        made.append(
            Parameter(
                name=one.name,
                before=before[place][0],
                after=None if later is None else later[0],
                shift=None if later is None else (later[0].value - before[place][0].value) / before[place][1],
            )
        )
    return tuple(made)


def _cloths(outcome: Outcome, effect: Weighable | None, fit: Fit) -> list[tuple[Estimate, float]]:
    own, _, _ = hypothesis(outcome.sights, effect).values(fit.scores[0])
    return [_marginal(own[one.name], fit.weights[0], one.unit) for one in CLOTH]


def _marginal(values: FloatArray, weights: FloatArray, unit: str) -> tuple[Estimate, float]:
    tail = (1 - CRITERIA.interval) / 2
    low, middle, high = quantiles(values, weights, (tail, 0.5, 1 - tail))
    mean = float(weights @ values)
    sigma = float(np.sqrt(weights @ np.square(values - mean)))
    return Estimate(value=middle, low=low, high=high, unit=unit, level=CRITERIA.interval), sigma


def strength_of(effect: Weighable, fit: Fit) -> Estimate:
    """A strength, its interval widened by what meshes and cloths do to effects, as on trajectories; a bound where the
    posterior leans on an end of what is assumed of it (`measure.ends`)."""
    shares = ndtr(fit.scores[0][:, -1])  # the last coordinate
    strengths, whole = effect.prior.at(shares), float(np.exp(CRITERIA.reach * CRITERIA.strength_factor))
    found, _ = _marginal(strengths, fit.weights[0], effect.column.unit)
    if (bound := _bound(effect, strengths, shares, fit.weights[0], whole=whole)) is not None:
        return bound
    value, size, null = found.value, abs(found.value), effect.column.described.null
    inward, outward = size * (1 - 1 / whole), size * (whole - 1)
    below, above = (inward, outward) if value > 0 else (outward, inward)
    return Estimate(
        value=null + value,
        low=null + value - float(np.hypot(below, value - found.low)),
        high=null + value + float(np.hypot(above, found.high - value)),
        unit=found.unit,
        level=found.level,
    )


def _bound(
    effect: Weighable, strengths: FloatArray, shares: FloatArray, weights: FloatArray, *, whole: float
) -> Estimate | None:
    """A strength that is known on one side only; None of one with two ends.

    Args:
        strengths, shares: (n,) of it beyond null, and their places in its prior, of importance samples.
        weights: (n,) of them, of sum 1.
        whole: factor by which a strength may be off.
    """
    even = (np.arange(_EVEN) + 0.5) / _EVEN
    drawn = np.minimum(np.searchsorted(np.cumsum(weights), even), len(weights) - 1)
    found = span(
        strengths[drawn],
        shares[drawn],
        level=CRITERIA.interval,
        limits=(0.0, np.inf) if effect.low > 0 else (-np.inf, np.inf),
        assumed=(effect.low, effect.high),
    )
    if found.bound is None:
        return None
    least = found.bound is Bound.LEAST
    end = found.high if found.bound is Bound.MOST else found.low if least else float(np.median(strengths[drawn]))
    # A bound gives way by the factor: upwards where it is one from above, and towards zero where it holds a size.
    wider = end / whole if (end > 0) == least else end * whole
    null = effect.column.described.null
    ends = {Bound.LEAST: (wider, found.high), Bound.MOST: (found.low, wider)}.get(found.bound, (found.low, found.high))
    return Estimate(
        value=null + (end if found.bound is Bound.NOTHING else wider),
        low=null + ends[0],
        high=null + ends[1],
        unit=effect.column.unit,
        level=found.level,
        bound=found.bound.value,
    )


def _ranking(outcome: Outcome) -> tuple[Candidate, ...]:
    judged, own = outcome.judged, outcome.weighing
    seen = of_recordings(outcome.sights, outcome.recordings, outcome.options.area_weight)
    made = []
    for place in np.argsort(-judged.probability).tolist():
        effect = own.effects[place]
        fit = fitted(outcome.sights, seen, effect, seed=outcome.options.calibration.seed)
        made.append(
            Candidate(
                effect=effect.column.effect,
                parameter=effect.column.parameter,
                strength=strength_of(effect, fit),
                z=float(judged.scored.z[place]),
                p_value=float(judged.scored.alone[place]),
                p_family=float(judged.scored.family[place]),
                gain=float(own.factors[0, place]),
                gain_error=float("nan"),
                behind=0.0,
                leftover=float(judged.leftover[place]),
                null=effect.column.described.null,
                probability=float(judged.probability[place]),
                why_not=_why_not(outcome, place),
            )
        )
    return tuple(made)


def _why_not(outcome: Outcome, place: int) -> str:
    judged = outcome.judged
    if place in judged.named:
        return ""
    if judged.conclusion in NOT_REJECTED:
        return "the base model is not rejected"
    if judged.leftover[place] <= outcome.options.level:
        return "what remains with it is larger than in null experiments"
    if place in judged.confident:
        return "another effect explains more"
    return f"its probability is {judged.probability[place]:.1g}, given that one effect is missing"
