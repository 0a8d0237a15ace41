"""One answer from the verdicts on markers and on films."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flagdata.answer import Quantity
from flagdata.answer.closed import Closed
from measure.closing import join_verdicts, joint_answer
from measure.closing.answer_by_both import spoken
from measure.closing.joint_verdict import Joint, _multiply_likelihoods
from measure.report import answer_of_markers
from measure.report.document import plain
from measure.verdict import CRITERIA, Conclusion, Parameter, Verdict
from tests.golden_answers import changes
from tests.measure.report.pages import parsed
from tests.measure.report.verdicts import verdict

NOMINAL = {"area_weight": 0.2, "bending": 1e-4}


def interval(value: float, sigma: float, *, unit: str = "1") -> Quantity:
    """90 %, of a logarithm known to ± sigma."""
    factor = math.exp(CRITERIA.reach * sigma)
    return Quantity.of(value=value, low=value / factor, high=value * factor, unit=unit)


def judged(conclusion: Conclusion, p: float, *, named: tuple[str, ...] | None = None) -> Verdict:
    found = verdict(conclusion)
    test = replace(found.test, p_value=replace(found.test.p_value, value=p))
    return replace(found, test=test, named=found.named if named is None else named)


def answer_of(found: Joint) -> Closed:
    """The answer, of which both kinds are shown as those by markers, without recordings."""
    kinds = (replace(verdict, residuals=()) for verdict in (found.markers, found.films))
    return joint_answer(found, *map(answer_of_markers, kinds))


def both(markers: Verdict, films: Verdict) -> Joint:
    return join_verdicts(markers, films, level=0.05, nominal=NOMINAL)


@pytest.mark.parametrize(
    ("markers", "films", "conclusion", "p"),
    [
        ((Conclusion.SUFFICIENT, 0.4), (Conclusion.SUFFICIENT, 0.03), Conclusion.SUFFICIENT, 0.06),
        ((Conclusion.SUFFICIENT, 0.4), (Conclusion.SUFFICIENT, 0.7), Conclusion.SUFFICIENT, 0.8),
        ((Conclusion.SUFFICIENT, 0.9), (Conclusion.SUFFICIENT, 0.7), Conclusion.SUFFICIENT, 1.0),
        ((Conclusion.EFFECT, 0.02), (Conclusion.SUFFICIENT, 0.3), Conclusion.EFFECT, 0.04),
        ((Conclusion.SUFFICIENT, 0.4), (Conclusion.UNDECIDED, 0.03), Conclusion.UNDECIDED, 0.06),
        ((Conclusion.UNTESTED, 0.4), (Conclusion.UNDECIDED, 0.3), Conclusion.UNDECIDED, 0.6),
        ((Conclusion.EFFECT, 0.02), (Conclusion.UNDECIDED, 0.03), Conclusion.EFFECT, 0.04),
        ((Conclusion.UNTESTED, 0.1), (Conclusion.UNTESTED, 0.1), Conclusion.UNTESTED, 1.0),
        ((Conclusion.UNTESTED, 0.001), (Conclusion.EFFECT, 0.02), Conclusion.EFFECT, 0.04),
        ((Conclusion.OUTSIDE, 0.02), (Conclusion.EFFECT, 0.02), Conclusion.OUTSIDE, 0.04),
        ((Conclusion.PARTLY, 0.02), (Conclusion.EFFECT, 0.02), Conclusion.PARTLY, 0.04),
    ],
)
def test_the_joint_p_is_twice_the_smaller_and_each_kind_that_rejects_has_its_say(
    markers: tuple[Conclusion, float],
    films: tuple[Conclusion, float],
    conclusion: Conclusion,
    p: float,
) -> None:
    found = both(judged(*markers), judged(*films))
    assert found.conclusion is conclusion
    assert found.p_value == pytest.approx(p)


def test_a_joint_answer_that_is_not_decided_has_the_reasons_and_calls_no_effect_needless() -> None:
    found = both(judged(Conclusion.SUFFICIENT, 0.4), judged(Conclusion.UNDECIDED, 0.2))
    for said in (found.words, answer_of(found).page):
        assert "Nothing is decided" in said
        assert found.films.open[0] in said
        assert "no effect is needed" not in said


def test_what_may_be_missing_is_what_both_kinds_leave() -> None:
    films = judged(Conclusion.ONE_OF, 0.02, named=("lift", "shear"))
    found = both(judged(Conclusion.ONE_OF, 0.02, named=("added-mass", "lift")), films)
    assert (found.conclusion, found.named) == (Conclusion.EFFECT, ("lift",))
    apart = both(judged(Conclusion.EFFECT, 0.02, named=("added-mass",)), films)
    assert (apart.conclusion, apart.named) == (Conclusion.OUTSIDE, ())
    alone = both(judged(Conclusion.SUFFICIENT, 0.5), films)
    assert alone.named == ("lift", "shear")


def test_the_joint_document_is_what_it_was() -> None:
    found = both(
        judged(Conclusion.ONE_OF, 0.02, named=("added-mass", "lift")),
        judged(Conclusion.ONE_OF, 0.02),
    )
    assert changes("joint-verdict", plain(found), relative=1e-9) == []


def test_likelihoods_are_multiplied() -> None:
    """Two of 0.1 about ln 1 and ln 1.1: 0.1/√2 about their mean."""
    found = _multiply_likelihoods("x", interval(1.0, 0.1), interval(1.1, 0.1, unit="m"))
    expected = interval(math.sqrt(1.1), 0.1 / math.sqrt(2), unit="m")
    assert found.together is not None
    for name in ("value", "low", "high"):
        assert getattr(found.together, name) == pytest.approx(getattr(expected, name))
    assert found.together.unit == "m"
    assert found.apart == pytest.approx(math.log(1.1) / (0.1 * math.sqrt(2)))


def test_an_error_that_both_share_is_not_averaged_out() -> None:
    """Intervals of 90 % of both together contain the truth in as many of 4,000 draws."""
    rng, shared, own = np.random.default_rng(1), CRITERIA.strength_factor, (0.3, 0.6)
    held = 0
    for _ in range(4000):
        common = rng.normal(0.0, shared)
        drawn = [
            interval(math.exp(common + rng.normal(0.0, sigma)), math.hypot(sigma, shared))
            for sigma in own
        ]
        found = _multiply_likelihoods("x", *drawn, shared=shared).together
        assert found is not None
        held += found.low <= 1.0 <= found.high
    assert held / 4000 == pytest.approx(0.9, abs=0.015)


def test_an_upper_limit_is_not_combined_and_opposite_signs_are_apart() -> None:
    limit = Quantity.of(value=0.0, low=0.0, high=3.0, unit="1")
    known = interval(1.0, 0.1)
    assert _multiply_likelihoods("x", limit, known).together == known
    assert _multiply_likelihoods("x", None, limit).together == limit
    assert _multiply_likelihoods("x", None, None).together is None
    opposite = Quantity.of(value=-1.0, low=-1.2, high=-0.8, unit="1")
    found = _multiply_likelihoods("x", opposite, known)
    assert found.together is None
    assert found.apart == math.inf


def test_the_cloth_of_markers_is_brought_to_the_films_units_and_the_page_has_both_kinds() -> None:
    markers = replace(
        judged(Conclusion.EFFECT, 0.02),
        parameters=(
            Parameter(
                name="area_weight", before=interval(1.1, 0.1), after=interval(1.0, 0.1), shift=None
            ),
        ),
    )
    films = replace(
        judged(Conclusion.EFFECT, 0.01),
        parameters=(
            Parameter(
                name="area_weight",
                before=interval(0.1, 0.1, unit="kg/m²"),
                after=interval(0.2, 0.1, unit="kg/m²"),
                shift=None,
            ),
        ),
    )
    found = both(markers, films)
    base, with_lift = found.cloth
    assert base.markers is not None
    assert with_lift.together is not None
    assert base.markers.point == pytest.approx(0.22)
    assert base.apart is not None
    assert base.apart > 5
    assert with_lift.together.point == pytest.approx(0.2)
    assert with_lift.together.unit == "kg/m²"
    answer = answer_of(found)
    assert "joint p = 0.020" in found.words
    for text in (
        "By markers: test against simulated nulls",
        "By films: test against simulated nulls",
        "area weight, with lift",
        markers.comparisons[0].what,
    ):
        assert text in answer.page
    read = parsed(answer.page)
    identities = [e.attributes["id"] for e in read.elements if "id" in e.attributes]
    assert read.faults == []
    assert len(identities) == len(set(identities))
    assert answer.document["markers"]["conclusion"] == "effect"
    assert answer.strengths["lift"].unit == films.ranking[0].strength.unit


@pytest.mark.parametrize("conclusion", list(Conclusion))
def test_a_joint_answer_can_be_said_aloud(conclusion: Conclusion) -> None:
    named = {Conclusion.ONE_OF: ("finite-span-loading", "tangential-quadratic-drag", "shear")}
    found = both(judged(Conclusion.EFFECT, 0.02), judged(Conclusion.EFFECT, 0.02))
    said = spoken(replace(found, conclusion=conclusion, named=named.get(conclusion, found.named)))
    assert len(said.split()) < 25
    assert said.endswith(".")


def test_the_first_screen_says_once_what_both_kinds_state_and_how_strong_the_effect_is() -> None:
    found = both(judged(Conclusion.EFFECT, 0.02), judged(Conclusion.EFFECT, 0.02))
    answer = answer_of(found)
    assert answer.sentence == (
        "Something was missing: lift explains what both show; its strength is 0.6 "
        "(0.3 to 1.4, 90 %)."
    )
    assert not any(name.startswith(("markers", "films")) for name in answer.head.facts)
    (share,) = (fact for name, fact in answer.head.facts.items() if name == "with lift")
    assert share.count("explains") == 1
    weaker = both(judged(Conclusion.EFFECT, 0.02), judged(Conclusion.EFFECT, 0.01))
    evidence = answer_of(weaker).head.facts["evidence"]
    assert evidence.startswith("markers: moderate evidence")
    assert "; films: strong evidence" in evidence
    assert answer.subject == "recordings"
