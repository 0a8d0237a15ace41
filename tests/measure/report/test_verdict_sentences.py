"""What the report says of the test and of the comparisons."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flagdata.answer import Quantity
from measure.report import lead, verdict_sentences
from measure.report.verdict_sentences import titles
from measure.report.verdict_words import words
from measure.verdict import Conclusion, NullTest
from tests.measure.report.pages import page_of_words
from tests.measure.report.verdicts import about, verdict


def test_too_few_nulls_for_the_level_are_called_so() -> None:
    test = NullTest(
        statistic=5.0,
        null=[1.0] * 38,
        p_value=about(0.05, 0.01),
        kinds=19,
        level=0.01,
        critical=None,
        nulls="few",
    )
    assert "With 19 kinds of numerics no p-value below 0.05" in verdict_sentences.test_remark(test)
    whole = replace(verdict(Conclusion.UNTESTED), test=test)
    sentence = verdict_sentences.test_sentence(whole)
    assert sentence.startswith("The base model cannot be tested at level 0.01: 0 of 38 groups")
    assert "p = 0.050 is (1 + number of the 19 numerical set-ups" in sentence


def test_the_test_is_reported_with_its_interval_and_the_nulls_that_reach_it() -> None:
    whole = verdict(Conclusion.SUFFICIENT)
    reached = sum(v >= whole.test.statistic for v in whole.test.null)
    sentence = verdict_sentences.test_sentence(whole)
    assert sentence.startswith("The base model is not rejected at level 0.01: ")
    assert (
        f" {reached} of 199 groups of simulations deviate as much as the recordings (statistic "
        "1.13)" in sentence
    )
    p = whole.test.p_value
    assert f"its sampling interval is [{p.low:.2g}, {p.high:.2g}] 90 %" in sentence
    assert verdict_sentences.test_remark(verdict(Conclusion.EFFECT).test) == ""


@pytest.mark.parametrize("conclusion", list(Conclusion))
@pytest.mark.parametrize(
    "findings", [(), (("still-away-from-pins", "A marker between the pins is still."),)]
)
def test_the_p_of_the_global_test_is_stated_once(
    conclusion: Conclusion, findings: tuple[tuple[str, str], ...]
) -> None:
    whole = replace(
        verdict(conclusion), findings=findings, ranking=(), comparisons=(), parameters=()
    )
    whole = replace(whole, test=replace(whole.test, p_value=about(0.0437, 0.01)))
    whole = replace(whole, words=lead(whole))
    stated = " ".join(words(whole).split())
    assert stated.count("p = 0.044") == 1


def test_of_two_strengths_of_one_effect_the_one_that_acts_is_named() -> None:
    """A pole's lean and its sway are weighed apart: one acting does not name the other."""
    whole = verdict(Conclusion.EFFECT)
    lean, sway = (
        replace(c, effect="tilted-pole", parameter=parameter, why_not=why)
        for c, parameter, why in zip(
            whole.ranking, ("lean_angle", "sway"), ("", "far behind"), strict=False
        )
    )
    whole = replace(whole, named=("tilted-pole",), ranking=(lean, sway, *whole.ranking[2:]))
    assert verdict_sentences.named_candidates(whole) == [lean]
    assert verdict_sentences.rejected_candidates(whole) == [sway, *whole.ranking[2:]]
    assert verdict_sentences.heading(whole) == "The base model lacked tilted-pole (lean angle)"
    assert "  not tilted-pole (sway): far behind" in words(whole).splitlines()
    both = replace(
        whole,
        conclusion=Conclusion.ONE_OF,
        ranking=(lean, replace(sway, why_not=""), *whole.ranking[2:]),
    )
    assert titles(both) == ("tilted-pole (lean angle or sway)",)
    assert titles(replace(both, conclusion=Conclusion.EFFECT)) == (
        "tilted-pole (lean angle and sway)",
    )
    said = (
        "The base model lacked tilted-pole (lean angle or sway): these recordings do not decide "
        "which"
    )
    assert verdict_sentences.heading(both) == said
    assert "  not tilted-pole" not in words(both)


def test_of_many_effects_of_which_one_is_missing_the_first_three_are_named_and_the_others_counted() -> (
    None
):
    whole = verdict(Conclusion.ONE_OF)
    names = ("lift", "shear", "slack", "hem-mass", "added-mass", "wet-mass")
    ranking = tuple(
        replace(whole.ranking[0], effect=name, parameter="strength", why_not="") for name in names
    )
    for count, either, joined in (
        (4, "lift, shear, slack and hem-mass", 4),
        (6, "lift, shear, slack and 3 more", 3),
    ):
        found = replace(whole, named=names[:count], ranking=ranking[:count])
        assert (
            verdict_sentences.heading(found)
            == f"The base model lacked one of {either}: these recordings do not decide which"
        )
        assert verdict_sentences.after_label(found) == f"with the best of {either}"
        assert lead(found).count(" or ") == 3
        assert lead(found).count("(strength ") == joined
        assert [name in words(found) for name in names[:count]] == [True] * count


def test_a_base_model_that_is_not_rejected_is_not_called_true() -> None:
    remark = verdict_sentences.test_remark(verdict(Conclusion.SUFFICIENT).test)
    assert remark == "An effect that is too weak to show in these recordings may still act."


def test_a_control_that_does_as_well_as_the_named_effect_is_pointed_out() -> None:
    whole = verdict(Conclusion.EFFECT)
    assert verdict_sentences.control_warnings(whole) == []
    first = whole.comparisons[0]
    failing = replace(
        whole,
        comparisons=(
            replace(first, apart=replace(about(-0.2, 0.9), unit="1")),
            *whole.comparisons[1:],
        ),
    )
    (warning,) = verdict_sentences.control_warnings(failing)
    assert warning.lower().startswith(first.what)
    assert "attribution fails" in warning


def test_a_control_that_fits_as_well_as_the_named_effect_is_reported() -> None:
    whole = verdict(Conclusion.EFFECT)
    near, far = (
        replace(whole.comparisons[0], apart=about(0.3, half, unit="1")) for half in (0.4, 0.2)
    )
    (warning,) = verdict_sentences.control_warnings(replace(whole, comparisons=(near, far)))
    assert warning.endswith(
        "the control tangential-linear-drag and the named effect fit equally well."
    )
    assert "worse by 0.3 [−0.1, 0.7] nat per segment" in words(
        replace(whole, comparisons=(near,))
    ).replace("\n    ", " ")


def test_where_every_part_leaves_two_effects_open_the_warning_adds_what_all_parts_together_decide() -> (
    None
):
    whole = verdict(Conclusion.EFFECT)
    parts = tuple(replace(one, apart=about(0.3, 0.4, unit="1")) for one in whole.comparisons)
    for half, ending in (
        (0.2, "well; over all parts together the named effect does better."),
        (0.4, "well."),
    ):
        decided = replace(whole, comparisons=parts, apart=about(0.3, half, unit="1"))
        (warning,) = verdict_sentences.control_warnings(decided)
        assert warning.startswith(f"In each of the {len(parts)} parts by itself the control")
        assert warning.endswith(f"fit equally {ending}")


@pytest.mark.parametrize(
    ("half", "comparison"), [(0.2, "does better"), (0.4, "the two fit equally well")]
)
def test_the_control_over_all_that_was_left_out_is_summed_up(half: float, comparison: str) -> None:
    whole = replace(verdict(Conclusion.EFFECT), apart=about(0.3, half, unit="1"))
    summary = verdict_sentences.control_summary(whole)
    assert summary.startswith(
        "On recordings left out, tangential-linear-drag instead predicts worse by 0.3"
    )
    assert comparison in summary
    assert summary in page_of_words(whole)
    assert summary in " ".join(words(whole).replace("\n    ", " ").split())
    assert verdict_sentences.control_summary(verdict(Conclusion.EFFECT)) == ""


def test_a_reduction_whose_interval_contains_zero_is_pointed_out() -> None:
    whole = verdict(Conclusion.EFFECT)
    weak = replace(whole.comparisons[0], reduction=about(0.0001, 0.0002))
    (warning,) = verdict_sentences.reduction_warnings(
        replace(whole, comparisons=(weak, *whole.comparisons[1:]))
    )
    assert "the reduction is not significant" in warning


def test_missing_numbers_raise_no_warning() -> None:
    whole = verdict(Conclusion.SUFFICIENT)
    assert all(math.isnan(c.after.point) for c in whole.comparisons)
    assert (
        verdict_sentences.control_warnings(whole) + verdict_sentences.reduction_warnings(whole)
        == []
    )


@pytest.mark.parametrize(
    ("names", "text"), [(["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_names_are_listed_as_people_do(names: list[str], text: str) -> None:
    assert verdict_sentences.list_names(names) == text


@pytest.mark.parametrize(
    ("low", "value", "high", "unit", "said"),
    [
        (0.04, 1.0, 22.7, "of nominal", "not determined by these recordings: 1"),
        (0.4, 1.0, 2.5, "of nominal", "1.0"),
        (0.0, 1.32e-3, 10.8e-3, "s", "at most 11 ms 90 %, best 1.3"),
        (4.0e-3, 26e-3, 60e-3, "s", "26"),
        (0.1, 1.0, 9.0, "°", "1"),
    ],
)
def test_what_recordings_do_not_determine_is_not_shown_like_what_they_do(
    low: float, value: float, high: float, unit: str, said: str
) -> None:
    shown = Quantity.of(value=value, low=low, high=high, unit=unit)
    assert verdict_sentences.parameter_text(shown).startswith(said)


def test_a_floor_above_the_errors_limits_nothing_and_takes_no_significant_reduction_back() -> None:
    first = verdict(Conclusion.EFFECT).comparisons[0]
    high = replace(first, floor=about(2 * first.before.point, 1e-5), share=None)
    whole = replace(verdict(Conclusion.EFFECT), comparisons=(high,))
    assert "above the errors, so that it limits nothing" in verdict_sentences.floor_text(high)
    assert "limits nothing" not in verdict_sentences.floor_text(first)
    assert verdict_sentences.reduction_warnings(whole) == []
    assert "limits nothing" in " ".join(words(whole).split())


def test_several_weak_parts_are_one_warning() -> None:
    whole = verdict(Conclusion.EFFECT)
    weak = tuple(replace(c, reduction=about(0.0001, 0.0002)) for c in whole.comparisons)
    (warning,) = verdict_sentences.reduction_warnings(replace(whole, comparisons=weak))
    assert f"{len(weak)} of {len(weak)} parts" in warning


def test_a_set_up_that_recordings_contradict_leads_a_verdict_that_names_nothing() -> None:
    found = (("still-away-from-pins", "5 markers away from the pins stand as still as these"),)
    calm, named = (
        replace(verdict(c), findings=found) for c in (Conclusion.SUFFICIENT, Conclusion.EFFECT)
    )
    assert verdict_sentences.heading(calm).startswith("The set-up is not as declared")
    assert "5 markers" in verdict_sentences.heading(calm)
    assert verdict_sentences.heading(named) == "The base model lacked lift"


def test_a_pressure_is_named_by_what_its_causes_have_in_common() -> None:
    whole = verdict(Conclusion.EFFECT)
    for effects, said in (
        (("air-density",), "air-density"),
        (("air-density", "porosity"), "air-density or porosity"),
    ):
        ranking = (replace(whole.ranking[0], effect="air-density"), *whole.ranking[1:])
        heading = verdict_sentences.heading(replace(whole, named=effects, ranking=ranking))
        assert heading == f"The base model lacked another dynamic pressure ({said})"


def test_of_many_parts_a_warning_names_the_first_and_counts_the_others() -> None:
    whole = verdict(Conclusion.EFFECT)
    weak = replace(whole.comparisons[0], reduction=about(0.1, 0.5))
    many = tuple(replace(weak, what=f"part {n}") for n in range(16))
    (warning,) = verdict_sentences.reduction_warnings(replace(whole, comparisons=many))
    assert warning.startswith("Part 0, part 1, part 2 and 13 more, 16 of 16 parts: ")
