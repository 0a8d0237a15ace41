"""What becomes of a search, as an answer."""

from __future__ import annotations

from dataclasses import replace

from flagdata.answer import Tone
from measure.propose import Decision, ProposalOutcome
from measure.propose.outcome import (
    PeriodogramLine,
    Ranked,
    Retest,
    StrengthCourse,
    TermStrength,
)
from measure.propose.proposal_answer import answer_of, spoken
from measure.propose.search import Step
from tests.measure.report.pages import parsed
from tests.measure.report.verdicts import about


def outcome() -> ProposalOutcome:
    """A term that was kept."""
    course = StrengthCourse(
        bin=0.2,
        times=[[0.1, 0.3], [0.1, 0.3]],
        amplitudes=[[1.0, 1.2], [0.9, 1.1]],
        by_recording=[about(1.1, 0.1, "N"), about(1.0, 0.1, "N")],
        speeds=[4.0, 7.0],
        fluctuation=0.1,
        lines=[PeriodogramLine(frequency=2.0, share=0.1, p_value=0.4)],
        words="steady",
    )
    retest = Retest(
        what="the last third of each recording",
        segments=12,
        before=about(0.004, 0.0002),
        after=about(0.002, 0.0001),
        reduction=about(0.002, 0.0002),
        helped=about(3.0, 1.0, "1"),
        floor=about(0.001, 0.0001),
        share=0.8,
        control=about(0.0035, 0.0002),
        apart=about(2.0, 0.8, "1"),
        control_names=("mass all over",),
    )
    step = Step(
        name="push-up",
        column=4,
        statistic=9.0,
        p_family=0.01,
        gain=12.0,
        gain_error=2.0,
        taken=True,
        reason="",
    )
    return ProposalOutcome(
        decision=Decision.KEPT,
        reason="the misfit on unseen data is significantly lower than before",
        steps=(step,),
        tried=30,
        ranking=(Ranked(name="push-up", statistic=9.0, gain=12.0),),
        strengths=(
            TermStrength(
                name="push_up", words="a push up", estimate=about(1.1, 0.2, "N"), course=course
            ),
        ),
        retest=retest,
        level=0.05,
        nulls="160 nulls",
        proposed_from="a" * 64,
        tested_on="b" * 64,
        known=(),
        seed=3,
    )


def test_the_answer_has_the_decision_the_strengths_and_a_page() -> None:
    answer = answer_of(outcome(), subject="flag", effect="proposed.py:PushUp")
    assert (answer.decision, answer.effect, answer.tone) == (
        "kept",
        "proposed.py:PushUp",
        Tone.SETTLED,
    )
    assert answer.quantities["push_up"].interval == (0.9000000000000001, 1.3)
    assert answer.document["effect"] == "proposed.py:PushUp"
    assert answer.document["strengths"][0]["course"]["words"] == "steady"
    read = parsed(answer.page)
    assert read.faults == []
    text = read.all("body")[0].text
    for said in ("push_up", "mass all over", "the last third of each recording", "160 nulls"):
        assert said in text


def test_every_outcome_can_be_said_aloud() -> None:
    kept = outcome()
    rejected = replace(kept, decision=Decision.REJECTED)
    nothing = replace(rejected, strengths=(), retest=None)
    said = [spoken(one) for one in (kept, rejected, nothing)]
    assert len(set(said)) == 3
    assert all(len(one.split()) < 25 for one in said)
    assert answer_of(nothing, subject="flag", effect="").tone is Tone.MISSED
