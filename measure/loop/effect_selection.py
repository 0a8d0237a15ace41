"""Which effect it is: models of the library compared by what they predict on recordings they were
not fitted to.

Detection is by the directed test, and so is the order of the effects. Attribution is one rule.
Models whose held-out scores do not differ significantly from the best are the confidence set (after
Hansen, Lunde and Nason, Econometrica 79:453, 2011). Of these, recordings do not separate those
whose directed scores are within one deviation of the largest. The verdict is those of them with
which, free, the same test points at no other effect. The base model and forces that are none of the
library compete like any other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.calibrated_parameters import THETA
from measure.forecasting.regressors import TURNED, EffectColumn, columns, names
from measure.inference.fluctuation import fluctuation, fluctuation_gains
from measure.inference.segment_evidence import Evidence, gains
from measure.loop.refit import Refit
from measure.loop.set_up import HOIST, SetUp, beyond_tolerance, wind_turn
from measure.loop.strength_estimates import (
    estimate,
    heterogeneity,
    heterogeneous,
    strength,
    strengths_by_recording,
)
from measure.loop.validation import total_error
from measure.loop.weighed_effects import Weighed, best_by_gain, lag_behind, rank_candidates
from measure.nulls.directed_test import Sought
from measure.nulls.null_groups import GUSTS
from measure.nulls.reference import BaseModelTest, Reference
from measure.probes.lines import SpectralLine
from measure.probes.wind_course import ALONG, Variation
from measure.verdict.criteria import CRITERIA
from measure.verdict.decided import undecided_sentences
from measure.verdict.quantity import number
from measure.verdict.verdict_record import Candidate, Conclusion
from sim.effects import EFFECTS

GUST_COLUMN = -1
"""Stands for gusts, which are no column: only their size can be found, not their course."""
_FIRST = len(THETA)


def equivalent(effect: str, strength: Quantity) -> tuple[str, ...]:
    """Effects that no recording of this kind can distinguish from a weighed one: holes in the cloth
    scale the dynamic pressure as the air's density does, but only lower it."""
    return ("porosity",) if effect == "air-density" and strength.point < 0 else ()


@dataclass(frozen=True, kw_only=True, eq=False)
class LibraryJudgement:
    """What was decided.

    Attributes:
        conclusion: see `Conclusion`.
        named: columns of the effects named.
        ranking: candidates, best first, each with the reason why it was not named.
        confident: columns of the models of the library in the confidence set, best first; empty
            where the base model or none of the library is as good as they are.
        test: of the base model.
        line: of the errors' spectra that the first of the ranking leaves, where nulls hardly have
            such a one.
        course: how the wind varies, by the errors that the first leaves, where it does not so in
            nulls and it is not turbulence.
        direction: by how much the wind is turned from where its logs have it, counter-clockwise
            [rad]; None in still air.
        departed: columns of what the recordings show of the set-up against what was declared.
        power: of each effect that is tested for, at its expected strength.
        open: why the base model is neither rejected nor said to suffice, sentences; empty where it
            is.
    """

    conclusion: Conclusion
    named: tuple[int, ...]
    ranking: tuple[Weighed, ...]
    confident: tuple[int, ...]
    test: BaseModelTest
    line: SpectralLine | None = None
    course: Variation | None = None
    direction: Quantity | None = None
    departed: tuple[int, ...] = ()
    power: tuple[tuple[Sought, float], ...] = ()
    open: tuple[str, ...] = ()


def judge(
    evidence: Evidence,
    reference: Reference,
    *,
    level: float,
    refits: Mapping[int, Refit | None] | None = None,
    set_up: SetUp | None = None,
) -> LibraryJudgement:
    """Weighs the library against the evidence of all recordings.

    Args:
        level: of the global test.
        refits: of columns whose models were refitted, which count in place of the linear evidence;
            None for a cloth that diverged.
        set_up: what recordings may show of it; what they show leads the verdict, whatever the test
            says.
    """
    refitted = refits or {}
    tested, statistics = reference.test(evidence), reference.statistics(evidence)
    p_value, power = tested.p, reference.power(tested, level)
    effects = [(i + _FIRST, c) for i, c in enumerate(columns()) if isinstance(c, EffectColumn)]
    # Nothing is known along an effect that the cloth cannot have as it is held.
    effects = [(i, c) for i, c in effects if evidence.curvature[:, i, i].sum() > 0]
    held_out = gains(evidence, [[i] for i, _ in effects])
    candidates = [
        _weigh(
            evidence,
            reference,
            tested,
            column,
            effect,
            linear,
            float(statistics[column]),
            refitted.get(column),
            lost=refitted.get(column, 0) is None,
        )
        for (column, effect), linear in zip(effects, held_out, strict=True)
    ]
    direction, declared = wind_turn(evidence, reference), set_up or SetUp()
    beyond = beyond_tolerance(direction, declared.tolerance)
    if direction is not None:
        turned_column = names().index(TURNED)
        candidates = [
            _within(w, direction, declared.tolerance) if w.column == turned_column else w
            for w in candidates
        ]
    ranking = rank_candidates([*candidates, _gusts(evidence, reference, tested)])
    departing = {
        names().index(name)
        for name, declared_otherwise in ((TURNED, beyond), (HOIST, declared.attached))
        if declared_otherwise
    }
    departed = [w for w in ranking if w.column in departing]
    confident = _confidence_set(ranking, evidence)
    first = refitted.get((departed or ranking)[0].column)
    remaining = evidence if first is None else first.evidence

    def judgement(
        conclusion: Conclusion,
        accepted: Sequence[Weighed],
        why: str = "",
        reasons: tuple[str, ...] = (),
    ) -> LibraryJudgement:
        taken = {w.column for w in accepted}
        reasoned = [
            replace(
                w,
                candidate=replace(
                    w.candidate,
                    why_not=_reason(best_by_gain(ranking), w, why) * (w.column not in taken),
                ),
            )
            for w in ranking
        ]
        return LibraryJudgement(
            conclusion=conclusion,
            named=tuple(w.column for w in accepted),
            ranking=tuple(reasoned),
            confident=tuple(w.column for w in confident),
            test=tested,
            line=reference.line(remaining, level),
            course=_blown(remaining, reference, level),
            direction=direction,
            departed=tuple(w.column for w in departed),
            power=power,
            open=reasons,
        )

    if not reference.tests(level):
        return judgement(
            Conclusion.UNTESTED, (), "there are too few kinds of numerics to test the base model"
        )
    least = reference.passing(CRITERIA.passing)
    if departed:
        rest = (
            "the recordings show that the set-up is another than the declared one, and nothing "
            "else is needed"
        )
        columns_shown = [w.column for w in departed]
        if len(departed) == 1 and first is not None:
            explained = first.leftover > least
        else:
            explained = reference.p_beside(remaining, columns_shown) > least
        if explained:
            return judgement(Conclusion.EFFECT, departed, rest)
        if len(departed) > 1:
            return judgement(Conclusion.PARTLY, departed)
        return judgement(*_beside(remaining, reference, departed[0], ranking, level))
    if p_value > level:
        why, shares = "the base model is not rejected", [share for _, share in power]
        reasons = undecided_sentences(
            p_value, level=level, departure=_departure(evidence, reference), power=shares
        )
        return judgement(
            Conclusion.UNDECIDED if reasons else Conclusion.SUFFICIENT, (), why, reasons
        )
    if reference.suspected is not None:
        column = reference.suspected[0]
        alike = [w for w in confident or ranking if w.column == column and w.admissible]
    else:
        alike = _alike(confident, tested, level)
    passing = [w for w in alike if w.passes(least, level)]
    if passing:
        return judgement(Conclusion.EFFECT if len(passing) == 1 else Conclusion.ONE_OF, passing)
    conclusion, accepted = (
        _beside(remaining, reference, alike[0], ranking, level)
        if alike
        else (Conclusion.OUTSIDE, [])
    )
    if conclusion is Conclusion.EFFECT:
        return judgement(conclusion, accepted)
    pulsating = _pulsating(remaining, reference, ranking, level)
    if pulsating is not None and (pulsating.candidate.leftover > least or not alike):
        ranking = [pulsating if w.column == GUST_COLUMN else w for w in ranking]
        return judgement(
            Conclusion.EFFECT if pulsating.candidate.leftover > least else Conclusion.PARTLY,
            [pulsating],
        )
    return judgement(conclusion, accepted)


def _alike(confident: Sequence[Weighed], tested: BaseModelTest, level: float) -> list[Weighed]:
    """Selects those of the confidence set whose scores recordings do not separate from the
    largest, that first; none where that is no larger than nulls' at a level, and something else
    rejects the base model."""
    close = _close_to_first(confident)
    return [] if not close or tested.null.p(close[0].score) > level else close


def _close_to_first(candidates: Sequence[Weighed]) -> list[Weighed]:
    """Selects those whose scores are within `Criteria.alike_scores` of the largest, that first."""
    ordered = sorted(candidates, key=lambda w: -w.score)
    return [w for w in ordered if w.score >= ordered[0].score - CRITERIA.alike_scores]


def _departure(evidence: Evidence, reference: Reference) -> float:
    """Computes the root mean square departure of what recordings settle at from the base model run
    freely, in nulls' scatters; 0 where it is not looked at."""
    settles = reference.settles(evidence)
    return 0.0 if settles is None else float(np.sqrt(np.square(settles).mean()))


def _within(turned_wind: Weighed, direction: Quantity, tolerance: float) -> Weighed:
    """Describes the turned wind as it was measured; no effect where the log's tolerance allows for
    it."""
    inside = tolerance > 0 and not beyond_tolerance(direction, tolerance)
    low, high, allowed = (
        number(math.degrees(v), digits=2) for v in (direction.low, direction.high, tolerance)
    )
    unlike = (
        f"the wind is turned by {low}° to {high}° from its log, which {allowed}° of tolerance "
        "allow for"
    )
    return replace(
        turned_wind,
        measured=direction,
        admissible=turned_wind.admissible and not inside,
        unlike=unlike if inside else "",
        candidate=replace(turned_wind.candidate, strength=direction),
    )


def withdrawn(judgement: LibraryJudgement) -> LibraryJudgement:
    """Withdraws the effects that were named: with those that were, or of several that may act with
    the first, errors on unseen recordings are larger than without."""
    worse = "errors on unseen recordings are larger than without"
    tried = judgement.named if judgement.conclusion is Conclusion.EFFECT else judgement.named[:1]
    why = dict.fromkeys(tried, f"with it, {worse}")
    why |= {
        c: f"with the first of those that may act, {worse}" for c in judgement.named if c not in why
    }
    ranking = tuple(
        replace(w, candidate=replace(w.candidate, why_not=why[w.column])) if w.column in why else w
        for w in judgement.ranking
    )
    return replace(judgement, conclusion=Conclusion.OUTSIDE, named=(), ranking=ranking)


def _confidence_set(ranking: Sequence[Weighed], evidence: Evidence) -> list[Weighed]:
    """Selects models of the library whose held-out scores do not differ significantly from the
    best, best first; none where the base model, which gains nothing, is among them, or where a
    force that is none of the library leads them all."""
    able = [w for w in ranking if w.admissible]
    forces = gains(
        evidence, [[i + _FIRST] for i, c in enumerate(columns()) if not isinstance(c, EffectColumn)]
    )
    scores = [*(w.gains for w in able), *forces]
    best = max(scores, key=lambda scores_of_model: scores_of_model.sum())
    if not _leads(best, np.zeros_like(best), evidence.recording):
        return []
    return [
        w
        for w in able
        if not _leads(best, w.gains, evidence.recording) and _leads(w.gains, 0 * best, w.recording)
    ]


def _leads(first: FloatArray, second: FloatArray, recording: IntArray) -> bool:
    """Returns whether held-out scores (segment,) are better by more than `Criteria.lead` standard
    errors of the difference."""
    return bool((first - second).sum() > CRITERIA.lead * total_error(first - second, recording))


def _varying(evidence: Evidence) -> Variation | None:
    """Estimates from the errors how the wind varies. None where its course is not asked for."""
    return None if evidence.course is None else evidence.course.variation(evidence.recording)


def _blown(evidence: Evidence, reference: Reference, level: float) -> Variation | None:
    """Estimates how the wind varies by the remaining errors, where it does not so in all but a
    share `level` of nulls and it is not turbulence."""
    p, variation = reference.p_of_course(evidence), _varying(evidence)
    if p is None or variation is None or variation.turbulent:
        return None
    return variation if p <= level else None


def _pulsating(
    evidence: Evidence, reference: Reference, ranking: Sequence[Weighed], level: float
) -> Weighed | None:
    """Finds gusts by the course of a wind that varies along itself alone, as it does not in nulls:
    what varies within segments is not found by how the pressure differs between them. None where
    the wind does not vary so."""
    variation = _blown(evidence, reference, level)
    if variation is None or not variation.alone:
        return None
    (gusts,) = (w for w in ranking if w.column == GUST_COLUMN)
    intensities = [
        _intensity(evidence.select(evidence.recording == index))
        for index in np.unique(evidence.recording)
    ]
    error = (
        float(np.std(intensities, ddof=1) / math.sqrt(len(intensities)))
        if len(intensities) > 1
        else 0.0
    )
    intensity = estimate(_intensity(evidence), error, gusts.candidate.strength.unit)
    return replace(
        gusts,
        admissible=True,
        unlike="",
        measured=intensity,
        candidate=replace(gusts.candidate, strength=intensity),
    )


def _intensity(evidence: Evidence) -> float:
    """Computes the standard deviation of the wind along itself, as a share of its mean, by its
    course."""
    variation = _varying(evidence)
    return 0.0 if variation is None else math.sqrt(max(float(variation.total[ALONG]), 0.0))


def finalists(judgement: LibraryJudgement) -> tuple[int, ...]:
    """Columns that are refitted: the first by directed scores and by held-out gains, and those of
    the confidence set that recordings do not separate from its first."""
    able = [w for w in judgement.ranking if w.admissible and w.column != GUST_COLUMN]
    by_gain = sorted(able, key=lambda w: -w.gains.sum())
    first = (*able[: CRITERIA.refitted], *by_gain[: CRITERIA.refitted])
    close = _close_to_first([w for w in judgement.ranking if w.column in judgement.confident])
    chosen = dict.fromkeys([*judgement.departed, *(w.column for w in (*first, *close))])
    return tuple(column for column in chosen if column != GUST_COLUMN)


def _beside(
    evidence: Evidence,
    reference: Reference,
    first: Weighed,
    ranking: Sequence[Weighed],
    level: float,
) -> tuple[Conclusion, list[Weighed]]:
    """Concludes what an effect that does not pass its predictive test explains: with another to
    which that points, both, if the pair predicts better than the first alone and passes; a part, if
    it predicts better and does not pass, or the strength differs between recordings. Where no pair
    predicts better, what remains is no effect of the library, and the first is named alone.

    Beside gusts, the pressure is free in every segment.

    Args:
        evidence: of what the first leaves, if it was refitted.
    """
    pressure, gusty = names().index(GUSTS), first.column == GUST_COLUMN
    fitted, least = ([] if gusty else [first.column]), reference.passing(CRITERIA.passing)
    pointed = reference.pointed_at(evidence, fitted, least)
    beside = evidence.freed(pressure) if gusty else evidence
    leads = False
    for column in pointed:
        second = next((w for w in ranking if w.column == column), None)
        if second is None or (gusty and column == pressure):
            continue
        pair = [*fitted, column]
        alone, both = gains(beside, [fitted, pair])
        if not _leads(both, alone, evidence.recording):
            continue
        leads = True
        value, _ = beside.fit(pair).of(column)
        described = EFFECTS[second.candidate.effect].parameters()[second.candidate.parameter]
        constant = all(
            _homogeneous_beside(beside, pair, w, level) for w in (first, second) if w.column in pair
        )
        if (
            described.admits(described.null + value)
            and constant
            and reference.p_beside(evidence, pair) > least
        ):
            return Conclusion.EFFECT, [first, second]
    whole = not leads and not heterogeneous(first.candidate, level)
    return Conclusion.EFFECT if whole else Conclusion.PARTLY, [first]


def _homogeneous_beside(
    evidence: Evidence, chosen: Sequence[int], candidate: Weighed, level: float
) -> bool:
    """Returns whether a strength is the same in all recordings, where some columns are fitted to
    each."""
    p = heterogeneity(
        strengths_by_recording(
            evidence,
            chosen,
            candidate.column,
            about=0.0,
            larger=_larger(evidence, candidate),
            unit="1",
        )
    )
    return p is None or p > level


def _larger(evidence: Evidence, candidate: Weighed) -> float:
    """Computes by how much a strength's standard error is larger than Σ says when it is fitted
    alone."""
    return candidate.error / evidence.fit([candidate.column]).of(candidate.column)[1]


def _weigh(
    evidence: Evidence,
    reference: Reference,
    tested: BaseModelTest,
    column: int,
    effect: EffectColumn,
    linear: FloatArray,
    share: float,
    refitted: Refit | None,
    *,
    lost: bool,
) -> Weighed:
    fit = evidence.fit([column])
    value, _ = fit.of(column)
    # The standard error is that which makes the nulls' mean squared z 1.
    error = abs(value) / math.sqrt(max(share, 1e-12))
    gained, leftover = (
        linear,
        refitted.leftover if refitted else reference.p_beside(evidence, [column]),
    )
    score, alone = tested.score(effect.name), tested.alone(effect.name)
    remaining, null = evidence, effect.described.null
    if refitted is not None:
        gained, value, remaining = refitted.gains, refitted.coefficient, refitted.evidence
    about = null + (value if refitted else 0.0)
    larger = error / fit.of(column)[1]
    bounded = (
        None
        if refitted is None or refitted.profile is None
        else refitted.profile.estimate(larger=larger)
    )
    # Where all strengths beyond a bound do the same, slopes at one of them say nothing of those of
    # single recordings.
    by_recording = (
        ()
        if bounded is not None
        else strengths_by_recording(
            remaining, [column], column, about=about, larger=larger, unit=effect.unit
        )
    )
    return Weighed(
        column=column,
        error=error,
        score=score,
        gains=gained,
        recording=evidence.recording,
        admissible=effect.described.admits(null + value) and not lost,
        candidate=Candidate(
            effect=effect.effect,
            parameter=effect.parameter,
            null=null,
            strength=bounded or strength(null, value, error, effect.unit),
            z=score,
            p_value=alone,
            p_family=tested.null.p(score),
            gain=float(gained.sum()),
            gain_error=total_error(gained, evidence.recording),
            behind=0.0,
            leftover=leftover,
            by_recording=by_recording,
            heterogeneity=heterogeneity(by_recording),
        ),
    )


def _gusts(evidence: Evidence, reference: Reference, tested: BaseModelTest) -> Weighed:
    """Weighs gusts, whose course is unknown: a pressure that fluctuates from segment to segment, by
    twice their intensity; their score is that of the wind's course."""
    score, alone = tested.course, reference.p_of_course(evidence)
    pressure = names().index(GUSTS)
    gusts, gained = fluctuation(evidence, pressure), fluctuation_gains(evidence, pressure)
    described = EFFECTS["gusts"].parameters()["intensity"]
    variation = _varying(evidence)
    unlike = "" if variation is None or variation.turbulent or variation.alone else variation.words
    by_recording = []
    for index in np.unique(evidence.recording):
        in_recording = fluctuation(evidence.select(evidence.recording == index), pressure)
        by_recording.append(
            estimate(in_recording.deviation / 2, in_recording.error / 2, described.unit)
        )
    return Weighed(
        column=GUST_COLUMN,
        score=-math.inf if score is None else score,
        gains=gained,
        recording=evidence.recording,
        error=gusts.error / 2,
        admissible=bool(gusts.deviation > CRITERIA.reach * gusts.error) and not unlike,
        unlike=unlike,
        candidate=Candidate(
            effect="gusts",
            parameter="intensity",
            null=described.null,
            strength=strength(described.null, gusts.deviation / 2, gusts.error / 2, described.unit),
            z=math.nan if score is None else score,
            p_value=math.nan if alone is None else alone,
            p_family=1.0 if score is None else tested.null.p(score),
            gain=float(gained.sum()),
            gain_error=total_error(gained, evidence.recording),
            behind=0.0,
            leftover=reference.p_beside(evidence, ()),
            by_recording=tuple(by_recording),
        ),
    )


def _reason(best: Weighed, candidate: Weighed, why: str) -> str:
    if why:
        return why
    if not candidate.admissible and candidate.unlike:
        return candidate.unlike
    if not candidate.admissible and candidate.column == GUST_COLUMN:
        return "their intensity is not significantly above zero"
    if not candidate.admissible:
        strength = candidate.candidate.strength
        unit = "" if strength.unit == "1" else f" {strength.unit}"
        return f"the fitted value is unphysical: {number(strength.point)}{unit}"
    if not _leads(candidate.gains, 0 * candidate.gains, candidate.recording):
        return "it predicts unseen recordings no better than the base model"
    if _leads(best.gains, candidate.gains, candidate.recording):
        return (
            f"{lag_behind(best, candidate):.1f} standard errors behind {best.candidate.effect} on "
            "unseen recordings"
        )
    return (
        "the recordings go farther the way of another effect, another effect acts beside it, or a "
        "force outside the library predicts better"
    )
