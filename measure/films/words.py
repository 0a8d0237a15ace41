"""The verdict on films in words, for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from measure.report import sentences
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.quantity import estimate_text, known, level_text, number, probability, share, with_level
from measure.verdict.record import Candidate, Comparison, Verdict

_WIDTH = 100
_RUNNERS_UP = 3


def words(verdict: Verdict) -> str:
    """The verdict, its test, the errors before and after, what else was weighed and what was assumed; lines of at most
    100 characters, without a final line break."""
    return "\n".join(line for label, text in _items(verdict) for line in _wrapped(label, text))


def probability_of(candidate: Candidate) -> str:
    """The evidence for an effect: `probability 0.97, log Bayes factor 12.3 nat`."""
    return (
        f"probability {share(candidate.probability)}, given that one effect is missing; logarithm of the Bayes factor "
        f"against the base model {number(candidate.gain)} nat; p = {probability(candidate.leftover)} for what remains"
    )


def error_text(comparison: Comparison, after: str) -> str:
    """`error 0.12 rad → 0.02 rad with lift; scatter of replicates 0.015 rad`."""
    parts = [f"error {estimate_text(comparison.before)}"]
    if known(comparison.after):
        parts[0] += f" → {estimate_text(comparison.after)} {after}"
    if known(comparison.control):
        parts.append(f"{estimate_text(comparison.control)} with {comparison.control_name} instead")
    unit = "" if comparison.floor.unit == "1" else f" {comparison.floor.unit}"
    parts.append(f"replicates scatter by {number(comparison.floor.value, digits=2)}{unit}")
    return "; ".join([*parts, f"n = {comparison.frames} windows"])


def _items(verdict: Verdict) -> Iterator[tuple[str, str]]:
    yield "", sentences.heading(verdict)
    if power := sentences.power_mean(verdict):
        yield "", f"{power}."
    yield "", verdict.words
    yield "test", " ".join([sentences.test_sentence(verdict), sentences.test_remark(verdict.test)]).strip()
    if power := sentences.power_text(verdict):
        yield "power", power
    for candidate in sentences.named_candidates(verdict):
        yield (
            sentences.candidate_title(verdict, candidate),
            f"{with_level(candidate.strength)}; {probability_of(candidate)}",
        )
    for comparison in verdict.comparisons:
        yield comparison.what, error_text(comparison, sentences.after_label(verdict))
    for parameter in verdict.parameters:
        moved = f" → {with_level(parameter.after)}" if parameter.after is not None else ""
        yield parameter.name.replace("_", " "), f"{with_level(parameter.before)}{moved}"
    if verdict.conclusion not in NOT_REJECTED:
        for candidate in sentences.rejected(verdict)[:_RUNNERS_UP]:
            yield f"not {sentences.candidate_title(verdict, candidate)}", candidate.why_not
    if verdict.separating:
        yield "would separate", verdict.separating
    if verdict.proposal:
        yield "missing", verdict.proposal
    for assumption in verdict.assumptions:
        yield "assumed", assumption
    yield from verdict.findings


def _wrapped(label: str, text: str) -> list[str]:
    return textwrap.wrap(
        f"  {label}: {text}" if label else text,
        _WIDTH,
        subsequent_indent="    " if label else "",
        break_long_words=False,
        break_on_hyphens=False,
    )


def level_of(verdict: Verdict) -> str:
    """Of the intervals of errors."""
    return level_text(verdict.comparisons[0].before.level) if verdict.comparisons else ""
