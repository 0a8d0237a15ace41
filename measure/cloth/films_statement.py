"""The verdict on films in sentences: what was assumed, what is missing, and all of it for a
terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from measure.cloth.loop import Departure
from measure.cloth.observed_recording import Observed, constant_wind
from measure.observables import OBSERVABLES
from measure.report import verdict_sentences
from measure.report.lead_sentences import lead
from measure.report.verdict_sentences import list_names
from measure.report.verdict_words import item, wrap_lines
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.quantity import (
    estimate_text,
    known,
    level_text,
    number,
    probability,
    share,
    with_level,
)
from measure.verdict.verdict_record import Candidate, Comparison, Conclusion, Verdict

_MOST = 4
"""Observables that are named."""


def state_verdict(
    verdict: Verdict,
    recordings: Sequence[Observed],
    *,
    has_weight: bool,
    unseen: tuple[str, ...],
    departing: tuple[Departure, ...],
) -> Verdict:
    """States the verdict with all that it says in sentences.

    Args:
        has_weight: whether the cloth's area weight was stated.
        unseen: effects that these recordings would not show.
        departing: what departs from the base model.
    """
    return replace(
        verdict,
        words=lead(verdict),
        assumptions=assumptions(recordings, has_weight=has_weight, unseen=unseen),
        proposal=missing(departing) if verdict.conclusion not in NOT_REJECTED else "",
        separating=separating(verdict, has_weight=has_weight),
    )


def separating(verdict: Verdict, *, has_weight: bool) -> str:
    """Returns what would decide between several effects.

    Args:
        has_weight: whether the cloth's area weight was stated.
    """
    if verdict.conclusion is not Conclusion.ONE_OF:
        return ""
    return (
        "a recording in another wind, or "
        f"{'more minutes of it' if has_weight else 'the cloth weighed (--area-weight)'}"
    )


def missing(departing: Sequence[Departure]) -> str:
    """Returns the size of what the base model lacks."""
    if not departing:
        return ""
    parts = []
    for departure in departing[:_MOST]:
        unit = OBSERVABLES[departure.observable].unit
        sign = "+" if departure.off > 0 else ""
        parts.append(
            f"{departure.observable} "
            f"{sign}{number(departure.off, digits=2)}{'' if unit == '1' else f' {unit}'} "
            f"({departure.recording}; {number(abs(departure.deviations), digits=2)} standard "
            "deviations of replicates)"
        )
    return (
        "What the base model as calibrated does not show, observed less predicted: "
        f"{', '.join(parts)}."
    )


def assumptions(
    recordings: Sequence[Observed], *, has_weight: bool, unseen: tuple[str, ...]
) -> tuple[str, ...]:
    """Returns what was taken as given."""
    steady = bool(constant_wind(recordings))
    sentences = [
        (
            "the flag has the stated size and is held as stated, and the camera is where it is "
            "stated "
            "to be"
        ),
        (
            "area weight, bending and damping are calibrated, so that what only changes them is "
            "not an "
            "effect"
        ),
    ]
    if not has_weight:
        sentences.append(
            "the cloth was not weighed: its weight, the air's density and drag, holes in the "
            "cloth, wetness and the "
            "anemometer's gain act alike in a film, so that none of them is found beyond what is "
            "assumed of them"
        )
    if steady:
        sentences.append(
            "the wind hardly changes: a film in one steady wind shows only the ratio of the air's "
            "pressure to the "
            "cloth's weight"
        )
    if unseen:
        sentences.append(
            f"even where they are strong, {list_names(unseen)} would move what these recordings "
            "show by less than two "
            "standard errors beyond what another cloth or view does: they are not excluded"
        )
    sentences.append(
        "a wind that is turned from its log looks like another place of the camera, and is not "
        "weighed"
    )
    return tuple(sentences)


_RUNNERS_UP = 3


def words(verdict: Verdict) -> str:
    """Writes the verdict, its test, the errors before and after, what else was weighed and what was
    assumed; lines of at most 100 characters, without a final line break."""
    return "\n".join(
        line
        for label, text in _items(verdict)
        for line in (item(label, text) if label else wrap_lines(text))
    )


def probability_of(candidate: Candidate) -> str:
    """Returns the evidence for an effect: `probability 0.97, log Bayes factor 12.3 nat`."""
    return (
        f"probability {share(candidate.probability)}, given that one effect is missing; logarithm "
        "of the Bayes factor "
        f"against the base model {number(candidate.gain)} nat; p = "
        f"{probability(candidate.leftover)} for what remains"
    )


def error_text(comparison: Comparison, after: str) -> str:
    """Writes `error 0.12 rad → 0.02 rad with lift; scatter of replicates 0.015 rad`."""
    parts = [f"error {estimate_text(comparison.before)}"]
    if known(comparison.after):
        parts[0] += f" → {estimate_text(comparison.after)} {after}"
    if known(comparison.control):
        parts.append(f"{estimate_text(comparison.control)} with {comparison.control_name} instead")
    unit = "" if comparison.floor.unit == "1" else f" {comparison.floor.unit}"
    parts.append(f"replicates scatter by {number(comparison.floor.point, digits=2)}{unit}")
    return "; ".join([*parts, f"n = {comparison.frames} windows"])


def _items(verdict: Verdict) -> Iterator[tuple[str, str]]:
    yield "", verdict_sentences.heading(verdict)
    if power := verdict_sentences.power_mean(verdict):
        yield "", f"{power}."
    yield "", verdict.words
    yield (
        "test",
        " ".join(
            [verdict_sentences.test_sentence(verdict), verdict_sentences.test_remark(verdict.test)]
        ).strip(),
    )
    if power := verdict_sentences.power_text(verdict):
        yield "power", power
    for candidate in verdict_sentences.named_candidates(verdict):
        yield (
            verdict_sentences.candidate_title(verdict, candidate),
            f"{with_level(candidate.strength)}; {probability_of(candidate)}",
        )
    for comparison in verdict.comparisons:
        yield comparison.what, error_text(comparison, verdict_sentences.after_label(verdict))
    for parameter in verdict.parameters:
        moved = f" → {with_level(parameter.after)}" if parameter.after is not None else ""
        yield parameter.name.replace("_", " "), f"{with_level(parameter.before)}{moved}"
    if verdict.conclusion not in NOT_REJECTED:
        for candidate in verdict_sentences.rejected_candidates(verdict)[:_RUNNERS_UP]:
            yield f"not {verdict_sentences.candidate_title(verdict, candidate)}", candidate.why_not
    if verdict.separating:
        yield "would separate", verdict.separating
    if verdict.proposal:
        yield "missing", verdict.proposal
    for assumption in verdict.assumptions:
        yield "assumed", assumption
    yield from verdict_sentences.unseen_effects(verdict)
    yield from verdict.findings


def level_of(verdict: Verdict) -> str:
    """Returns the level of the intervals of errors."""
    return level_text(verdict.comparisons[0].before.level) if verdict.comparisons else ""
