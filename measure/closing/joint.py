"""One answer from recordings of markers and films of one cloth.

Each kind is judged by itself, at half of the level. The joint p is twice the smaller one (Bonferroni), which holds
however the two depend on each other: both are recordings of one cloth, and their nulls are of like numerics. So the
base model is rejected at the level where one kind rejects it at its half.

Each kind that rejects leaves a set of effects that may be missing; the joint set is what is in all of them. A kind that
does not reject excludes none.

Strengths and the cloth are products of the two likelihoods, normal in the logarithm. What both kinds are wrong about in
the same way, a strength's error by the models' meshes (`CRITERIA.strength_factor`), counts once and is not averaged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from measure.verdict.criteria import CRITERIA
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.quantity import estimate_text, known, number, probability, with_level
from measure.verdict.record import Conclusion, Estimate, Verdict

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
    markers: Estimate | None
    films: Estimate | None
    together: Estimate | None
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
        cloth: area weight, bending and damping: by the base models, and with the one effect that both name.
        markers, films: the verdicts of each kind, at half of the level.
    """

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

    def as_dict(self) -> dict[str, Any]:
        """JSON values, without the two verdicts."""
        return {
            "conclusion": self.conclusion.value,
            "named": list(self.named),
            "words": self.words,
            "p_value": self.p_value,
            "level": self.level,
            "strengths": [asdict(one) for one in self.strengths],
            "cloth": [asdict(one) for one in self.cloth],
        }


def joined(markers: Verdict, films: Verdict, *, level: float, nominal: Mapping[str, float]) -> Joint:
    """One answer from the verdicts on each kind.

    Args:
        markers, films: at half of the level.
        level: of the joint test.
        nominal: area_weight [kg/m²] and bending [N·m] of the cloth, to which markers give the ratio.
    """
    both = (markers, films)
    tested = [one for one in both if one.conclusion is not Conclusion.UNTESTED]
    rejecting = [one for one in tested if one.conclusion not in NOT_REJECTED]
    named = tuple(
        name for name in (rejecting[0].named if rejecting else ()) if all(name in one.named for one in rejecting)
    )
    p = min([1.0, *(len(both) * one.test.p_value.value for one in tested)])
    strengths = [_strength(name, markers, films) for name in named]
    return Joint(
        conclusion=_conclusion(tested, rejecting, named),
        named=named,
        p_value=p,
        level=level,
        strengths=tuple(strengths),
        cloth=_cloth(markers, films, nominal),
        markers=markers,
        films=films,
    )


def _conclusion(tested: Sequence[Verdict], rejecting: Sequence[Verdict], named: Sequence[str]) -> Conclusion:
    if not tested:
        return Conclusion.UNTESTED
    if not rejecting:
        open_ones = any(one.conclusion is Conclusion.UNDECIDED for one in tested)
        return Conclusion.UNDECIDED if open_ones else Conclusion.SUFFICIENT
    if not named:
        return Conclusion.OUTSIDE
    if any(one.conclusion is Conclusion.PARTLY for one in rejecting):
        return Conclusion.PARTLY
    return Conclusion.EFFECT if len(named) == 1 else Conclusion.ONE_OF


def _strength(effect: str, markers: Verdict, films: Verdict) -> Combined:
    found = [next((one for one in verdict.ranking if one.effect == effect), None) for verdict in (markers, films)]
    return _combined(
        effect,
        *((None if one is None else one.strength) for one in found),
        shared=CRITERIA.strength_factor,
        null=next((one.null for one in found if one is not None), 0.0),
    )


def _cloth(markers: Verdict, films: Verdict, nominal: Mapping[str, float]) -> tuple[Combined, ...]:
    """By the base models, and with the effect where both name the same one alone."""
    alike = markers.named == films.named and len(films.named) == 1
    made = []
    for moment in ("before", *(["after"] if alike else [])):
        for parameter in films.parameters:
            own = {"area_weight": "density"}.get(parameter.name, parameter.name)
            beside = next((one for one in markers.parameters if one.name == own), None)
            by_markers = None if beside is None else getattr(beside, moment)
            factor = nominal.get(parameter.name, 1.0)
            of_films: Estimate | None = getattr(parameter, moment)
            if by_markers is not None and of_films is not None:
                by_markers = _times(by_markers, factor, of_films.unit)
            label = parameter.name.replace("_", " ")
            label = f"{label}, base model" if moment == "before" else f"{label}, with {films.named[0]}"
            made.append(_combined(label, by_markers, of_films))
    return tuple(made)


def _times(own: Estimate, factor: float, unit: str) -> Estimate:
    return Estimate(value=own.value * factor, low=own.low * factor, high=own.high * factor, unit=unit, level=own.level)


def _combined(
    name: str, markers: Estimate | None, films: Estimate | None, *, shared: float = 0.0, null: float = 0.0
) -> Combined:
    """The product of two likelihoods in the logarithm of the distance from a null value.

    What an interval that reaches the null value says is not combined: it is an upper limit.

    Args:
        shared: standard deviation of the logarithm that both have in common.
    """
    usable = [one for one in (markers, films) if one is not None and known(one) and _sided(one, null)]
    if len(usable) < 2:
        only = usable[0] if usable else next((one for one in (films, markers) if known(one)), None)
        return Combined(name=name, markers=markers, films=films, together=only, apart=None)
    first, second = usable
    if (first.value - null) * (second.value - null) < 0:
        return Combined(name=name, markers=markers, films=films, together=None, apart=math.inf)
    means, variances = zip(*(_logarithm(one, null) for one in usable), strict=True)
    own = [max(variance - shared**2, _CERTAIN**2) for variance in variances]
    mean = sum(m / v for m, v in zip(means, own, strict=True)) / sum(1 / v for v in own)
    sigma = math.sqrt(1 / sum(1 / v for v in own) + shared**2)
    ends = [math.exp(mean + side * CRITERIA.reach * sigma) for side in (-1, 0, 1)]
    sign = 1 if first.value > null else -1
    low, value, high = sorted(null + sign * end for end in ends)
    return Combined(
        name=name,
        markers=markers,
        films=films,
        apart=abs(means[0] - means[1]) / math.sqrt(sum(own)),
        together=Estimate(value=value, low=low, high=high, unit=second.unit, level=CRITERIA.interval),
    )


def _sided(one: Estimate, null: float) -> bool:
    """Whether an interval is finite and on one side of the null value."""
    return math.isfinite(one.low) and math.isfinite(one.high) and (one.low > null or one.high < null)


def _logarithm(one: Estimate, null: float) -> tuple[float, float]:
    """Mean and variance of the logarithm of the distance from the null value."""
    ends = sorted(math.log(abs(end - null)) for end in (one.low, one.high))
    return math.log(abs(one.value - null)), ((ends[1] - ends[0]) / (2 * CRITERIA.reach)) ** 2


def _sentences(joint: Joint) -> list[str]:
    each = ", ".join(
        f"p = {probability(one.test.p_value.value)} by {what}"
        for what, one in (("markers", joint.markers), ("films", joint.films))
    )
    test = f"joint p = {probability(joint.p_value)}, twice the smaller of two ({each}), at a level of {joint.level:g}"
    if joint.conclusion is Conclusion.UNTESTED:
        return [f"Neither kind of recordings can test the base model at half of the level ({test})."]
    if joint.conclusion is Conclusion.SUFFICIENT:
        return [f"The base model is not rejected by markers and films together ({test}): no effect is needed."]
    if joint.conclusion is Conclusion.UNDECIDED:
        why = "; ".join(reason for one in (joint.markers, joint.films) for reason in one.open)
        return [
            f"Nothing is decided: the base model is not rejected by markers and films together ({test}), but {why}."
        ]
    said = [f"The base model is rejected by markers and films together ({test})."]
    if joint.conclusion is Conclusion.OUTSIDE:
        said.append("No effect of the library explains what both kinds of recordings show.")
    elif joint.conclusion is Conclusion.ONE_OF:
        said.append(f"One of {', '.join(joint.named)} explains what both show; they do not decide which.")
    elif joint.conclusion is Conclusion.PARTLY:
        said.append(f"It is partly explained by {joint.named[0]}.")
    else:
        said.append(f"It lacks {joint.named[0]}.")
    for one in joint.strengths:
        if one.together is not None:
            said.append(f"Strength of {one.name} by both: {with_level(one.together)}.")
        if one.apart is not None and one.apart > CRITERIA.lead:
            said.append(
                f"The two kinds disagree about it: {estimate_text(one.markers)} by markers and "
                f"{estimate_text(one.films)} by films, {number(one.apart, digits=2)} standard errors apart."
            )
    return said
