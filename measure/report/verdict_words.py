"""The report in words, for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from measure.report import verdict_sentences
from measure.report.verdict_sentences import readable
from measure.verdict.quantity import (
    display,
    estimate_text,
    in_errors,
    known,
    level_text,
    probability,
    share,
    with_error,
    with_level,
)
from measure.verdict.verdict_record import Candidate, Comparison, Verdict

_WIDTH = 100
_RUNNERS_UP = 3
_NO_BREAK = "\N{NO-BREAK SPACE}"


def words(verdict: Verdict) -> str:
    """Writes the verdict, its test, the errors before and after, what else was weighed and what was
    assumed.

    Lines of at most 100 characters, except where a name is longer; no final line break.
    """
    return "\n".join(line for part in _parts(verdict) for line in part)


def _parts(verdict: Verdict) -> Iterator[list[str]]:
    yield [verdict_sentences.heading(verdict)]
    if power := verdict_sentences.power_mean(verdict):
        yield wrap_lines(f"{power}.")
    yield [*wrap_lines(verdict.words), ""]
    remark = verdict_sentences.test_remark(verdict.test)
    yield item("test", " ".join([verdict_sentences.test_sentence(verdict), remark]).strip())
    if power := verdict_sentences.power_text(verdict):
        yield item("power", power)
    for candidate in verdict_sentences.named_candidates(verdict):
        yield item(
            verdict_sentences.candidate_title(verdict, candidate), _candidate_text(candidate)
        )
    for comparison in verdict.comparisons:
        yield item(
            comparison.what, _comparison_line(comparison, verdict_sentences.after_label(verdict))
        )
    if control := verdict_sentences.control_summary(verdict):
        yield item("control", control)
    for warning in verdict_sentences.control_warnings(
        verdict
    ) + verdict_sentences.reduction_warnings(verdict):
        yield item("beware", warning)
    for parameter in verdict.parameters:
        moved = ""
        if known(parameter.after):
            moved = (
                f" → {estimate_text(parameter.after)}, a shift of {in_errors(parameter.shift)} "
                "standard errors"
            )
        yield item(parameter.name, f"{verdict_sentences.parameter_text(parameter.before)}{moved}")
    rejected = verdict_sentences.rejected_candidates(verdict)
    for candidate in rejected[:_RUNNERS_UP]:
        yield item(
            f"not {verdict_sentences.candidate_title(verdict, candidate)}",
            candidate.why_not or "no reason was recorded",
        )
    if len(rejected) > _RUNNERS_UP:
        yield item(
            "", f"and {len(rejected) - _RUNNERS_UP} more were weighed; the page has them all"
        )
    for label, text in (("would separate", verdict.separating), ("proposal", verdict.proposal)):
        if text:
            yield item(label, text)
    for assumption in verdict.assumptions:
        yield item("assumed", assumption)
    for label, text in verdict_sentences.unseen_effects(verdict):
        yield item(label, text)
    for kind, text in verdict.findings:
        yield item(kind, text)


def _candidate_text(candidate: Candidate) -> str:
    gain = with_error(candidate.gain, candidate.gain_error)
    parts = [
        f"{readable(candidate.parameter)} {with_level(candidate.strength)}",
        f"z = {in_errors(candidate.z)}, family-wise p = {probability(candidate.p_family)}",
        f"held-out gain {gain} nat",
        f"p = {probability(candidate.leftover)} for the errors that remain with it",
    ]
    if candidate.heterogeneity is not None:
        parts.append(
            f"p = {probability(candidate.heterogeneity)} for the same strength in all recordings"
        )
    return _join_parts(parts)


def _comparison_line(comparison: Comparison, after_label: str) -> str:
    in_unit = display([e.point for e in (comparison.before, comparison.floor) if known(e)], "m")
    parts = [f"error {estimate_text(comparison.before, display_as=in_unit)}"]
    if known(comparison.after):
        parts[0] += f" → {estimate_text(comparison.after, display_as=in_unit)} {after_label}"
        parts.append(f"reduction {estimate_text(comparison.reduction, display_as=in_unit)}")
        parts.append(f"E_red {share(comparison.share)}")
    parts.append(verdict_sentences.floor_text(comparison))
    if known(comparison.control):
        parts.append(
            f"control {comparison.control_name} "
            f"{estimate_text(comparison.control, display_as=in_unit)}"
        )
        if known(comparison.apart):
            parts[-1] += f", worse by {estimate_text(comparison.apart)} nat per segment"
    parts.append(f"intervals {level_text(comparison.before.level)}, n = {comparison.frames} frames")
    return _join_parts(parts)


def _join_parts(parts: Sequence[str]) -> str:
    """Joins the parts in a row; lines break between them, not within."""
    return "; ".join(part.replace(" ", _NO_BREAK) for part in parts)


def item(label: str, text: str) -> list[str]:
    """Wraps `label: text`, its further lines set in."""
    return wrap_lines(f"  {label}: {text}" if label else f"  {text}", indent="    ")


def wrap_lines(text: str, *, indent: str = "") -> list[str]:
    """Breaks a text into lines of at most 100 characters, but for longer names."""
    lines = textwrap.wrap(
        text, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(_NO_BREAK, " ") for line in lines]
