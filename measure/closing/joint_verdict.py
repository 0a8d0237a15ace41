"""One answer from recordings of markers and films of one cloth.

Each kind is judged by itself, at half of the level. The joint p is twice the smaller one
(Bonferroni), which holds
however the two depend on each other: both are recordings of one cloth, and their nulls are of like
numerics. So the base model is rejected at the level where one kind rejects it at its half.

Each kind that rejects leaves a set of effects that may be missing; the joint set is what is in all
of them. A kind that does not reject excludes none.

Strengths and the cloth are products of the two likelihoods, normal in the logarithm. What both
kinds are wrong about in the same way, a strength's error by the models' meshes
(`CRITERIA.strength_factor`), counts once and is not averaged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from flagdata.answer import Quantity
from measure.verdict.criteria import CRITERIA
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.quantity import estimate_text, known, number, probability, with_level
from measure.verdict.verdict_record import Conclusion, Verdict

_CERTAIN = 0.02
"""Least standard error of a logarithm: no kind knows more."""


@dataclass(frozen=True, kw_only=True)
class Combined:
    """A quantity by both kinds of recordings.

    Attributes:
        name: of it.
        markers, films: by each; None where it was not found.
        together: by both; None where neither found it.
        apart: standard errors by which the two differ; None where one of them is missing.
    """

    name: str
    markers: Quantity | None
    films: Quantity | None
    together: Quantity | None
    apart: float | None


@dataclass(frozen=True, kw_only=True)
class Joint:
    """The answer.

    Attributes:
        conclusion: of both.
        named: effects that may be missing.
        p_value: of the base model.
        level: of the test.
        strengths: of what was named, effect by effect.
        cloth: area weight, bending and damping: by the base models, and with the one effect that
            both name.
        markers, films: the verdicts of each kind, at half of the level.
    """

    JSON_NAMES: ClassVar = (
        "conclusion",
        "named",
        "words",
        "p_value",
        "level",
        "strengths",
        "cloth",
    )

    conclusion: Conclusion
    named: tuple[str, ...]
    p_value: float
    level: float
    strengths: tuple[Combined, ...]
    cloth: tuple[Combined, ...]
    markers: Verdict
    films: Verdict

    @property
    def words(self) -> str:
        """The answer in sentences."""
        return " ".join(_sentences(self))


def join_verdicts(
    markers: Verdict, films: Verdict, *, level: float, nominal: Mapping[str, float]
) -> Joint:
    """Joins the verdicts on each kind to one answer.

    Args:
        markers, films: at half of the level.
        level: of the joint test.
        nominal: area_weight [kg/m²] and bending [N·m] of the cloth, to which markers give the
            ratio.
    """
    verdicts = (markers, films)
    tested = [verdict for verdict in verdicts if verdict.conclusion is not Conclusion.UNTESTED]
    rejecting = [verdict for verdict in tested if verdict.conclusion not in NOT_REJECTED]
    effects = tuple(
        name
        for name in (rejecting[0].named if rejecting else ())
        if all(name in verdict.named for verdict in rejecting)
    )
    p = min([1.0, *(len(verdicts) * verdict.test.p_value.point for verdict in tested)])
    strengths = [_strength(name, markers, films) for name in effects]
    return Joint(
        conclusion=_conclusion(tested, rejecting, effects),
        named=effects,
        p_value=p,
        level=level,
        strengths=tuple(strengths),
        cloth=_cloth(markers, films, nominal),
        markers=markers,
        films=films,
    )


def _conclusion(
    tested: Sequence[Verdict], rejecting: Sequence[Verdict], effects: Sequence[str]
) -> Conclusion:
    if not tested:
        return Conclusion.UNTESTED
    if not rejecting:
        open_ones = any(verdict.conclusion is Conclusion.UNDECIDED for verdict in tested)
        return Conclusion.UNDECIDED if open_ones else Conclusion.SUFFICIENT
    if not effects:
        return Conclusion.OUTSIDE
    if any(verdict.conclusion is Conclusion.PARTLY for verdict in rejecting):
        return Conclusion.PARTLY
    return Conclusion.EFFECT if len(effects) == 1 else Conclusion.ONE_OF


def _strength(effect: str, markers: Verdict, films: Verdict) -> Combined:
    candidates = [
        next((candidate for candidate in verdict.ranking if candidate.effect == effect), None)
        for verdict in (markers, films)
    ]
    return _multiply_likelihoods(
        effect,
        *((None if candidate is None else candidate.strength) for candidate in candidates),
        shared=CRITERIA.strength_factor,
        null=next((candidate.null for candidate in candidates if candidate is not None), 0.0),
    )


def _cloth(markers: Verdict, films: Verdict, nominal: Mapping[str, float]) -> tuple[Combined, ...]:
    """Combines the cloth's quantities by the base models, and with the effect where both name the
    same one alone."""
    same_effect = markers.named == films.named and len(films.named) == 1
    combined = []
    for moment in ("before", *(["after"] if same_effect else [])):
        for parameter in films.parameters:
            of_markers = next(
                (candidate for candidate in markers.parameters if candidate.name == parameter.name),
                None,
            )
            by_markers = None if of_markers is None else getattr(of_markers, moment)
            factor = nominal.get(parameter.name, 1.0)
            of_films: Quantity | None = getattr(parameter, moment)
            if by_markers is not None and of_films is not None:
                by_markers = _times(by_markers, factor, of_films.unit)
            label = parameter.name.replace("_", " ")
            label = (
                f"{label}, base model" if moment == "before" else f"{label}, with {films.named[0]}"
            )
            combined.append(_multiply_likelihoods(label, by_markers, of_films))
    return tuple(combined)


def _times(estimate: Quantity, factor: float, unit: str) -> Quantity:
    return Quantity.of(
        value=estimate.point * factor,
        low=estimate.low * factor,
        high=estimate.high * factor,
        unit=unit,
        level=estimate.level,
    )


def _multiply_likelihoods(
    name: str,
    markers: Quantity | None,
    films: Quantity | None,
    *,
    shared: float = 0.0,
    null: float = 0.0,
) -> Combined:
    """Multiplies two likelihoods in the logarithm of the distance from a null value.

    What an interval that reaches the null value says is not combined: it is an upper limit.

    Args:
        shared: standard deviation of the logarithm that both have in common.
    """
    usable = [
        estimate
        for estimate in (markers, films)
        if estimate is not None and known(estimate) and _is_one_sided(estimate, null)
    ]
    if len(usable) < 2:
        only = (
            usable[0]
            if usable
            else next((estimate for estimate in (films, markers) if known(estimate)), None)
        )
        return Combined(name=name, markers=markers, films=films, together=only, apart=None)
    first, second = usable
    if (first.point - null) * (second.point - null) < 0:
        return Combined(name=name, markers=markers, films=films, together=None, apart=math.inf)
    means, variances = zip(*(_logarithm(estimate, null) for estimate in usable), strict=True)
    own_variances = [max(variance - shared**2, _CERTAIN**2) for variance in variances]
    mean = sum(m / v for m, v in zip(means, own_variances, strict=True)) / sum(
        1 / v for v in own_variances
    )
    sigma = math.sqrt(1 / sum(1 / v for v in own_variances) + shared**2)
    ends = [math.exp(mean + side * CRITERIA.reach * sigma) for side in (-1, 0, 1)]
    sign = 1 if first.point > null else -1
    low, value, high = sorted(null + sign * end for end in ends)
    return Combined(
        name=name,
        markers=markers,
        films=films,
        apart=abs(means[0] - means[1]) / math.sqrt(sum(own_variances)),
        together=Quantity.of(
            value=value, low=low, high=high, unit=second.unit, level=CRITERIA.interval
        ),
    )


def _is_one_sided(estimate: Quantity, null: float) -> bool:
    """Returns whether an interval is finite and on one side of the null value."""
    return (
        math.isfinite(estimate.low)
        and math.isfinite(estimate.high)
        and (estimate.low > null or estimate.high < null)
    )


def _logarithm(estimate: Quantity, null: float) -> tuple[float, float]:
    """Computes mean and variance of the logarithm of the distance from the null value."""
    ends = sorted(math.log(abs(end - null)) for end in (estimate.low, estimate.high))
    return math.log(abs(estimate.point - null)), ((ends[1] - ends[0]) / (2 * CRITERIA.reach)) ** 2


def _sentences(joint: Joint) -> list[str]:
    p_values = ", ".join(
        f"p = {probability(verdict.test.p_value.point)} by {kind}"
        for kind, verdict in (("markers", joint.markers), ("films", joint.films))
    )
    test = (
        f"joint p = {probability(joint.p_value)}, twice the smaller of two ({p_values}), at a "
        f"level of {joint.level:g}"
    )
    if joint.conclusion is Conclusion.UNTESTED:
        return [
            f"Neither kind of recordings can test the base model at half of the level ({test})."
        ]
    if joint.conclusion is Conclusion.SUFFICIENT:
        return [
            (
                f"The base model is not rejected by markers and films together ({test}): no effect "
                "is "
                "needed."
            )
        ]
    if joint.conclusion is Conclusion.UNDECIDED:
        why = "; ".join(
            reason for verdict in (joint.markers, joint.films) for reason in verdict.open
        )
        return [
            (
                "Nothing is decided: the base model is not rejected by markers and films together "
                f"({test}), but {why}."
            )
        ]
    sentences = [f"The base model is rejected by markers and films together ({test})."]
    if joint.conclusion is Conclusion.OUTSIDE:
        sentences.append("No effect of the library explains what both kinds of recordings show.")
    elif joint.conclusion is Conclusion.ONE_OF:
        sentences.append(
            f"One of {', '.join(joint.named)} explains what both show; they do not decide which."
        )
    elif joint.conclusion is Conclusion.PARTLY:
        sentences.append(f"It is partly explained by {joint.named[0]}.")
    else:
        sentences.append(f"It lacks {joint.named[0]}.")
    for strength in joint.strengths:
        if strength.together is not None:
            sentences.append(
                f"Strength of {strength.name} by both: {with_level(strength.together)}."
            )
        if strength.apart is not None and strength.apart > CRITERIA.lead:
            sentences.append(
                f"The two kinds disagree about it: {estimate_text(strength.markers)} by markers "
                "and "
                f"{estimate_text(strength.films)} by films, {number(strength.apart, digits=2)} "
                "standard errors apart."
            )
    return sentences
