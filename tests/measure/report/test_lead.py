"""The first sentence: what was found, how large, how sure; each once."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flagdata.answer import Bound, Quantity
from measure.report import lead
from measure.report.lead_sentences import evidence, explained_words, p_text, spoken
from measure.verdict import Conclusion, with_level
from tests.measure.report.pages import page_of_words, parsed
from tests.measure.report.verdicts import about, changed, verdict


@pytest.mark.parametrize(
    ("p", "word"),
    [
        (0.0004, "very strong"),
        (0.001, "very strong"),
        (0.004, "strong"),
        (0.024, "moderate"),
        (0.08, "weak"),
        (0.4, "little or no"),
    ],
)
def test_the_evidence_has_the_words_of_its_source(p: float, word: str) -> None:
    test = verdict(Conclusion.EFFECT).test
    assert evidence(replace(test, p_value=replace(test.p_value, value=p))) == f"{word} evidence"


def test_an_effect_is_named_with_its_size_its_share_of_the_error_and_one_p() -> None:
    whole = verdict(Conclusion.EFFECT)
    whole = replace(
        whole, test=replace(whole.test, level=0.05, p_value=about(0.024, 0.0, unit="1"))
    )
    whole = replace(
        whole, test=replace(whole.test, p_value=changed(whole.test.p_value, low=0.0, high=0.07))
    )
    said = lead(whole)
    strength = next(c.strength for c in whole.ranking if c.effect == "lift")
    assert said.startswith(f"Adding lift (coefficient {strength.value:.2f} [")
    assert f" explains {explained_words(whole)}; " in said
    assert said.endswith(
        "moderate evidence that something was missing, p = 0.024, could be up to 0.070."
    )
    assert said.count("p = ") == 1


@pytest.mark.parametrize(
    ("conclusion", "word"), [(Conclusion.EFFECT, "and"), (Conclusion.ONE_OF, "or")]
)
def test_several_strengths_of_one_effect_are_one_effect(conclusion: Conclusion, word: str) -> None:
    """Of six candidates, two are of one effect: the first three effects are named, and not "2 more"
    of them."""
    whole = verdict(conclusion)
    lean, sway, *others = (replace(one, why_not="") for one in whole.ranking[:5])
    lean, sway = (
        replace(one, effect="tilted-pole", parameter=name)
        for one, name in ((lean, "lean"), (sway, "sway"))
    )
    few = replace(whole, ranking=(lean, sway), named=("tilted-pole",))
    sizes = [with_level(one.strength) for one in (lean, sway)]
    assert lead(few).startswith(f"Adding tilted-pole (lean {sizes[0]} {word} sway {sizes[1]}) ")
    several = replace(
        whole, ranking=(lean, *others, sway), named=("tilted-pole", *(one.effect for one in others))
    )
    assert lead(several).count("tilted-pole") == 1
    assert "more" not in lead(several).split("explains")[0]


def test_what_is_explained_is_pooled_over_what_lies_above_the_floor() -> None:
    whole = verdict(Conclusion.EFFECT)
    lower = replace(
        whole.comparisons[0],
        before=about(2.0, 0.1),
        after=about(1.0, 0.1),
        floor=about(0.5, 0.1),
        share=0.8,
    )
    same = replace(lower, before=about(1.0, 0.1), share=0.0)  # not improved: counts as well
    below = replace(
        lower, before=about(0.4, 0.1), after=about(0.1, 0.1), share=None
    )  # than the floor: does not
    of = "of the error that a better model could remove"
    assert (
        explained_words(replace(whole, comparisons=(lower,))) == f"80 % {of}"
    )  # (4 − 1) / (4 − 1/4)
    # (3/4 + 0) / (15/16 + 3/4)
    assert explained_words(replace(whole, comparisons=(lower, same, below))) == f"44 % {of}"


def test_without_a_share_the_error_itself_is_compared() -> None:
    whole = verdict(Conclusion.EFFECT)
    halved = tuple(
        replace(c, share=None, before=about(2.0, 0.1), after=about(1.0, 0.1))
        for c in whole.comparisons
    )
    assert explained_words(replace(whole, comparisons=halved)) == "75 % of the squared error"
    assert explained_words(replace(whole, comparisons=())) == ""
    worse = replace(whole.comparisons[0], before=about(1.0, 0.1), after=about(1.1, 0.1))
    assert (
        explained_words(replace(whole, comparisons=(worse,))) == "none of the error on unseen data"
    )


def test_an_upper_end_that_is_the_value_is_not_repeated() -> None:
    test = verdict(Conclusion.EFFECT).test
    assert (
        p_text(replace(test, p_value=changed(test.p_value, value=0.024, high=0.024))) == "p = 0.024"
    )


@pytest.mark.parametrize("conclusion", list(Conclusion))
def test_the_page_begins_with_the_sentence_and_what_is_folded_comes_last(
    conclusion: Conclusion,
) -> None:
    whole = replace(verdict(conclusion), words="")
    whole = replace(whole, words=f"{lead(whole)} More.")
    html = page_of_words(whole)
    read = parsed(html)
    assert read.classed("verdict")[0].text.strip() == spoken(whole)
    first_screen = html[html.index("<body>") : html.index("<details")]
    assert "<li>More.</li>" in first_screen
    assert "family-wise" not in first_screen
    assert "<section" not in html
    assert {e.text for e in read.all("dt")} >= {"null", "floor", "E_red", "p"}


def test_the_chart_is_in_per_cent_of_the_base_models_error() -> None:
    whole = verdict(Conclusion.EFFECT)
    first = whole.comparisons[0]
    svg = next(
        e
        for e in parsed(page_of_words(whole)).all("svg")
        if "per cent" in e.attributes.get("aria-label", "")
    )
    share = 100 * first.after.point / first.before.point
    assert f"{first.what}: {share:.0f} % with lift" in svg.attributes["aria-label"]


def test_a_verdict_can_be_said_aloud() -> None:
    """In fewer than 25 words, with a bound in words, whatever is concluded of whatever effects."""
    whole = verdict(Conclusion.EFFECT)
    bound = Quantity.of(
        value=0.35, low=0.35, high=math.inf, unit="kg/m²", level=0.95, bound=Bound.LEAST
    )
    rain = replace(whole.ranking[0], effect="wet-mass", parameter="uptake", strength=bound)
    named = replace(whole, named=("wet-mass",), ranking=(rain,))
    assert spoken(named) == (
        "Something was missing: wet mass explains it; its uptake is at least 0.35 kg/m² (95 %)."
    )
    many = ("tangential-linear-drag", "finite-span-loading", "shear", "lift", "added-mass")
    for conclusion in Conclusion:
        for effects in ((), many[:1], many[:2], many):
            said = spoken(replace(verdict(conclusion), named=effects))
            assert len(said.split()) < 25, said
