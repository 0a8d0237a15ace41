"""What every form of the report says in the same words: the conclusion, the test, what the columns mean."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from measure.verdict.quantity import estimate_text, known, level_text, number, probability
from measure.verdict.record import Candidate, Conclusion, Estimate, NullTest, Verdict


def heading(verdict: Verdict) -> str:
    """The conclusion in one line."""
    named = listed(titles(verdict))
    partly = f"the base model lacked {named}, and something more" if verdict.named else "something is still missing"
    return {
        Conclusion.UNTESTED: "The base model cannot be tested: there are too few kinds of nulls for the level",
        Conclusion.SUFFICIENT: "No effect needed: the base model explains these recordings",
        Conclusion.EFFECT: f"The base model lacked {named}",
        Conclusion.ONE_OF: f"The base model lacked one of {named}: these recordings do not decide which",
        Conclusion.PARTLY: f"Partly explained: {partly}",
        Conclusion.OUTSIDE: "The base model lacks something that no effect of the library explains",
    }[verdict.conclusion]


def listed(names: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names) or "an unnamed effect"


def after_label(verdict: Verdict) -> str:
    """What the columns "after" are of."""
    if verdict.conclusion in (Conclusion.UNTESTED, Conclusion.SUFFICIENT):
        return "with an effect"
    if not verdict.named:
        return "with the corrective field"
    if verdict.conclusion is Conclusion.ONE_OF:
        return f"with the best of {listed(titles(verdict))}"
    return f"with {listed(titles(verdict))}"


def test_sentence(test: NullTest) -> str:
    """The global test with its p-value, the interval that the number of nulls leaves it, and what it says."""
    null = [v for v in test.null if math.isfinite(v)]
    p = test.p_value
    says = "is rejected" if p.value <= test.level else "is not rejected"
    if test.critical is None:
        says = "cannot be tested"
    interval = f"[{probability(p.low)}, {probability(p.high)}] {level_text(p.level)}"
    return (
        f"The base model {says}: p = {probability(p.value)} {interval} at level {test.level:g}. {as_large(test)} of "
        f"{len(null)} groups of nulls reach the observed statistic {number(test.statistic)}. p counts the "
        f"{test.kinds} kinds of numerics that the nulls are of, each by the share of its groups, and the data as one "
        "more; the interval is that of the share of all kinds, by how many were simulated."
    )


def test_remark(test: NullTest) -> str:
    """What limits the test; empty where nothing does."""
    if test.critical is None:
        return (
            f"With {test.kinds} kinds of numerics no p-value below {probability(1 / (1 + test.kinds))} is possible, so "
            f"that the test could not have rejected the base model at level {test.level:g}."
        )
    if test.p_value.value > test.level:
        return "An effect that is too weak to show in these recordings may still act."
    return ""


def as_large(test: NullTest) -> int:
    """How many nulls are at least as large as the observed statistic."""
    return sum(1 for v in test.null if math.isfinite(v) and v >= test.statistic)


def control_warnings(verdict: Verdict) -> list[str]:
    """Where the wrong effect helps as much as the named one, or hardly less: one sentence each."""
    found = []
    for c in verdict.comparisons:
        if c.apart is None or not known(c.apart):
            continue
        if c.apart.value <= 0:
            what = f"the control {c.control_name} does as well as the named effect, so that the attribution fails there"
            found.append(f"{_begun(c.what)}: {what}.")
        elif c.apart.low <= 0:
            found.append(f"{_begun(c.what)}: the control {c.control_name} and the named effect fit equally well there.")
    return found


def control_summary(verdict: Verdict) -> str:
    """The wrong-effect control over all that was left out, in a sentence; empty where none was run."""
    apart = verdict.apart
    if apart is None or not known(apart):
        return ""
    control = next((c.control_name for c in verdict.comparisons if c.control_name), "the best wrong effect")
    line = "the named effect does better" if apart.low > 0 else "the two fit equally well"
    return (
        f"With {control} instead, the misfit of the recordings left out is larger by {estimate_text(apart)} nat per "
        f"segment ({level_text(apart.level)}): {line}."
    )


def reduction_warnings(verdict: Verdict) -> list[str]:
    """Where the effect's reduction of the error is not significant, or nothing was to be gained: one sentence each."""
    found = []
    for c in verdict.comparisons:
        if not known(c.after):
            continue
        if c.share is None and known(c.floor):
            what = "the base model's error is no larger than the numerical floor, so that nothing could be gained"
            found.append(f"{_begun(c.what)}: {what}.")
        elif known(c.reduction) and c.reduction.low <= 0:
            found.append(f"{_begun(c.what)}: the reduction is not significant.")
    return found


def named_candidates(verdict: Verdict) -> list[Candidate]:
    """The candidates that the verdict names, in its order: of an effect with several parameters, those that act."""
    return [c for name in verdict.named for c in verdict.ranking if c.effect == name and not c.why_not]


def rejected(verdict: Verdict) -> list[Candidate]:
    """The candidates that it does not name."""
    return [c for c in verdict.ranking if c not in named_candidates(verdict)]


def candidate_title(verdict: Verdict, candidate: Candidate) -> str:
    """The effect's name; with the parameter where several of its parameters were weighed."""
    several = sum(c.effect == candidate.effect for c in verdict.ranking) > 1
    return title(candidate.effect, candidate.parameter) if several else candidate.effect


def _begun(text: str) -> str:
    """As the beginning of a sentence."""
    return text[:1].upper() + text[1:]


def common_level(estimates: Iterable[Estimate]) -> str:
    """The level of all intervals, or all that there are."""
    return ", ".join(level_text(level) for level in sorted({e.level for e in estimates if known(e)}))


def titles(verdict: Verdict) -> tuple[str, ...]:
    """What the verdict names, in its order; an effect of which several parameters were weighed with its parameter."""
    found: list[str] = []
    for name in verdict.named:
        own = [c for c in verdict.ranking if c.effect == name]
        acting = [c for c in own if not c.why_not]
        found += [title(c.effect, c.parameter) for c in acting] if acting and len(own) > 1 else [name]
    return tuple(found)


def title(effect: str, parameter: str) -> str:
    """An effect by one of its parameters."""
    return f"{effect} ({readable(parameter)})"


def readable(name: str) -> str:
    """A parameter's name as it is written in a sentence."""
    return name.replace("_", " ")
