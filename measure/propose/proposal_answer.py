"""A search for an effect as an answer: its sentence, quantities and sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flagdata.answer.answer import Cell, Figure, Head, Part, Section, Table, Tone
from flagdata.answer.charts import Across, Axis, Bars, Chart, Colour, Line, Panel
from flagdata.answer.proposed import Proposed
from flagdata.core.json_values import json_values
from measure.propose.outcome import Decision, ProposalOutcome, Retest, TermStrength
from measure.propose.proposal_words import words
from measure.verdict.quantity import estimate_text, number, probability
from measure.verdict.verdict_record import QUANTITY_ENTRIES

_MOST = 14
_CHART = 620
"""Most that a chart is wide [px]."""


def answer_of(outcome: ProposalOutcome, *, subject: str, effect: str) -> Proposed:
    """Makes the answer of a search.

    Args:
        subject: what the recordings are called.
        effect: file and class of the effect; empty where no term was taken.
    """
    retest = outcome.retest
    facts = {
        "terms tried": str(outcome.tried),
        "taken": ", ".join(one.name for one in outcome.strengths) or "none",
        "known effects": ", ".join(outcome.known) or "none",
        "effect": effect or "none written",
    }
    if retest is not None:
        facts["tested on"] = f"{retest.what}, {retest.segments} segments"
    return Proposed(
        question="propose",
        subject=subject,
        sentence=spoken(outcome),
        tone=Tone.SETTLED if outcome.decision is Decision.KEPT else Tone.MISSED,
        quantities={one.name: replace(one.estimate, name=one.name) for one in outcome.strengths},
        document={"effect": effect, **json_values(outcome, names=QUANTITY_ENTRIES)},
        head=Head(
            figures=[] if retest is None else [_errors(retest)],
            facts=facts,
            limits=[f"{outcome.reason[:1].upper()}{outcome.reason[1:]}."],
        ),
        make_sections=lambda: _sections(outcome),
        provenance={
            "proposed from": outcome.proposed_from,
            "tested on": outcome.tested_on,
            "nulls": outcome.nulls,
            "seed": str(outcome.seed),
            "level": f"{outcome.level:g}",
        },
        decision=outcome.decision.value,
        reason=outcome.reason,
        effect=effect,
        words=words(outcome),
    )


def spoken(outcome: ProposalOutcome) -> str:
    """Writes the outcome in a sentence of fewer than 25 words that can be said aloud."""
    count = len(outcome.strengths)
    terms = f"{count} term{'' if count == 1 else 's'}"
    if outcome.decision is Decision.KEPT:
        return f"An effect of {terms} is kept: it lowers the error on recordings not looked at."
    if count:
        return f"An effect of {terms} is rejected by recordings that were not looked at."
    return f"No effect is proposed: none of {outcome.tried} terms explains what is missing."


def _errors(retest: Retest) -> Figure:
    """Draws the errors before, after and with the control, of untouched data."""
    models = [("before", retest.before), ("with the proposal", retest.after)]
    if retest.control is not None:
        models.append((f"with {' and '.join(retest.control_names)}", retest.control))
    models.append(("numerical floor", retest.floor))
    bars = Bars(
        names=[name for name, _ in models],
        lengths=[1e3 * one.point for _, one in models],
        low=[1e3 * one.low for _, one in models],
        high=[1e3 * one.high for _, one in models],
        colour=Colour.FILM,
    )
    panel = Panel(marks=[bars], x=Axis(label="error on untouched data [mm]"))
    return Figure(
        title="Errors on untouched data",
        content=Chart(rows=[[panel]], height=1.0 + 0.4 * len(models), width=5.2),
        caption=f"Root mean square error on {retest.what}.",
        width=_CHART,
    )


def _sections(outcome: ProposalOutcome) -> list[Section]:
    made = [Section(title="The outcome in full", parts=words(outcome).split("\n"), folded=True)]
    if outcome.strengths:
        made.append(_strengths(outcome.strengths))
    if outcome.retest is not None:
        made.append(_retest(outcome.retest))
    if outcome.steps:
        made.append(_steps(outcome))
    if outcome.ranking:
        made.append(_ranking(outcome))
    return made


def _strengths(strengths: Sequence[TermStrength]) -> Section:
    """Makes the section of what was taken, and of how its amplitude goes in time."""
    rows: list[list[Cell]] = [
        [one.name, one.words, replace(one.estimate, name=one.name)] for one in strengths
    ]
    parts: list[Part] = [Table(columns=["term", "what it is", "strength"], rows=rows)]
    for one in strengths:
        course = one.course
        panels = [
            Panel(
                marks=[
                    Across(y=one.estimate.point),
                    Line(x=times, y=amplitudes, colour=Colour.FILM),
                ],
                title=f"{speed:.1f} m/s",
                x=Axis(label="time [s]"),
                y=Axis(label=f"{one.name} [{one.estimate.unit}]"),
            )
            for times, amplitudes, speed in zip(
                course.times, course.amplitudes, course.speeds, strict=True
            )
        ]
        rows_of_panels = [panels[first : first + 3] for first in range(0, len(panels), 3)]
        parts.append(
            Figure(
                title=f"Amplitude of {one.name} in time",
                content=Chart(rows=rows_of_panels, height=2.2, legend=False),
                caption=f"{course.words}. Level line: as fitted to all recordings.",
            )
        )
    return Section(title="What was taken", parts=parts, anchor="strengths", folded=True)


def _retest(retest: Retest) -> Section:
    """Makes the section of the test on untouched data."""
    rows: dict[str, Cell] = {
        "error before": estimate_text(retest.before),
        "error after": estimate_text(retest.after),
        "reduction, paired": estimate_text(retest.reduction),
        "misfit lower by [nat per segment]": estimate_text(retest.helped),
        "numerical floor": estimate_text(retest.floor),
    }
    if retest.share is not None:
        rows["removed of the squared error above it"] = f"{100 * retest.share:.0f} %"
    if retest.control is not None:
        rows[f"instead with {' and '.join(retest.control_names)}"] = estimate_text(retest.control)
        rows["its misfit higher by [nat per segment]"] = estimate_text(retest.apart)
    table = Table.of_values(rows, caption=f"On {retest.what}, {retest.segments} segments.")
    return Section(title="The test on untouched data", parts=[table], anchor="test", folded=True)


def _steps(outcome: ProposalOutcome) -> Section:
    """Makes the section of the terms that were looked at, in order."""
    rows: list[list[Cell]] = [
        [
            one.name,
            number(one.statistic),
            probability(one.p_family),
            f"{one.gain:.1f} ± {one.gain_error:.1f}",
            "taken" if one.taken else one.reason,
        ]
        for one in outcome.steps
    ]
    columns = ["term", "statistic", "p over all terms", "held-out gain [nat]", "what became of it"]
    table = Table(columns=columns, rows=rows)
    return Section(title="The search", parts=[table], anchor="search", folded=True)


def _ranking(outcome: ProposalOutcome) -> Section:
    """Makes the section of all terms, each alone."""
    shown = outcome.ranking[:_MOST]
    bars = Bars(names=[one.name for one in shown], lengths=[one.gain for one in shown])
    panel = Panel(marks=[bars], x=Axis(label="held-out gain of the term alone [nat]"))
    figure = Figure(
        title="Held-out gain of each term alone",
        content=Chart(rows=[[panel]], height=0.9 + 0.34 * len(shown), width=7.0),
        caption=f"The first {len(shown)} of {len(outcome.ranking)} terms.",
        width=_CHART,
    )
    return Section(title="All terms, each alone", parts=[figure], anchor="ranking", folded=True)
