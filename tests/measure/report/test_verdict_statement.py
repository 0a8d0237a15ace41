"""Sentences about what the library lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.forecasting import Calibration, FieldColumn
from measure.loop import LoopOutcome, Mode
from measure.probes import SpectralLine, Variation
from measure.report import by_draw, lead, with_sentences
from measure.report.verdict_statement import assumptions, blowing, bounds, proposal, shedding
from measure.trajectories import Experiment, Specimen, Trajectory, WindTrack
from measure.verdict import Conclusion
from sim.effects import EFFECTS
from tests.measure.report.verdicts import changed, verdict


def test_the_most_certain_modes_are_reported_first() -> None:
    modes = [
        Mode(column=FieldColumn(axis=0, mode=(1, 0)), value=0.5, error=0.1),
        Mode(column=FieldColumn(axis=1, mode=(0, 0)), value=3.0, error=0.2),
        Mode(column=FieldColumn(axis=2, mode=(2, 0)), value=-4.0, error=1.0),
        Mode(column=FieldColumn(axis=2, mode=(1, 1)), value=9.0, error=9.0),
    ]
    said = proposal(modes)
    first, second, third = said.split(": ", 1)[1].split("; ")
    assert first.startswith("across the wind, all over (3")
    assert second.startswith("along the wind, hoist against fly (0.5")
    assert third.startswith("up, both ends against the middle (−4")
    assert "corner" not in said
    assert "fits the remaining errors best, per mass: across" in proposal(modes, is_all=False)


def test_a_strength_that_is_another_in_every_recording_is_reported_with_its_values() -> None:
    partly = verdict(Conclusion.PARTLY)
    assert "the errors that remain are larger than those of simulations" in lead(partly)
    ranking = [replace(c, heterogeneity=None if c.why_not else 0.001) for c in partly.ranking]
    said = lead(replace(partly, ranking=tuple(ranking)))
    each = ", ".join(
        f"{e.value:.2g}" for e in next(c for c in ranking if not c.why_not).by_recording
    )
    assert f"fitted to each recording alone it is {each}" in said
    assert "another dependence on the wind would fit better" in said
    assert "the errors that remain" not in said


def test_a_line_is_reported_as_a_cylinders_vortex_shedding() -> None:
    # A Strouhal number of 0.2: 1.33 Hz for each m/s is a width of 0.15 m.
    said = shedding(SpectralLine(far=9.0, reduced=0.2 / 0.15, direction=1))
    assert "across the wind at 1.3 Hz for each m/s" in said
    assert "0.15 m" in said


def test_a_course_that_is_not_turbulence_is_given_in_percent_of_the_wind() -> None:
    said = blowing(
        Variation(total=np.array([0.0169, -0.0001, 0.03]), fast=np.array([0.0144, 0.0, 0.02]))
    )
    expected = (
        "varies by 13 % of its mean along its own direction, by 12 % within two seconds, and by 0 "
        "% across it"
    )
    assert expected in said


@pytest.mark.parametrize(
    ("damping", "expected"),
    [(2.5e-3, ""), (60e-3, ""), (5.0, "bound of damping: its interval is not reliable")],
)
def test_a_fit_that_ends_at_a_bound_says_so(damping: float, expected: str) -> None:
    ended = Calibration().moved((0.0, 0.0, float(np.log(damping / 2.5e-3))))
    said = " ".join(bounds(ended.at_bounds))
    assert (expected in said) if expected else said == ""


def test_a_level_that_cannot_be_tested_says_what_is_needed() -> None:
    few = verdict(Conclusion.SUFFICIENT)
    untested = replace(
        few, conclusion=Conclusion.UNTESTED, test=replace(few.test, kinds=20, level=0.03)
    )
    assert "no p is below 0.048; at least 33 are needed." in lead(untested)


def test_a_test_that_another_draw_could_decide_otherwise_says_so_and_what_would_settle_it() -> None:
    test = replace(verdict(Conclusion.EFFECT).test, level=0.05, open=True, settling=59)
    test = replace(test, p_value=changed(test.p_value, value=0.024, low=0.0, high=0.072))
    (remark,) = by_draw(test)
    assert (
        remark
        == "The evidence is borderline; rerun with --nulls 236 (59 numerical set-ups) to decide."
    )
    assert "more than 1000 numerical set-ups" in by_draw(replace(test, settling=None))[0]
    assert by_draw(replace(test, open=False)) == ()


@pytest.fixture
def outcome(specimen: Specimen) -> LoopOutcome:
    """An outcome of one recording for which the library has no answer."""
    recording = Trajectory(
        name="first",
        markers=specimen.mesh.rest,
        positions=np.zeros((100, specimen.mesh.vertex_count, 3)),
        rate=25.0,
        wind=WindTrack.constant((4.0, 0.0, 0.0)),
    )
    numbers = replace(
        verdict(Conclusion.OUTSIDE),
        words="",
        proposal="",
        separating="",
        assumptions=(),
        unweighed=(),
        copied=(),
        ranking=(),
        named=(),
    )
    return LoopOutcome(
        verdict=numbers,
        experiment=Experiment(specimen=specimen, recordings=(recording,)),
        lags=(0.5,),
        at_bounds=("damping",),
        field=(Mode(column=FieldColumn(axis=1, mode=(0, 0)), value=3.0, error=0.2),),
        line=SpectralLine(far=9.0, reduced=0.2 / 0.15, direction=1),
        course=Variation(total=np.array([0.0169, 0.0, 0.0]), fast=np.array([0.0144, 0.0, 0.0])),
    )


def test_an_outcome_without_an_answer_is_stated_with_its_line_its_course_and_its_field_in_this_order(
    outcome: LoopOutcome,
) -> None:
    said = with_sentences(outcome)
    assert said.words.startswith(lead(outcome.verdict))
    assert "at the bound of damping" in said.words
    assert (
        said.proposal.index("as vortices")
        < said.proposal.index("a wind that varies")
        < said.proposal.index("force")
    )
    assert "that fits the errors best" in said.proposal
    assert said.assumptions[-1].endswith("was moved: first by 0.50 s")
    numbers = replace(
        said, words="", proposal="", separating="", assumptions=(), unweighed=(), copied=()
    )
    assert numbers == outcome.verdict


def test_what_was_not_weighed_is_listed_with_its_reason_and_what_is_copied_with_what_would_show_it(
    outcome: LoopOutcome,
) -> None:
    said = with_sentences(outcome)
    unweighed = dict(said.unweighed)
    assert unweighed["slack"].startswith("it needs films: ")
    assert unweighed["internal-damping"] == "the cloth's damping is calibrated"
    assert unweighed["lift"] == "the cloth cannot have it as it is held and in its wind"
    assert set(unweighed) == set(EFFECTS)
    told = replace(outcome.experiment.specimen, area_weight_uncertainty=0.03)
    weighed = replace(outcome, experiment=replace(outcome.experiment, specimen=told))
    assert {*dict(said.copied)} - {*dict(with_sentences(weighed).copied)} == {"wet-mass"}
    assert (
        "the cloth's area weight, stated to a few percent, would show it"
        in (dict(said.copied)["wet-mass"])
    )


def test_a_field_beside_a_named_effect_is_of_what_remains(outcome: LoopOutcome) -> None:
    falling = Variation(total=np.array([-0.01, 0.0, 0.0]), fast=np.array([0.0, 0.0, 0.0]))
    said = with_sentences(replace(outcome, whole=False, line=None, course=falling)).proposal
    assert said.startswith("The smooth force field that fits the remaining errors best")


def test_an_outcome_with_an_answer_says_what_remains_and_proposes_nothing(
    outcome: LoopOutcome,
) -> None:
    answered = replace(outcome, field=(), course=None)
    remains = with_sentences(answered).proposal
    assert remains.startswith("The errors oscillate")
    assert "force field" not in remains
    assert with_sentences(replace(answered, line=None)).proposal == ""


@pytest.mark.parametrize(
    ("known", "expected", "weigh"),
    [(0.3, "known to 30 %", True), (0.1, "known to 10 %", True), (0.02, "known to 2 %", False)],
)
def test_how_well_the_cloth_was_weighed_is_an_assumption(
    outcome: LoopOutcome, known: float, expected: str, weigh: bool
) -> None:
    specimen = replace(outcome.experiment.specimen, area_weight_uncertainty=known)
    (said,) = (
        text
        for text in assumptions(replace(outcome.experiment, specimen=specimen))
        if "area weight is known" in text
    )
    assert expected in said
    assert ("0.284±0.006" in said) == weigh


def test_an_unweighed_cloths_density_is_not_listed_as_known(outcome: LoopOutcome) -> None:
    specimen = replace(outcome.experiment.specimen, area_weight_uncertainty=None)
    assert not any(
        "area weight is known" in t
        for t in assumptions(replace(outcome.experiment, specimen=specimen))
    )
