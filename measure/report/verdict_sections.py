"""Sections that the answers by markers and by films have in common, from a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from markupsafe import Markup

from flagdata.answer.answer import Cell, Figure, Part, Section, Table
from flagdata.pages.glossary import GLOSSARY
from measure.report import verdict_cells as cells
from measure.report import verdict_sentences
from measure.report.verdict_charts import null_chart
from measure.report.verdict_sentences import readable
from measure.verdict import quantity
from measure.verdict.verdict_record import Comparison, Verdict

GLOSSARY_ANCHOR = "glossary"
_FULL = 672
"""Width of the chart of the test [px]."""


def verdict_section(verdict: Verdict) -> Section:
    """Makes the section of the verdict's own words, and of what would follow from it."""
    parts: list[Part] = [verdict.words]
    if verdict.separating:
        parts.append(f"The experiment that would separate them: {verdict.separating}")
    if verdict.proposal:
        parts.append(verdict.proposal)
    return Section(title="The verdict in full", parts=parts, anchor="verdict", folded=True)


def test_section(verdict: Verdict, statistic: str) -> Section:
    """Makes the section of the test of the base model.

    Args:
        statistic: what is tested, in sentences.
    """
    sentences = [
        verdict_sentences.test_sentence(verdict),
        verdict_sentences.test_remark(verdict.test),
        verdict_sentences.control_summary(verdict),
        statistic,
        f"Nulls: {verdict.test.nulls}",
    ]
    figure = Figure(
        title="The statistic under simulated nulls",
        content=lambda: null_chart(verdict.test),
        width=_FULL,
    )
    return Section(
        title="Test against simulated nulls",
        parts=[figure, " ".join(filter(None, sentences))],
        anchor="test",
        folded=True,
    )


def errors_section(
    verdict: Verdict, *, title: str, columns: tuple[str, str, str], notes: Sequence[Part]
) -> Section:
    """Makes the section of errors on data that no model was fitted to.

    Args:
        columns: what the data, their number and the floor are called.
        notes: below the table.
    """
    compared = verdict.comparisons
    lengths = _common_unit(compared)
    has_after = any(quantity.known(one.after) for one in compared)
    has_control = any(quantity.known(one.control) for one in compared)
    has_apart = any(quantity.known(one.apart) for one in compared)
    data, number, floor = columns
    after = verdict_sentences.after_label(verdict)
    shown = {
        data: lambda one: one.what,
        number: lambda one: cells.count_cell(one.frames),
        "base model": lambda one: cells.estimate_cell(one.before, lengths),
    }
    if has_after:
        shown |= {
            after: lambda one: cells.estimate_cell(one.after, lengths),
            "reduction, paired": lambda one: cells.estimate_cell(one.reduction, lengths),
        }
    shown[floor] = lambda one: cells.estimate_cell(one.floor, lengths)
    if has_after:
        shown["E_red"] = lambda one: cells.share_cell(one.share)
    if has_control:
        shown["control: a wrong effect"] = lambda one: cells.estimate_cell(
            one.control, lengths, note=one.control_name
        )
    if has_apart:
        shown["control worse by [nat per segment]"] = lambda one: cells.estimate_cell(one.apart)
    table = Table(
        columns=list(shown),
        rows=[[show(one) for show in shown.values()] for one in compared],
    )
    return Section(title=title, parts=[table, *notes], anchor="errors", folded=True)


def _common_unit(comparisons: Sequence[Comparison]) -> quantity.Display | None:
    """Chooses millimetres or metres for all errors of lengths; None of other quantities."""
    errors = [
        e for c in comparisons for e in (c.before, c.after, c.floor, c.control) if e is not None
    ]
    if {error.unit for error in errors} != {"m"}:
        return None
    return quantity.display([e.point for e in errors], "m")


def power_section(verdict: Verdict, how: str) -> Section:
    """Makes the section of how surely effects would have been seen.

    Args:
        how: that is counted.
    """
    rows: list[list[Cell]] = [
        [
            cells.name_cell(one.effect, readable(one.parameter)),
            cells.number_cell(one.strength, one.unit),
            cells.share_cell(one.share),
        ]
        for one in verdict.power
    ]
    table = Table(columns=["effect", "expected strength", "chance of being seen"], rows=rows)
    return Section(
        title="What would have been seen",
        parts=[f"{verdict_sentences.power_mean(verdict)}.", table, how],
        anchor="power",
        folded=True,
    )


def parameters_section(verdict: Verdict, *, title: str) -> Section:
    """Makes the section of the calibrated parameters."""
    has_after = any(quantity.known(one.after) for one in verdict.parameters)
    columns = ["parameter", "base model"]
    if has_after:
        columns += [verdict_sentences.after_label(verdict), "shift [SE]"]
    rows: list[list[Cell]] = []
    for one in verdict.parameters:
        row: list[Cell] = [readable(one.name), cells.parameter_cell(one.before)]
        if has_after:
            row += [cells.full_cell(one.after), cells.errors_cell(one.shift)]
        rows.append(row)
    table = Table(columns=columns, rows=rows)
    return Section(title=title, parts=[table], anchor="parameters", folded=True)


def closing_sections(verdict: Verdict) -> list[Section]:
    """Makes the sections that end a page: why other effects are not named, what was assumed, what
    was noticed in the data, what the terms mean."""
    sections: list[Section] = []
    if rejected := verdict_sentences.rejected_candidates(verdict):
        rows = [
            (
                verdict_sentences.candidate_title(verdict, one),
                one.why_not or "no reason was recorded",
            )
            for one in rejected
        ]
        table = Table(columns=["effect", "why not"], rows=rows)
        sections.append(Section(title="Rejected effects", parts=[table], folded=True))
    if verdict.assumptions:
        assumed = list_items(verdict.assumptions)
        sections.append(Section(title="Assumptions", parts=[assumed], folded=True))
    if verdict.findings:
        table = Table(columns=["kind", "what was found"], rows=verdict.findings)
        sections.append(Section(title="Remarks on the data", parts=[table], folded=True))
    return [*sections, glossary_section()]


def unseen_effects(verdict: Verdict) -> list[Part]:
    """Makes the paragraphs on effects that the verdict says nothing of."""
    return [
        f"{label.capitalize()}: {text}."
        for label, text in verdict_sentences.unseen_effects(verdict)
    ]


def glossary_section() -> Section:
    """Makes the section of what the terms mean."""
    terms = Markup("").join(
        Markup("<dt>{}</dt><dd>{}</dd>").format(term, meaning) for term, meaning in GLOSSARY.items()
    )
    return Section(
        title="Glossary",
        parts=[Markup("<dl>{}</dl>").format(terms)],
        anchor=GLOSSARY_ANCHOR,
        folded=True,
    )


def list_items(texts: Iterable[str]) -> Markup:
    """Writes a list of sentences."""
    items = Markup("").join(Markup("<li>{}</li>").format(text) for text in texts)
    return Markup("<ul>{}</ul>").format(items)
