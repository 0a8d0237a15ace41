"""Which effect it is: candidates weighed, ranked by what they predict on recordings they were not fitted to, judged.

Detection is by the calibrated statistic, attribution by held-out misfit: the largest statistic often points at the
wrong effect, and cross-validation alone does not control false positives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from measure.loop.bank import columns, names
from measure.loop.columns import THETA, EffectColumn
from measure.loop.comparison import total_error
from measure.loop.course import Variation
from measure.loop.criteria import CRITERIA
from measure.loop.fluctuation import fluctuation, fluctuation_gains
from measure.loop.heterogeneity import heterogeneity
from measure.loop.inference import Evidence, Fit, gains
from measure.loop.lines import Line
from measure.loop.quantity import number
from measure.loop.reference import GUSTS, Reference
from measure.loop.refit import Refit
from measure.loop.verdict import Candidate, Conclusion, Estimate
from sim.effects import EFFECTS
from sim.effects.parameter import Parameter

Floats = NDArray[np.float64]

GUST_COLUMN = -1
"""Stands for gusts, which are no column: only their size can be found, not their course."""
_FIRST = len(THETA)

NO_HELP = "refitted and run on unseen recordings, it does not help more than the wrong-effect control"
NOT_APART = "refitted beyond the linear model, its strength cannot be told from zero"
"""Why an effect named is withdrawn."""
USUAL = "no effect of the library stands out by itself: in nulls one often stands out as much by chance"
FLUCTUATING = "even with it the errors tell of a wind that fluctuates, and not as turbulence does"
SWINGING = "even with it the errors oscillate at a frequency that is proportional to the wind speed"

EQUIVALENT: dict[str, tuple[str, ...]] = {"air-density": ("porosity",)}
"""Effects that no recording of this kind can tell from a weighed one: both scale the dynamic pressure alone."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighed:
    """A candidate with what the decision needs.

    Attributes:
        column: place among the evidence's columns.
        candidate: as reported.
        error: standard error of the strength.
        gains: (segment,) held-out gain.
        recording: (segment,) of each.
        admissible: whether the fitted strength makes physical sense: see `_plausible`.
        unlike: how the wind's course differs from that of turbulence, for gusts; empty where it does not.
    """

    column: int
    candidate: Candidate
    error: float
    gains: Floats
    recording: NDArray[np.int64]
    admissible: bool
    unlike: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """What was decided.

    Attributes:
        conclusion: see `Conclusion`.
        named: columns of the effects named.
        ranking: candidates, best first, each with the reason why it was not named.
        statistic, p_value: of the global test.
        line: of the errors' spectra that the first of the ranking leaves, where it alone would reject the model.
        course: how the wind would vary that leaves such errors, where that is farthest and not turbulence.
    """

    conclusion: Conclusion
    named: tuple[int, ...]
    ranking: tuple[Weighed, ...]
    statistic: float
    p_value: float
    line: Line | None = None
    course: Variation | None = None


def judge(
    evidence: Evidence, reference: Reference, *, level: float, refits: Mapping[int, Refit] | None = None
) -> Judgement:
    """Weigh the library against the evidence of all recordings.

    Args:
        level: of the global test.
        refits: of columns whose models were refitted, which count in place of the linear evidence.
    """
    statistics = reference.statistics(evidence, names())
    statistic, line = reference.farthest(evidence, names()), reference.line(evidence)
    p_value = reference.tail.p(statistic)
    effects = [(i + _FIRST, c) for i, c in enumerate(columns()) if isinstance(c, EffectColumn)]
    corrective = [i + _FIRST for i, c in enumerate(columns()) if not isinstance(c, EffectColumn)]
    held_out = gains(evidence, [[i] for i, _ in effects])
    weighed = [
        _weigh(evidence, reference, column, effect, own, statistics, (refits or {}).get(column))
        for (column, effect), own in zip(effects, held_out, strict=True)
    ]
    ranking = _ranked([*weighed, _gusts(evidence, reference, float(statistics[len(names())]))])
    # An effect that changes how a flag flutters, as lift does, leaves a line too, of which it then takes much away.
    refitted = (refits or {}).get(ranking[0].column)
    left = line if refitted is None else refitted.line
    swings = left is not None and reference.tail.p(left.far) <= level
    blown = _blown(evidence, reference, statistic, level, left=evidence if refitted is None else refitted.evidence)

    def judgement(conclusion: Conclusion, named: Sequence[Weighed], reasons: dict[int, str]) -> Judgement:
        taken = {w.column for w in named}
        told = [
            replace(w, candidate=replace(w.candidate, why_not="" if w.column in taken else reasons.get(w.column, "")))
            for w in ranking
        ]
        return Judgement(
            conclusion=conclusion, named=tuple(w.column for w in named), ranking=tuple(told), statistic=statistic,
            p_value=p_value, line=left if swings else None, course=blown,
        )  # fmt: skip

    if p_value > level:
        return judgement(Conclusion.SUFFICIENT, (), {w.column: "the base model is not rejected" for w in ranking})
    best = ranking[0]
    reasons = {w.column: _reason(best, w) for w in ranking[1:]}
    if not best.admissible or best.gains.sum() <= 0:
        reasons[best.column] = "no effect of the library predicts unseen recordings better than the base model"
        return judgement(Conclusion.OUTSIDE, (), reasons)
    if swings and line is not None and line.far >= statistic:
        reasons[best.column] = SWINGING
        return judgement(Conclusion.OUTSIDE, (), reasons)
    if blown is not None:
        reasons[best.column] = FLUCTUATING
        return judgement(Conclusion.OUTSIDE, (), reasons)
    if best.candidate.p_family > CRITERIA.usual:
        reasons[best.column] = USUAL
        return judgement(Conclusion.OUTSIDE, (), reasons)
    if _field_leads(evidence, best, corrective, statistics, beyond_linear=refitted is not None):
        reasons[best.column] = "a corrective field explains more than any effect of the library"
        return judgement(Conclusion.OUTSIDE, (), reasons)
    near = [w for w in ranking[1:] if w.admissible and _rivals(best, w)]
    enough = min(level, CRITERIA.enough_gusts if best.column == GUST_COLUMN else CRITERIA.enough)
    if best.candidate.leftover > enough and not heterogeneous(best.candidate):
        return judgement(Conclusion.ONE_OF if near else Conclusion.EFFECT, (best, *near), reasons)
    useless = {column for column, run in (refits or {}).items() if run.gains.sum() <= 0}
    others = [w for w in ranking[1:] if w.column not in useless]
    second = _second(
        evidence if refitted is None else refitted.evidence, reference, best, others, enough,
        swinging=refitted is None or refitted.line is not None,
    )  # fmt: skip
    if second is not None:
        return judgement(Conclusion.EFFECT, (best, second), reasons)
    return judgement(Conclusion.PARTLY, (best,), reasons)


def _varying(evidence: Evidence) -> Variation | None:
    """How the wind varies, as the errors tell it; None where its course is not looked at."""
    return None if evidence.course is None else evidence.course.variation(evidence.recording)


def _blown(
    evidence: Evidence, reference: Reference, statistic: float, level: float, *, left: Evidence
) -> Variation | None:
    """How the wind varies, where that is farthest of all, not as turbulence does, and left by the first candidate."""
    swing, variation = reference.swing(left), _varying(evidence)
    if swing is None or variation is None or variation.turbulent:
        return None
    farthest = reference.swing(evidence) == statistic
    return variation if farthest and reference.tail.p(swing) <= level else None


def heterogeneous(candidate: Candidate) -> bool:
    """Whether its strength is another in every recording: another law in the wind would be a better one."""
    return candidate.heterogeneity is not None and candidate.heterogeneity <= CRITERIA.heterogeneous


def _field_leads(
    evidence: Evidence, best: Weighed, corrective: Sequence[int], statistics: Floats, *, beyond_linear: bool
) -> bool:
    """Whether a corrective field says that the library has no answer.

    A pressure that fluctuates pushes steady fields by chance, and a strong effect is far from linear: against gusts,
    and against a model that was refitted, the field must also predict better.
    """
    field = max(corrective, key=lambda column: float(statistics[column]))
    larger = best.candidate.z**2 * CRITERIA.field < float(statistics[field])
    unlike = beyond_linear or best.column == GUST_COLUMN
    return larger and (not unlike or gains(evidence, [[field]]).sum() > best.gains.sum())


def finalists(judgement: Judgement) -> tuple[int, ...]:
    """Columns that are refitted: the first by held-out gains, and the largest statistics."""
    able = [w for w in judgement.ranking if w.admissible and w.column != GUST_COLUMN]
    strongest = sorted(able, key=lambda w: -abs(w.candidate.z))
    return tuple(dict.fromkeys(w.column for w in (*able[: CRITERIA.refitted], *strongest[: CRITERIA.refitted])))


def withdrawn(judgement: Judgement, reason: str) -> Judgement:
    """The same, once the effect named has failed, for `NO_HELP` or `NOT_APART`."""
    ranking = _told(judgement.ranking, judgement.named, reason)
    return replace(judgement, conclusion=Conclusion.OUTSIDE, named=(), ranking=ranking)


def alone(judgement: Judgement, reason: str) -> Judgement:
    """The same, once the second of two effects has failed: the first explains a part."""
    ranking = _told(judgement.ranking, judgement.named[1:], reason)
    return replace(judgement, conclusion=Conclusion.PARTLY, named=judgement.named[:1], ranking=ranking)


def tied(judgement: Judgement, control: Weighed) -> Judgement:
    """The same, once a control has proved as good as the effect named, within errors, on unseen data."""
    ranking = _told(judgement.ranking, (control.column,), "")
    named = (*judgement.named, control.column)
    return replace(judgement, conclusion=Conclusion.ONE_OF, named=named, ranking=ranking)


def _told(ranking: Sequence[Weighed], chosen: Sequence[int], reason: str) -> tuple[Weighed, ...]:
    """The same candidates, those of some columns with another reason why they are not named."""
    return tuple(
        replace(w, candidate=replace(w.candidate, why_not=reason)) if w.column in chosen else w for w in ranking
    )


def _second(
    evidence: Evidence,
    reference: Reference,
    best: Weighed,
    others: Sequence[Weighed],
    level: float,
    *,
    swinging: bool,
) -> Weighed | None:
    """An effect that, beside the best, leaves no more than nulls do, predicts better than the best alone, and whose
    strength is not nothing, both as strong in every recording. Beside gusts, the pressure is free in every segment.

    Args:
        evidence: of what the best leaves, if it was refitted.
        others: candidates beside the best, but for those whose refitted models predict nothing.
        swinging: whether lines of the errors' spectra count.
    """
    pressure = names().index(GUSTS)
    known = [best.column]
    if best.column == GUST_COLUMN:
        evidence, reference, known = evidence.freed(pressure), reference.beside(), []
    skipped = {GUST_COLUMN, *([] if known else [pressure])}
    others = [w for w in others if w.column not in skipped and w.candidate.effect not in CRITERIA.never_second]
    fits = [evidence.fit([*known, w.column]) for w in others]
    able = [
        place
        for place, (w, fit) in enumerate(zip(others, fits, strict=True))
        if _plausible(_described(w), *_beside(evidence, fit, w))
    ]
    if not able:
        return None
    pairs = gains(evidence, [known, *([*known, others[place].column] for place in able)])
    leader = int(np.argmax(pairs[1:].sum(axis=1)))
    chosen, gained = others[able[leader]], pairs[1 + leader] - pairs[0]
    value, error = _beside(evidence, fits[able[leader]], chosen)
    lasting = (
        gained.sum() > CRITERIA.lead * total_error(gained, evidence.recording) and abs(value) > CRITERIA.reach * error
    )
    both = [*known, chosen.column]
    left = reference.p_left_by(evidence, names(), both, swinging=swinging)
    constant = all(_homogeneous_beside(evidence, both, w) for w in (best, chosen) if w.column in both)
    return chosen if lasting and constant and left > level else None


def _homogeneous_beside(evidence: Evidence, chosen: Sequence[int], weighed: Weighed) -> bool:
    """Whether a strength is the same in all recordings, where some columns are fitted to each."""
    found = heterogeneity(
        _each(evidence, chosen, weighed.column, about=0.0, larger=_larger(evidence, weighed), unit="1")
    )
    return found is None or found > CRITERIA.heterogeneous


def _beside(evidence: Evidence, fit: Fit, weighed: Weighed) -> tuple[float, float]:
    """A strength in a joint fit, and its standard error, as much larger than Σ says as when it is fitted alone."""
    value, claimed = fit.of(weighed.column)
    return value, claimed * _larger(evidence, weighed)


def _larger(evidence: Evidence, weighed: Weighed) -> float:
    """By how much a strength's standard error is larger than Σ says when it is fitted alone."""
    return weighed.error / evidence.fit([weighed.column]).of(weighed.column)[1]


def _each(
    evidence: Evidence, chosen: Sequence[int], column: int, *, about: float, larger: float, unit: str
) -> tuple[Estimate, ...]:
    """The strength of a column in each recording alone, where some columns are fitted to it.

    Args:
        about: the strength in the model that the evidence is of.
        larger: by how much its standard errors are larger than Σ says.
    """
    made: list[Estimate] = []
    for index in np.unique(evidence.recording):
        value, claimed = evidence.select(evidence.recording == index).fit(chosen).of(column)
        made.append(estimate(about + value, larger * claimed, unit))
    return tuple(made)


def _described(weighed: Weighed) -> Parameter:
    return EFFECTS[weighed.candidate.effect].parameters()[weighed.candidate.parameter]


def _plausible(described: Parameter, coefficient: float, error: float) -> bool:
    """Whether a strength is admissible, and no more than `Criteria.plausible` times what is expected there."""
    least, most = described.admissible
    expected = described.prior[1 if coefficient > 0 else 0] - described.null
    reach = CRITERIA.plausible * max(math.copysign(1.0, coefficient) * expected, 0.0)
    return least <= described.null + coefficient <= most and abs(coefficient) - CRITERIA.lead * error <= reach


def _weigh(
    evidence: Evidence,
    reference: Reference,
    column: int,
    effect: EffectColumn,
    linear: Floats,
    statistics: Floats,
    refitted: Refit | None,
) -> Weighed:
    fit = evidence.fit([column])
    value, _ = fit.of(column)
    # The standard error is that which makes the nulls' mean squared z 1.
    statistic = float(statistics[column])
    error = abs(value) / math.sqrt(max(statistic, 1e-12))
    z = value / error if error > 0 else 0.0
    gained, leftover = linear, refitted.leftover if refitted else reference.p_left_by(evidence, names(), [column])
    left, null = evidence, effect.described.null
    if refitted is not None:
        gained, value, left = refitted.gains, refitted.coefficient, refitted.evidence
    about = null + (value if refitted else 0.0)
    by_recording = _each(left, [column], column, about=about, larger=error / fit.of(column)[1], unit=effect.unit)
    return Weighed(
        column=column, error=error, gains=gained, recording=evidence.recording,
        admissible=_plausible(effect.described, value, error),
        candidate=Candidate(
            effect=effect.effect, parameter=effect.parameter, null=null,
            strength=strength(null, value, error, effect.unit),
            z=z, p_value=reference.p_alone(statistic, column),
            p_family=reference.p_family(statistic, column), gain=float(gained.sum()),
            gain_error=total_error(gained, evidence.recording), behind=0.0, leftover=leftover,
            by_recording=by_recording, heterogeneity=heterogeneity(by_recording),
        ),
    )  # fmt: skip


def _gusts(evidence: Evidence, reference: Reference, statistic: float) -> Weighed:
    """Gusts, whose course is unknown: a pressure that fluctuates from segment to segment, by twice their intensity."""
    place = names().index(GUSTS)
    found, gained = fluctuation(evidence, place), fluctuation_gains(evidence, place)
    described = EFFECTS["gusts"].parameters()["intensity"]
    variation = _varying(evidence)
    unlike = "" if variation is None or variation.turbulent else variation.words
    by_recording = []
    for index in np.unique(evidence.recording):
        own = fluctuation(evidence.select(evidence.recording == index), place)
        by_recording.append(estimate(own.deviation / 2, own.error / 2, described.unit))
    return Weighed(
        column=GUST_COLUMN, gains=gained, recording=evidence.recording, error=found.error / 2,
        admissible=bool(found.deviation > CRITERIA.reach * found.error) and not unlike, unlike=unlike,
        candidate=Candidate(
            effect="gusts", parameter="intensity", null=described.null,
            strength=strength(described.null, found.deviation / 2, found.error / 2, described.unit),
            z=math.sqrt(statistic), p_value=reference.p_alone(statistic, len(names())),
            p_family=reference.p_family(statistic, len(names())),
            gain=float(gained.sum()), gain_error=total_error(gained, evidence.recording), behind=0.0,
            leftover=reference.beside().p_left_by(evidence.freed(place), names(), ()), by_recording=tuple(by_recording),
        ),
    )  # fmt: skip


def strength(null: float, coefficient: float, error: float, unit: str) -> Estimate:
    """Of an effect, of its coefficient beyond null and the standard error by what nulls leave."""
    return estimate(null + coefficient, math.hypot(error, CRITERIA.response * coefficient), unit)


def estimate(value: float, error: float, unit: str) -> Estimate:
    """A normal interval at the level of all intervals."""
    return Estimate(
        value=value, low=value - CRITERIA.reach * error, high=value + CRITERIA.reach * error, unit=unit,
        level=CRITERIA.interval,
    )  # fmt: skip


def _ranked(weighed: Sequence[Weighed]) -> list[Weighed]:
    """By held-out gain; of those that it cannot tell from the first, the one that fits best leads."""
    ordered = sorted(weighed, key=lambda w: (-w.admissible, -w.gains.sum()))
    tied = [w for w in ordered if w.admissible and w.gains.sum() > 0 and _behind(ordered[0], w) < CRITERIA.tied]
    best = max(tied, key=lambda w: abs(w.candidate.z), default=ordered[0])
    ordered = [best, *(w for w in ordered if w is not best)]
    return [replace(w, candidate=replace(w.candidate, behind=_behind(best, w))) for w in ordered]


def _rivals(best: Weighed, other: Weighed) -> bool:
    """Whether another effect cannot be told from the best: neither by held-out gains nor by how well it fits at all."""
    return (
        other.gains.sum() > 0
        and _behind(best, other) < CRITERIA.lead
        and other.candidate.z**2 > best.candidate.z**2 - CRITERIA.rival**2
    )


def _behind(best: Weighed, other: Weighed) -> float:
    """Standard errors of the paired difference."""
    if other is best or other.column == best.column:
        return 0.0
    difference = best.gains - other.gains
    error = total_error(difference, best.recording)
    return float(difference.sum() / error) if error > 0 else 0.0


def _reason(best: Weighed, other: Weighed) -> str:
    if not other.admissible and other.unlike:
        return other.unlike
    if not other.admissible and other.column == GUST_COLUMN:
        return "their intensity cannot be told from zero"
    if not other.admissible:
        strength = other.candidate.strength
        unit = "" if strength.unit == "1" else f" {strength.unit}"
        return f"its strength would be {number(strength.value)}{unit}, which is not physical"
    if other.gains.sum() <= 0:
        return "it predicts unseen recordings no better than the base model"
    return f"{_behind(best, other):.1f} standard errors behind {best.candidate.effect} on unseen recordings"
