"""What every form of the report says in the same words: the conclusion, the test, what the columns
mean."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from flagdata.answer import Quantity
from measure.verdict.decided import NOT_REJECTED, erring, times_floor
from measure.verdict.quantity import (
    display,
    estimate_text,
    known,
    level_text,
    number,
    probability,
    share,
    with_level,
)
from measure.verdict.verdict_record import (
    Candidate,
    Comparison,
    Conclusion,
    NullTest,
    Verdict,
)

CONTRADICTING = ("still-away-from-pins",)
"""Kinds of findings by which the recordings contradict what was declared: they lead a verdict that
names nothing."""

_LISTED = 3
"""Effects of which one is meant, or parts of the data, that a sentence names."""
_DETERMINED = 5.0
"""A factor to either side beyond which a quantity counts as not determined: cloths of all kinds lie
within some ten."""
_FACTORS = ("of nominal", "s")
"""Units of what is estimated by its logarithm."""


def heading(verdict: Verdict) -> str:
    """Writes the conclusion in one line; what contradicts it in the set-up, if anything does,
    before it."""
    contradicting = contradicting_findings(verdict)
    if verdict.conclusion is Conclusion.SUFFICIENT and contradicting:
        return (
            "The set-up is not as declared, so that this verdict does not count: "
            f"{contradicting[0]}"
        )
    effects, either = list_names(titles(verdict)), list_names(shorten_list(titles(verdict)))
    partly = (
        f"the base model lacked {effects}, and something more"
        if verdict.named
        else "something is still missing"
    )
    return {
        Conclusion.UNTESTED: "The base model cannot be tested: there are too few kinds of nulls "
        "for the level",
        Conclusion.SUFFICIENT: f"No effect needed: {_suffices(verdict)}",
        Conclusion.UNDECIDED: "Not decided: the base model is not rejected, and not shown to "
        "suffice either",
        Conclusion.EFFECT: f"The base model lacked {effects}",
        Conclusion.ONE_OF: f"The base model lacked {_one_of(verdict)}{either}: these recordings do "
        "not decide which",
        Conclusion.PARTLY: f"Partly explained: {partly}",
        Conclusion.OUTSIDE: "The base model lacks something that no effect of the library explains",
    }[verdict.conclusion]


def _one_of(verdict: Verdict) -> str:
    """Writes "one of ". It is empty where all that may be meant are strengths of one effect."""
    return "one of " if len(titles(verdict)) > 1 else ""


def _suffices(verdict: Verdict) -> str:
    """Writes what a base model that is not rejected does: it explains nothing that it errs on."""
    return (
        "the base model is not rejected"
        if erring(verdict)
        else "the base model explains these recordings"
    )


def erring_text(verdict: Verdict) -> str:
    """Writes where the model that is offered as the answer errs by more than three floors, in a
    sentence; empty where it does nowhere."""
    comparisons = erring(verdict)
    if not comparisons:
        return ""
    names = shorten_list(
        [
            f"{comparison.what} by {number(times_floor(comparison, verdict), digits=2)}"
            for comparison in comparisons
        ]
    )
    model = f"the model {after_label(verdict)}" if verdict.named else "the base model"
    return f"In floors, {model} errs on {list_names(names)}: it does not explain that"


def error_warnings(verdict: Verdict) -> list[str]:
    """Writes `erring_text` as a warning."""
    return [f"{text}." for text in [erring_text(verdict)] if text]


def contradicting_findings(verdict: Verdict) -> list[str]:
    """Lists the findings by which the recordings contradict what was declared."""
    return [text for kind, text in verdict.findings if kind in CONTRADICTING]


def list_names(names: Sequence[str]) -> str:
    """Lists names as `a`, `a and b`, `a, b and c`."""
    return (
        " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        or "an unnamed effect"
    )


def shorten_list(names: Sequence[str]) -> list[str]:
    """Shortens a list to the names, or if there are many the first of them and "12 more"."""
    return (
        list(names)
        if len(names) <= _LISTED + 1
        else [*names[:_LISTED], f"{len(names) - _LISTED} more"]
    )


def after_label(verdict: Verdict) -> str:
    """Names what the columns "after" are of."""
    if verdict.conclusion in NOT_REJECTED:
        return "with an effect"
    if not verdict.named:
        return "with the corrective field"
    if verdict.conclusion is Conclusion.ONE_OF:
        return f"with the best of {list_names(shorten_list(titles(verdict)))}"
    return f"with {list_names(titles(verdict))}"


def leads_with_p(verdict: Verdict) -> bool:
    """Returns whether the verdict's first sentence states the p-value of the global test: not where
    the base model could not be tested, nor where the recordings contradict the declared set-up."""
    if verdict.conclusion is Conclusion.UNTESTED:
        return False
    return verdict.conclusion is not Conclusion.SUFFICIENT or not contradicting_findings(verdict)


def test_sentence(verdict: Verdict) -> str:
    """Describes the global test: what it says, how its p-value is counted and the interval that the
    number of nulls leaves it.

    The value itself stands here only where the verdict's first sentence has none.
    """
    test = verdict.test
    null = [v for v in test.null if math.isfinite(v)]
    p = test.p_value
    says = "is rejected" if p.point <= test.level else "is not rejected"
    if test.critical is None:
        says = "cannot be tested"
    value = "p" if leads_with_p(verdict) else f"p = {probability(p.point)}"
    along = (
        f" along {test.suspected} alone, suspected before the recordings were looked at,"
        if test.suspected
        else ""
    )
    return (
        f"The base model {says}{along} at level {test.level:g}: {as_large(test)} of {len(null)} "
        f"{'groups of simulations' if test.effective is None else 'null flags'} deviate as much as "
        "the recordings "
        f"(statistic {number(test.statistic)}). {value} is {_counting_sentence(test)}; its "
        "sampling interval is "
        f"[{probability(p.low)}, {probability(p.high)}] {level_text(p.level)}.{_tail(test)}"
    )


def statistic_text(test: NullTest) -> str:
    """Describes the statistic of a test along the library's effects; empty of other tests."""
    if test.directed is None:
        return ""
    largest = (
        "The statistic is how far the recordings go the way of the effect that they go farthest: "
        f"{number(test.directed)} standard deviations of nulls"
    )
    if test.course is None or test.course_share is None:
        return f"{largest}."
    return (
        f"{largest}. Or it is how far the wind's course swings, on a scale by which that takes "
        f"{number(100 * test.course_share)} % of the level: {number(test.course)}. The larger one "
        "counts, and nothing else decides."
    )


def _counting_sentence(test: NullTest) -> str:
    """Explains how p is counted."""
    if test.effective is None:
        return (
            f"(1 + number of the {test.kinds} numerical set-ups whose simulations deviate as much) "
            f"/ {1 + test.kinds}, "
            "a set-up counting by the share of its groups"
        )
    flags = number(test.effective)
    return (
        f"(1 + {flags} × the share of null flags that deviate as much) / (1 + {flags}): so many "
        "independent ones are "
        f"what those of {test.kinds} numerical set-ups count as, since flags of one set-up are "
        "correlated by "
        f"{number(test.correlation, digits=2)}"
    )


def _tail(test: NullTest) -> str:
    """Writes what the tail of a distribution says beside p; empty where it was not taken."""
    if test.tail is None:
        return ""
    return (
        " By the tail of Student's t, which extrapolates and decides nothing, it would be "
        f"{probability(test.tail)}."
    )


def test_remark(test: NullTest) -> str:
    """Writes what limits the test; empty where nothing does."""
    if test.critical is None:
        return (
            f"With {test.kinds} kinds of numerics no p-value below {probability(test.least)} is "
            "possible, so "
            f"that the test could not have rejected the base model at level {test.level:g}."
        )
    if test.p_value.point > test.level:
        return "An effect that is too weak to show in these recordings may still act."
    return ""


def power_text(verdict: Verdict) -> str:
    """Writes how surely effects of their expected strengths are seen, in a sentence; empty where
    that is not known."""
    if not verdict.power:
        return ""
    chances = [
        f"{title(power.effect, power.parameter)} {number(power.strength, digits=2)}"
        f"{'' if power.unit == '1' else f' {power.unit}'} with {share(power.share)}"
        for power in verdict.power
    ]
    return f"{power_mean(verdict)}: {', '.join(chances)}."


def power_mean(verdict: Verdict) -> str:
    """Writes how surely they are seen on average, without a full stop."""
    if not verdict.power:
        return ""
    mean = sum(power.share for power in verdict.power) / len(verdict.power)
    return (
        "An effect of the strength that is expected of it would be seen with a chance of "
        f"{share(mean)} on average"
    )


def as_large(test: NullTest) -> int:
    """Counts the nulls that are at least as large as the observed statistic."""
    return sum(1 for v in test.null if math.isfinite(v) and v >= test.statistic)


def control_warnings(verdict: Verdict) -> list[str]:
    """Warns where the wrong effect helps as much as the named one, or hardly less: a sentence for
    all parts of each kind."""
    compared = [c for c in verdict.comparisons if c.apart is not None and known(c.apart)]
    failing = [c for c in compared if c.apart is not None and c.apart.point <= 0]
    equal = [c for c in compared if c.apart is not None and c.apart.low <= 0 < c.apart.point]
    warnings = []
    if failing:
        text = (
            f"the control {failing[0].control_name} does as well as the named effect, so that the "
            "attribution fails"
        )
        warnings.append(f"{_parts(failing, verdict)}: {text} there.")
    if equal:
        text = f"the control {equal[0].control_name} and the named effect fit equally well"
        better = verdict.apart is not None and known(verdict.apart) and verdict.apart.low > 0
        together = "; over all parts together the named effect does better" if better else ""
        everywhere = 1 < len(equal) == len(verdict.comparisons)
        where = (
            f"In each of the {len(equal)} parts by itself"
            if everywhere
            else f"{_parts(equal, verdict)}:"
        )
        warnings.append(f"{where} {text}{together}.")
    return warnings


def _parts(comparisons: Sequence[Comparison], verdict: Verdict) -> str:
    """Names which parts of the data, the first few by name, and of how many."""
    names = [c.what for c in comparisons]
    which = _begun(list_names(shorten_list(names)))
    return (
        which
        if len(verdict.comparisons) == 1
        else f"{which}, {len(comparisons)} of {len(verdict.comparisons)} parts"
    )


def control_summary(verdict: Verdict) -> str:
    """Sums up the wrong-effect control over all that was left out, in a sentence; empty where none
    was run."""
    difference = verdict.apart
    if difference is None or not known(difference):
        return ""
    control = next(
        (c.control_name for c in verdict.comparisons if c.control_name), "the best wrong effect"
    )
    line = "the named effect does better" if difference.low > 0 else "the two fit equally well"
    return (
        f"On recordings left out, {control} instead predicts worse by {estimate_text(difference)} "
        "nat per segment "
        f"({level_text(difference.level)}): {line}."
    )


def reduction_warnings(verdict: Verdict) -> list[str]:
    """Warns where the effect's reduction of the error is not significant: one sentence for all
    parts."""
    weak = [
        c
        for c in verdict.comparisons
        if known(c.after) and known(c.reduction) and c.reduction.low <= 0
    ]
    return [f"{_parts(weak, verdict)}: the reduction is not significant there."] if weak else []


def floor_text(comparison: Comparison) -> str:
    """Writes the floor of a comparison; that it limits nothing, where the errors are below it."""
    in_unit = display([e.point for e in (comparison.before, comparison.floor) if known(e)], "m")
    text = f"floor {estimate_text(comparison.floor, display_as=in_unit)}"
    if known(comparison.floor) and comparison.floor.point > comparison.before.point:
        return f"{text}, above the errors, so that it limits nothing"
    return text


def parameter_text(estimate: Quantity) -> str:
    """Writes a calibrated parameter; that these recordings do not determine it, where its interval
    is wider than a factor of five to either side."""
    if not known(estimate) or estimate.unit not in _FACTORS:
        return with_level(estimate)
    in_unit = display((estimate.point, estimate.low, estimate.high), estimate.unit)
    if estimate.low > 0 and estimate.high > _DETERMINED**2 * estimate.low:
        return f"not determined by these recordings: {with_level(estimate)}"
    if estimate.low == 0 and estimate.high > _DETERMINED * estimate.point:
        most = f"{number(in_unit.factor * estimate.high, digits=2)}{in_unit.suffix}"
        return (
            f"at most {most} {level_text(estimate.level)}, best "
            f"{number(in_unit.factor * estimate.point, digits=2)}"
        )
    return with_level(estimate)


def named_candidates(verdict: Verdict) -> list[Candidate]:
    """Lists the candidates that the verdict names, in its order: of an effect with several
    parameters, those that act."""
    return [
        c for name in verdict.named for c in verdict.ranking if c.effect == name and not c.why_not
    ]


def rejected_candidates(verdict: Verdict) -> list[Candidate]:
    """Lists the candidates that the verdict does not name."""
    return [c for c in verdict.ranking if c not in named_candidates(verdict)]


def candidate_title(verdict: Verdict, candidate: Candidate) -> str:
    """Names the effect; with the parameter where several of its parameters were weighed."""
    several = sum(c.effect == candidate.effect for c in verdict.ranking) > 1
    return title(candidate.effect, candidate.parameter) if several else candidate.effect


def _begun(text: str) -> str:
    """As the beginning of a sentence."""
    return text[:1].upper() + text[1:]


def unseen_effects(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Lists what the verdict says nothing of: effects that were not weighed, and those that the
    base model copies here (label, text)."""
    for label, effects in (("not weighed", verdict.unweighed), ("hardly shown", verdict.copied)):
        if effects:
            yield label, "; ".join(f"{effect}: {why}" for effect, why in effects)


def common_level(estimates: Iterable[Quantity]) -> str:
    """Writes the level of all intervals, or all that there are."""
    return ", ".join(
        level_text(level) for level in sorted({e.level for e in estimates if known(e)})
    )


def titles(verdict: Verdict) -> tuple[str, ...]:
    """Lists what the verdict names, in its order: each effect once, with those of its parameters
    that act where several were weighed, and the air's density and holes in the cloth by what they
    have in common."""
    names: list[str] = []
    pressure = [name for name in verdict.named if name in ("air-density", "porosity")]
    for name in verdict.named:
        if name == "air-density":
            names.append(f"another dynamic pressure ({' or '.join(pressure)})")
        if name in pressure:
            continue
        of_effect = [c for c in verdict.ranking if c.effect == name]
        acting = [c for c in of_effect if not c.why_not]
        which = join_strengths([readable(c.parameter) for c in acting], verdict)
        names.append(f"{name} ({which})" if acting and len(of_effect) > 1 else name)
    return tuple(names)


def join_strengths(parts: Sequence[str], verdict: Verdict) -> str:
    """Strengths of one effect: `lean and sway` that act together, `lean or sway` of which one
    may."""
    return " or ".join(parts) if verdict.conclusion is Conclusion.ONE_OF else list_names(parts)


def title(effect: str, parameter: str) -> str:
    """Names an effect by one of its parameters."""
    return f"{effect} ({readable(parameter)})"


def readable(name: str) -> str:
    """Writes a parameter's name as in a sentence."""
    return name.replace("_", " ")
