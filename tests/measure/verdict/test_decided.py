"""When a base model that is not rejected suffices, and where no model explains recordings."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from measure.report import lead, verdict_sentences
from measure.report.lead_sentences import spoken
from measure.report.verdict_sentences import error_warnings, heading, power_text
from measure.report.verdict_words import words
from measure.verdict import NOT_REJECTED, Conclusion, Power, Verdict, erring, undecided_sentences
from tests.measure.report.pages import page_of_words
from tests.measure.report.verdicts import about, verdict

SEEN = (0.9, 0.2, 0.4)


def test_what_would_have_been_seen_and_was_not_is_not_there() -> None:
    assert undecided_sentences(0.4, level=0.05, departure=1.1, power=SEEN) == ()


@pytest.mark.parametrize(
    ("p", "departure", "power", "said"),
    [
        (0.1, 1.1, SEEN, "within a factor of 2 of the level 0.05"),
        (0.4, 2.1, SEEN, "by 2.1 of their scatters"),
        (0.4, 1.1, (0.5, 0.05, 0.05), "with a chance of 0.20 on average"),
        (0.4, 1.1, (), "with a chance of 0 on average"),
    ],
)
def test_each_doubt_leaves_it_undecided(
    p: float, departure: float, power: tuple[float, ...], said: str
) -> None:
    (reason,) = undecided_sentences(p, level=0.05, departure=departure, power=power)
    assert said in reason


def test_all_doubts_are_stated_together() -> None:
    assert len(undecided_sentences(0.06, level=0.05, departure=9.0, power=(0.0,))) == 3


@pytest.mark.parametrize(
    ("p", "departure", "power"), [(0.1001, 2.0, (0.3,)), (1.0, 0.0, (0.1, 0.5))]
)
def test_at_the_thresholds_themselves_it_suffices(
    p: float, departure: float, power: tuple[float, ...]
) -> None:
    assert undecided_sentences(p, level=0.05, departure=departure, power=power) == ()


def test_what_is_not_decided_is_reported_with_its_reasons_and_no_effect_is_called_needless() -> (
    None
):
    one = verdict(Conclusion.UNDECIDED)
    assert one.conclusion in NOT_REJECTED
    said = lead(one)
    assert said.startswith("Nothing is decided: the base model is not rejected, p = ")
    assert one.open[0] in said
    for text in (said, heading(one), page_of_words(one)):
        assert "no effect is needed" not in text.lower()
        assert "no effect needed" not in text.lower()
    assert "explains these recordings" not in said + heading(one)


def with_errors(conclusion: Conclusion, *, before: float, after: float) -> Verdict:
    """Whose first comparison errs by so many floors."""
    whole = verdict(conclusion)
    first, *others = whole.comparisons
    later = after if whole.named else math.nan
    floor, reduction = about(1.0, 0.1), about(after, 0.1)
    first = replace(
        first, floor=floor, before=about(before, 0.1), after=about(later, 0.1), reduction=reduction
    )
    within = about(1.2 if whole.named else math.nan, 0.1)
    rest = [replace(one, floor=floor, before=about(1.5, 0.1), after=within) for one in others]
    return replace(whole, comparisons=(first, *rest))


@pytest.mark.parametrize("conclusion", list(Conclusion))
def test_a_model_that_errs_by_more_than_three_floors_explains_nothing(
    conclusion: Conclusion,
) -> None:
    for off, errs in ((2.9, False), (3.1, True)):
        one = with_errors(conclusion, before=9.0 if verdict(conclusion).named else off, after=off)
        one = replace(one, findings=(), words=lead(one))
        assert bool(erring(one)) is errs
        said = f"{lead(one)} {heading(one)} {spoken(one)}"
        if errs:
            assert "explains" not in said.replace("no effect of the library explains", "")
            (warning,) = error_warnings(one)
            assert f"{one.comparisons[0].what} by 3.1" in warning
            assert warning in page_of_words(one)
            assert "Nothing that was checked" not in page_of_words(one)
        else:
            assert error_warnings(one) == []


def test_an_unknown_error_is_none_that_is_too_large() -> None:
    whole = verdict(Conclusion.SUFFICIENT)
    first = replace(whole.comparisons[0], before=about(math.nan, 0.1))
    second = replace(whole.comparisons[0], floor=about(math.nan, 0.1))
    assert erring(replace(whole, comparisons=(first, second))) == []


def test_the_power_is_stated_for_each_effect_and_on_average() -> None:
    whole = replace(
        verdict(Conclusion.SUFFICIENT),
        power=(
            Power(effect="lift", parameter="coefficient", strength=2.3, unit="1", share=0.9),
            Power(
                effect="hem-mass", parameter="line_density", strength=0.025, unit="kg/m", share=0.3
            ),
        ),
    )
    said = power_text(whole)
    assert "with a chance of 0.60 on average" in said
    assert "lift (coefficient) 2.3 with 0.90" in said
    assert "hem-mass (line density) 0.025 kg/m with 0.30" in said
    assert power_text(verdict(Conclusion.SUFFICIENT)) == ""


def test_a_suspicion_is_reported_as_stated_beforehand_and_flags_are_counted_as_what_they_are() -> (
    None
):
    whole = verdict(Conclusion.SUFFICIENT)
    counted = replace(
        whole.test, effective=152.0, correlation=0.01, tail=0.34, kinds=20, suspected="lift+"
    )
    said = verdict_sentences.test_sentence(replace(whole, test=counted))
    assert "along lift+ alone, suspected before the recordings were looked at," in said
    assert "(1 + 152 × the share of null flags that deviate as much) / (1 + 152)" in said
    assert "correlated by 0.010" in said
    assert "it would be 0.34" in said
    assert counted.least == 1 / 153
    assert "suspected" not in verdict_sentences.test_sentence(whole)


def test_the_power_stands_before_the_verdicts_sentence_and_in_a_table() -> None:
    shown = (Power(effect="lift", parameter="coefficient", strength=2.3, unit="1", share=0.9),)
    whole = replace(verdict(Conclusion.SUFFICIENT), power=shown)
    said, html = words(whole), page_of_words(whole)
    mean = (
        "An effect of the strength that is expected of it would be seen with a chance of 0.90 on "
        "average."
    )
    on_terminal = " ".join(said.split())
    assert 0 <= on_terminal.index(mean) < on_terminal.index(whole.words)
    assert f"<li>{mean}</li>" in html
    assert "What would have been seen" in html
    assert "lift (coefficient) 2.3 with 0.90" in " ".join(said.split())
    without = verdict(Conclusion.SUFFICIENT)
    assert "would be seen with a chance" not in words(without) + page_of_words(without)


def test_a_page_of_markers_says_that_a_suspicion_was_stated_beforehand() -> None:
    whole = verdict(Conclusion.EFFECT)
    assert "stated beforehand" not in page_of_words(whole)
    whole = replace(whole, test=replace(whole.test, suspected="lift+"))
    for text in (page_of_words(whole), " ".join(words(whole).split())):
        assert "along lift+ alone, suspected before the recordings were looked at" in text
    assert "stated beforehand" in page_of_words(whole)
