"""The verdict's first sentence, of markers and of films: what was found, how large it is, how
strong the evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flagdata.answer import Bound, Quantity
from measure.loop.strength_estimates import heterogeneous
from measure.report.verdict_sentences import (
    candidate_title,
    contradicting_findings,
    erring_text,
    heading,
    join_strengths,
    list_names,
    named_candidates,
    readable,
    shorten_list,
)
from measure.verdict.decided import erring
from measure.verdict.quantity import (
    estimate_parts,
    known,
    level_text,
    number,
    probability,
    with_level,
)
from measure.verdict.verdict_record import Candidate, Conclusion, NullTest, Verdict

_EVIDENCE = ((0.001, "very strong"), (0.01, "strong"), (0.05, "moderate"), (0.1, "weak"))
"""Largest p → the word for the evidence (Muff, Nilsen, O'Hara and Nater, Trends in Ecology &
Evolution 37, 2022)."""
_NONE = "little or no"


def lead(verdict: Verdict) -> str:
    """Writes the verdict's first sentence."""
    if verdict.conclusion is Conclusion.UNTESTED:
        test = verdict.test
        return (
            f"The base model cannot be tested at level {test.level:g}: with {test.kinds} numerical "
            "set-ups no p is "
            f"below {probability(test.least)}; at least {test.kinds_needed} are needed."
        )
    if verdict.conclusion is Conclusion.SUFFICIENT and contradicting_findings(verdict):
        return f"{heading(verdict)}."
    p = f"p = {probability(verdict.test.p_value.point)}"
    if verdict.conclusion is Conclusion.UNDECIDED:
        return _add_remainder(
            f"Nothing is decided: the base model is not rejected, {p}, but "
            f"{'; '.join(verdict.open)}",
            verdict,
        )
    if verdict.conclusion is Conclusion.SUFFICIENT:
        does = "is not rejected" if erring(verdict) else "explains these recordings"
        return _add_remainder(
            f"The base model {does}, no effect is needed; {evidence(verdict.test)} that anything "
            f"is missing, {p}",
            verdict,
        )
    return _add_remainder(f"{_what_was_found(verdict)}; {_strength(verdict)}", verdict)


def spoken(verdict: Verdict) -> str:
    """Writes the verdict in a sentence of fewer than 25 words that can be said aloud."""
    p = f"p = {probability(verdict.test.p_value.point)}"
    match verdict.conclusion:
        case Conclusion.UNTESTED:
            return (
                "The base model cannot be tested: there are too few numerical set-ups for the "
                "level."
            )
        case Conclusion.SUFFICIENT if contradicting_findings(verdict):
            return "The set-up is not as declared, so that this verdict does not count."
        case Conclusion.SUFFICIENT if erring(verdict):
            return f"No effect is needed: the base model is not rejected ({p})."
        case Conclusion.SUFFICIENT:
            return f"No effect is needed: the base model explains these recordings ({p})."
        case Conclusion.UNDECIDED:
            return (
                f"Nothing is decided: the base model is not rejected ({p}), and not shown to "
                "suffice."
            )
        case Conclusion.OUTSIDE:
            return f"Something is missing that no effect of the library explains ({p})."
        case _ if not verdict.named:
            return f"Something is missing that the library explains in part at most ({p})."
        case Conclusion.ONE_OF:
            names = shorten_list([_spoken_name(name) for name in verdict.named])
            either = " or ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
            return f"Something was missing: {either}; these recordings do not decide which."
        case conclusion:
            names = list_names(shorten_list([_spoken_name(name) for name in verdict.named]))
            explains = "explain" if len(verdict.named) > 1 else "explains"
            does = {
                Conclusion.PARTLY: f"{'removes' if erring(verdict) else explains} a part of it",
                Conclusion.EFFECT: "fits best" if erring(verdict) else f"{explains} it",
            }[conclusion]
            return f"Something was missing: {names} {does}{_spoken_strength(verdict)}."


def _spoken_name(effect: str) -> str:
    return effect.replace("-", " ")


def _spoken_strength(verdict: Verdict) -> str:
    """Writes the strength of the one that is named, as a person says it; empty where several are,
    or it is not known."""
    named = named_candidates(verdict)
    if len(verdict.named) != 1 or len(named) != 1:
        return ""
    return say_strength(readable(named[0].parameter), named[0].strength)


def say_strength(name: str, strength: Quantity) -> str:
    """Writes "; its coefficient is 0.62 (0.54 to 0.70, 90 %)"; empty where it is not known."""
    if not known(strength) or strength.bound is Bound.NOTHING:
        return ""
    value, ends = estimate_parts(strength)
    interval = f"{ends.strip('[]').replace(', ', ' to ')}, " if ends else ""
    return f"; its {name} is {value} ({interval}{level_text(strength.level)})"


def _add_remainder(sentence: str, verdict: Verdict) -> str:
    """Adds where the model that is offered errs, if it does by more than may be called
    explained."""
    return ". ".join([sentence, *([text] if (text := erring_text(verdict)) else [])]) + "."


def evidence(test: NullTest) -> str:
    """Words a p, as "moderate evidence": the words for a p."""
    word = next((word for most, word in _EVIDENCE if test.p_value.point <= most), _NONE)
    return f"{word} evidence"


def p_text(test: NullTest) -> str:
    """Writes "p = 0.024, could be up to 0.07": with the upper end of the interval that the number
    of nulls leaves."""
    p = test.p_value
    text = f"p = {probability(p.point)}"
    return f"{text}, could be up to {probability(p.high)}" if p.high > p.point else text


def explained_words(verdict: Verdict) -> str:
    """Words the explained part, as "33 % of the error that a better model could remove", on data
    that neither model was fitted to.

    Of squared errors, each comparison in units of the base model's, those of all that lie above the
    floor together. Where none does, of the whole error. Empty where no error after is known.
    """
    compared = [
        c for c in verdict.comparisons if known(c.after) and known(c.before) and c.before.point > 0
    ]
    above = [
        c for c in compared if c.share is not None and not math.isnan(c.share) and known(c.floor)
    ]
    removed = sum(1 - (c.after.point / c.before.point) ** 2 for c in above or compared)
    if compared and removed <= 0:
        return "none of the error on unseen data"
    if above:
        most = sum(1 - (c.floor.point / c.before.point) ** 2 for c in above)
        return (
            f"{number(100 * removed / most, digits=2)} % of the error that a better model could "
            "remove"
        )
    return (
        f"{number(100 * removed / len(compared), digits=2)} % of the squared error"
        if compared
        else ""
    )


def _what_was_found(verdict: Verdict) -> str:
    """Writes what was found, without the evidence."""
    if verdict.conclusion is Conclusion.OUTSIDE or not verdict.named:
        return "The base model lacks something that no effect of the library explains"
    effects = _by_effect(named_candidates(verdict) or [c for c in verdict.ranking if not c.why_not])
    share_explained = explained_words(verdict)
    explains = "removes" if erring(verdict) else "explains"
    if verdict.conclusion is Conclusion.ONE_OF:
        either = " or ".join(shorten_list([_strength_words(verdict, effect) for effect in effects]))
        does = (
            f"{explains} {share_explained}"
            if share_explained
            else f"{explains} what the base model lacks"
        )
        return (
            f"Adding {'one of ' if len(effects) > 1 else ''}{either} {does}; these recordings do "
            "not decide which"
        )
    added = list_names([_strength_words(verdict, effect) for effect in effects])
    if verdict.conclusion is Conclusion.PARTLY:
        does = (
            f"{explains} {share_explained}, not all that is missing"
            if share_explained
            else f"{explains} a part of what is missing"
        )
        return f"Adding {added} {does}: {_incomplete(verdict)}"
    return f"Adding {added} {explains} {share_explained or 'what the base model lacks'}"


def _by_effect(candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    """Groups candidates by effect: several strengths of it are one effect."""
    by_effect: dict[str, list[Candidate]] = {}
    for candidate in candidates:
        by_effect.setdefault(candidate.effect, []).append(candidate)
    return list(by_effect.values())


def _strength_words(verdict: Verdict, candidates: Sequence[Candidate]) -> str:
    """Names an effect with its strength, or its strengths."""
    if len(candidates) > 1:
        strengths = [
            f"{readable(candidate.parameter)} {with_level(candidate.strength)}"
            for candidate in candidates
        ]
        return f"{candidates[0].effect} ({join_strengths(strengths, verdict)})"
    (candidate,) = candidates
    several = sum(c.effect == candidate.effect for c in verdict.ranking) > 1
    parameter = "" if several else f"{readable(candidate.parameter)} "
    return f"{candidate_title(verdict, candidate)} ({parameter}{with_level(candidate.strength)})"


def _strength(verdict: Verdict) -> str:
    test = verdict.test
    if test.p_value.point > test.level:
        return (
            f"the set-up is not as declared, and what is left of it is not rejected, {p_text(test)}"
        )
    return f"{evidence(test)} that something was missing, {p_text(test)}"


def _incomplete(verdict: Verdict) -> str:
    """Explains why what is named is not enough."""
    for candidate in verdict.ranking:
        if not candidate.why_not and heterogeneous(candidate, verdict.test.level):
            strengths = ", ".join(number(s.point, digits=2) for s in candidate.by_recording)
            unit = "" if candidate.strength.unit == "1" else f" {candidate.strength.unit}"
            return (
                f"fitted to each recording alone it is {strengths}{unit}, which differs by more "
                "than chance, so that "
                "another dependence on the wind would fit better"
            )
    if verdict.test.directed is not None:
        return "what remains goes the way of another effect, and both do not explain it either"
    return "the errors that remain are larger than those of simulations"
