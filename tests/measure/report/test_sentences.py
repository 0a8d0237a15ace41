"""What the report says of the test and of the comparisons."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from measure.loop.titles import titles
from measure.loop.verdict import Conclusion, NullTest
from measure.report import sentences
from measure.report.words import words
from tests.measure.report.verdicts import about, verdict


def null_test(null: list[float], statistic: float, level: float) -> NullTest:
    reached = sum(v >= statistic for v in null)
    return NullTest(statistic=statistic, null=null, p_value=(1 + reached) / (1 + len(null)), level=level, nulls="")


def test_the_interval_of_a_p_value_without_a_larger_null_is_clopper_and_pearsons_closed_form() -> None:
    """With none of n reached, the upper end at 90 % is 1 − 0.05^(1/n), the lower 0."""
    spread = sentences.p_interval(null_test([1.0] * 199, 2.0, 0.01))
    assert spread is not None
    assert spread.low == 0
    assert spread.high == pytest.approx(1 - 0.05 ** (1 / 199), rel=1e-9)


def test_nothing_is_said_of_a_p_value_without_nulls() -> None:
    assert sentences.p_interval(null_test([], 2.0, 0.01)) is None


def test_the_critical_value_is_the_one_that_leaves_room_for_the_allowed_nulls() -> None:
    """99 nulls 1…99 at level 0.03: p ≤ 0.03 allows 2 nulls at least as large (98, 99), so 97 has to be exceeded."""
    nulls = [float(v) for v in range(1, 100)]
    assert sentences.critical_value(null_test(nulls, 0.0, 0.03)) == 97.0
    for statistic, significant in ((97.0, False), (97.5, True)):
        test = null_test(nulls, statistic, 0.03)
        assert (test.p_value <= test.level) is significant


def test_too_few_nulls_for_the_level_are_called_so() -> None:
    test = null_test([1.0] * 19, 5.0, 0.01)
    assert sentences.critical_value(test) is None
    assert "no p-value below 0.05" in sentences.test_remark(test)


def test_a_p_value_of_a_tail_gets_no_interval_and_no_critical_value() -> None:
    """p is not the share of the nulls shown, so nothing is derived from that share."""
    alone = null_test([float(v) for v in range(1, 100)], 98.5, 0.05)
    combined = replace(alone, p_value=alone.p_value / 0.8)
    assert sentences.critical_value(alone) is not None
    assert sentences.p_interval(alone) is not None
    assert sentences.critical_value(combined) is None
    assert sentences.p_interval(combined) is None
    assert "exponential tail" in sentences.test_sentence(combined)
    assert "tail" not in sentences.test_sentence(alone)


def test_of_two_strengths_of_one_effect_the_one_that_acts_is_named() -> None:
    """A pole's lean and its sway are weighed apart: one acting does not name the other."""
    whole = verdict(Conclusion.EFFECT)
    lean, sway = (
        replace(c, effect="tilted-pole", parameter=parameter, why_not=why)
        for c, parameter, why in zip(whole.ranking, ("lean_angle", "sway"), ("", "far behind"), strict=False)
    )
    whole = replace(whole, named=("tilted-pole",), ranking=(lean, sway, *whole.ranking[2:]))
    assert sentences.named_candidates(whole) == [lean]
    assert sentences.rejected(whole) == [sway, *whole.ranking[2:]]
    assert sentences.heading(whole) == "The base model lacked tilted-pole (lean angle)"
    assert "  not tilted-pole (sway): far behind" in words(whole).splitlines()
    both = replace(whole, conclusion=Conclusion.ONE_OF, ranking=(lean, replace(sway, why_not=""), *whole.ranking[2:]))
    assert titles(both) == ("tilted-pole (lean angle)", "tilted-pole (sway)")


def test_a_base_model_that_is_not_rejected_is_not_called_true() -> None:
    remark = sentences.test_remark(null_test([1.0, 2.0, 3.0] * 50, 2.5, 0.05))
    assert remark == "An effect too weak for these recordings to show may still be there."


def test_a_control_that_does_as_well_as_the_named_effect_is_pointed_out() -> None:
    whole = verdict(Conclusion.EFFECT)
    assert sentences.control_warnings(whole) == []
    first = whole.comparisons[0]
    failing = replace(
        whole, comparisons=(replace(first, apart=replace(about(-0.2, 0.9), unit="1")), *whole.comparisons[1:])
    )
    (warning,) = sentences.control_warnings(failing)
    assert warning.lower().startswith(first.what)
    assert "attribution fails" in warning


def test_a_control_that_cannot_be_told_from_the_named_effect_is_pointed_out() -> None:
    whole = verdict(Conclusion.EFFECT)
    near, far = (replace(whole.comparisons[0], apart=about(0.3, half, unit="1")) for half in (0.4, 0.2))
    (warning,) = sentences.control_warnings(replace(whole, comparisons=(near, far)))
    assert "cannot be told from the named effect" in warning
    assert "worse by 0.3 [−0.1, 0.7] nat a segment" in words(replace(whole, comparisons=(near,))).replace("\n    ", " ")


def test_a_reduction_whose_interval_holds_zero_is_pointed_out() -> None:
    whole = verdict(Conclusion.EFFECT)
    weak = replace(whole.comparisons[0], reduction=about(0.0001, 0.0002))
    (warning,) = sentences.reduction_warnings(replace(whole, comparisons=(weak, *whole.comparisons[1:])))
    assert "cannot be told from zero" in warning


def test_missing_numbers_raise_no_warning() -> None:
    whole = verdict(Conclusion.SUFFICIENT)
    assert all(math.isnan(c.after.value) for c in whole.comparisons)
    assert sentences.control_warnings(whole) + sentences.reduction_warnings(whole) == []


@pytest.mark.parametrize(("names", "text"), [(["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")])
def test_names_are_listed_as_people_do(names: list[str], text: str) -> None:
    assert sentences.listed(names) == text
