"""An answer by markers and films of one cloth: what both say together, and the sections of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from flagdata.answer.answer import Cell, Head, Section, Table
from flagdata.answer.closed import Closed
from measure.closing.joint_verdict import Joint
from measure.report import verdict_cells as cells
from measure.report.document import plain
from measure.report.lead_sentences import say_strength
from measure.report.verdict_answer import TONES
from measure.report.verdict_sections import GLOSSARY_ANCHOR, glossary_section
from measure.report.verdict_sentences import list_names, shorten_list
from measure.verdict.criteria import CRITERIA
from measure.verdict.quantity import probability
from measure.verdict.verdict_record import Conclusion

KINDS = ("markers", "films")


def joint_answer(joint: Joint, by_markers: Closed, by_films: Closed) -> Closed:
    """Makes the answer of both kinds of recordings: one page with the sections of both."""
    answers: dict[str, Closed] = dict(zip(KINDS, (by_markers, by_films), strict=True))
    strengths = {
        one.name: replace(one.together, name=one.name)
        for one in joint.strengths
        if one.together is not None
    }
    figures = [figure for answer in answers.values() for figure in answer.head.figures[:1]]
    return Closed(
        question="close-loop",
        subject=" and ".join(dict.fromkeys([by_markers.subject, by_films.subject])),
        sentence=spoken(joint),
        tone=TONES[joint.conclusion],
        quantities=strengths,
        findings=[*by_markers.findings, *by_films.findings],
        document={
            **plain(joint),
            **{kind: answer.document for kind, answer in answers.items()},
        },
        head=Head(
            figures=figures,
            facts=_join_facts({kind: answer.head.facts for kind, answer in answers.items()}),
            limits=[
                f"{kind.capitalize()}: {limit}"
                for kind, answer in answers.items()
                for limit in answer.head.limits
            ],
            remarks=by_markers.head.remarks,
        ),
        make_sections=lambda: _sections(joint, answers),
        provenance={
            f"{kind}: {name}": made
            for kind, answer in answers.items()
            for name, made in answer.provenance.items()
        },
        conclusion=joint.conclusion.value,
        named=joint.named,
        words=joint.words,
        p_value=joint.p_value,
        strengths=strengths,
    )


def _join_facts(facts: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Joins the facts of each kind: one row a name, with its kind where not all state the same."""
    joined: dict[str, str] = {}
    for name in dict.fromkeys(name for stated in facts.values() for name in stated):
        lines = {kind: stated[name] for kind, stated in facts.items() if name in stated}
        agreed = len(lines) == len(facts) and len(set(lines.values())) == 1
        several = "; ".join(f"{kind}: {line}" for kind, line in lines.items())
        joined[name] = next(iter(lines.values())) if agreed else several
    return joined


def spoken(joint: Joint) -> str:
    """Writes the answer in a sentence of fewer than 25 words that can be said aloud."""
    p = f"p = {probability(joint.p_value)}"
    names = shorten_list([name.replace("-", " ") for name in joint.named])
    match joint.conclusion:
        case Conclusion.UNTESTED:
            return "Neither markers nor films can test the base model at half of the level."
        case Conclusion.SUFFICIENT:
            return f"No effect is needed: markers and films do not reject the base model ({p})."
        case Conclusion.UNDECIDED:
            return f"Nothing is decided: markers and films do not reject the base model ({p})."
        case Conclusion.OUTSIDE:
            return f"Something is missing that no effect explains to markers and films both ({p})."
        case Conclusion.ONE_OF:
            either = f"{', '.join(names[:-1])} or {names[-1]}"
            return f"Something was missing: {either}; markers and films do not decide which."
        case conclusion:
            part = " a part of" if conclusion is Conclusion.PARTLY else ""
            agreed = [
                one.together
                for one in joint.strengths
                if one.together is not None and (one.apart or 0.0) <= CRITERIA.lead
            ]
            strength = say_strength("strength", agreed[0]) if len(agreed) == 1 else ""
            explains = f"{list_names(names)} explains{part} what both show"
            return f"Something was missing: {explains}{strength or f' ({p})'}."


def _sections(joint: Joint, answers: Mapping[str, Closed]) -> list[Section]:
    """Makes what both give together, and the sections of each kind, folded."""
    rows: list[list[Cell]] = [
        [
            one.name,
            cells.estimate_cell(one.markers),
            cells.estimate_cell(one.films),
            cells.estimate_cell(one.together),
            cells.number_cell(one.apart),
        ]
        for one in (*joint.strengths, *joint.cloth)
    ]
    table = Table(
        columns=["quantity", "markers", "films", "together", "apart [standard errors]"], rows=rows
    )
    made = [
        Section(
            title="What both give together", parts=[joint.words, table, _HOW], anchor="together"
        )
    ]
    for kind, answer in answers.items():
        made += [
            replace(
                section,
                title=f"By {kind}: {section.title[:1].lower()}{section.title[1:]}",
                anchor=f"{kind}-{section.anchor}" if section.anchor else "",
                folded=True,
            )
            for section in answer.make_sections()
            if section.anchor != GLOSSARY_ANCHOR
        ]
    return [*made, glossary_section()]


_HOW = (
    "Intervals at 90 %. Together is the product of both likelihoods, normal in the logarithm; the "
    "error of a strength by the models' meshes counts once. Where only one kind bounds a quantity "
    "on both sides, it is that one's."
)
