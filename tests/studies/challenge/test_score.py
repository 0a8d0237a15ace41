"""The score says of fitters whose worth is known what they are worth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flagdata.answer import Bound, Quantity
from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.verdict import Candidate, Conclusion, Verdict
from sim.effects import EFFECTS
from tests.studies.challenge import sheet as sheets
from tests.studies.challenge.answer_key import AnswerKey
from tests.studies.challenge.cases import (
    acting,
    candidate,
    comparison,
    estimate,
    filing,
    key,
    verdict,
)
from tests.studies.challenge.classes import class_of, classes
from tests.studies.challenge.outcome import Outcome
from tests.studies.challenge.rates import Power
from tests.studies.challenge.recipe import Kind
from tests.studies.challenge.score import Sheet, graded
from tests.studies.shares import Share

LIBRARY = ("lift", "added-mass", "pole-wake", "shear", "full-hoist")


def keys(count: int = 40) -> list[AnswerKey]:
    """Of each kind so many; impacts from 0.3 to 30 mm."""
    impacts = np.geomspace(3e-4, 3e-2, count)
    made = [key(f"n{i}", Kind.NULL) for i in range(count)]
    for i, impact in enumerate(impacts.tolist()):
        one, other = LIBRARY[i % 5], LIBRARY[(i + 1) % 5]
        options = {"impact": impact, "noise": (0.0, 0.004)[i % 2], "rate": (25, 60)[i // 2 % 2]}
        made.append(key(f"o{i}", Kind.ONE, acting(one), **options))
        made.append(key(f"p{i}", Kind.PAIR, acting(one), acting(other), **options))
        made.append(key(f"x{i}", Kind.OUTSIDE, acting("tether"), **options))
    return made


def sheet(judge, sets: list[AnswerKey] | None = None) -> Sheet:
    chosen = keys() if sets is None else sets
    return graded("made by hand", [Outcome.of(k, filing(k.name, judge(k))) for k in chosen])


def knowing(k: AnswerKey) -> Verdict:
    """Says what is true."""
    if k.kind is Kind.NULL:
        return verdict(Conclusion.SUFFICIENT)
    if k.kind is Kind.OUTSIDE:
        return verdict(Conclusion.OUTSIDE)
    return verdict(Conclusion.EFFECT, *(a.effect for a in k.effects))


def test_who_knows_the_truth_scores_everything() -> None:
    result = sheet(knowing)
    assert all(gate.met for gate in result.gates)
    good = (
        "top-1, strong",
        "class-level, strong",
        "recall of none of the library",
        "control separated",
        "interval covers the true strength",
        "pairs: both classes found",
        "true effect among those named",
    )
    bad = (
        "false positives on nulls",
        "false discoveries among claims",
        "data refused",
        "none of the library, said wrongly of one effect",
    )
    assert [result.shares[name].value for name in good] == [1.0] * len(good)
    assert [result.shares[name].value for name in bad] == [0.0] * len(bad)


def test_a_fitter_that_names_nothing_is_never_wrong_on_nulls_and_finds_nothing() -> None:
    result = sheet(lambda k: verdict(Conclusion.SUFFICIENT))
    assert result.false_positives.value == 0
    assert result.outside_recall.value == 0
    assert result.shares["detected: one effect"].value == 0
    assert result.reductions == []
    assert [gate.name for gate in result.gates if gate.met] == ["false positives on nulls"]


def test_what_is_not_decided_is_neither_detected_nor_a_false_positive_and_is_counted() -> None:
    result = sheet(lambda k: verdict(Conclusion.UNDECIDED))
    assert result.false_positives.value == 0
    assert result.shares["detected: one effect"].value == 0
    assert (
        result.shares["not decided"].value == result.shares["not decided, of one effect"].value == 1
    )
    assert sheet(lambda k: verdict(Conclusion.SUFFICIENT)).shares["not decided"].value == 0


def test_who_guesses_scores_what_chance_gives() -> None:
    """Always rejecting, with one of five effects at random: top-1 is 1/5, every null a false
    positive; of the claims, right are 1/5 on one effect and 2/5 on pairs, none elsewhere: 0.6/4 of
    all."""
    rng = stream(1, "guess")
    many = keys(200)
    result = sheet(lambda k: verdict(Conclusion.EFFECT, LIBRARY[int(rng.integers(5))]), many)
    assert result.false_positives.value == 1
    # Three standard deviations of a share among 200, and among 800.
    assert result.shares["top-1, all of one effect"].value == pytest.approx(
        0.2, abs=3 * math.sqrt(0.16 / 200)
    )
    assert result.false_discoveries.value == pytest.approx(
        0.85, abs=3 * math.sqrt(0.85 * 0.15 / 800)
    )


def test_who_sees_from_a_threshold_on_has_the_half_detection_strength_there() -> None:
    """Detected from 3 mm on; identification is graded from 6 mm, where it is complete."""
    result = sheet(
        lambda k: knowing(k) if k.impact >= 3e-3 else verdict(Conclusion.SUFFICIENT), keys(100)
    )
    assert result.power is not None
    for half, low, high in result.power.half.values():
        assert half == pytest.approx(
            3e-3, rel=0.25
        )  # the spacing of a class's strengths is 5 %, of neighbours 26 %
        assert low < half < high
    assert all(o.key.impact > 5e-3 for o in result.strong)
    assert result.shares["top-1, strong"].value == 1
    assert all(o.key.impact > 5e-3 for o in result.strong_outside)
    assert result.shares["recall of none of the library, strong"].value == 1
    assert result.outside_recall.value == pytest.approx(0.5, abs=0.05)
    assert result.shares["top-1, all of one effect"].value == pytest.approx(0.5, abs=0.02)


def test_half_strengths_are_in_the_effects_own_units() -> None:
    """Strengths of 100 an impact of a metre, detected from 3 mm on: half at 0.3."""
    sets = [
        key(f"{i}", Kind.ONE, acting("lift", 100 * s), impact=s)
        for i, s in enumerate(np.geomspace(3e-4, 3e-2, 40))
    ]
    result = sheet(
        lambda k: verdict(Conclusion.EFFECT if k.impact >= 3e-3 else Conclusion.SUFFICIENT), sets
    )
    # The spacing is 12 %.
    assert result.half_strengths["lift"].value == pytest.approx(0.3, rel=0.12)
    assert result.half_strengths["lift"].unit == "1"


def test_power_separates_what_noise_hides() -> None:
    """A threshold of 1 mm without noise and of 10 mm with it."""
    result = sheet(
        lambda k: (
            knowing(k)
            if k.impact >= (1e-2 if k.noise else 1e-3)
            else verdict(Conclusion.SUFFICIENT)
        ),
        keys(100),
    )
    assert result.by_noise is not None
    assert result.by_noise.half["0"][0] == pytest.approx(1e-3, rel=0.4)
    assert result.by_noise.half["4"][0] == pytest.approx(1e-2, rel=0.4)
    assert result.by_rate is not None
    rates = [half[0] for half in result.by_rate.half.values()]
    assert rates[0] == pytest.approx(rates[1], rel=0.5)


def test_another_effect_of_the_class_is_right_at_class_level_only() -> None:
    sets = [key("a", Kind.ONE, acting("tangential-linear-drag"))]
    outcome = sheet(
        lambda k: verdict(Conclusion.EFFECT, "tangential-quadratic-drag"), sets
    ).outcomes[0]
    assert (outcome.first_right, outcome.class_right, outcome.claims) == (False, True, (True,))


def test_equivalent_effects_are_one_claim() -> None:
    said = verdict(Conclusion.EFFECT, "air-density", "porosity")
    assert Outcome.of(key("a", Kind.ONE, acting("permeability")), filing("a", said)).claims == (
        True,
    )
    assert Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", said)).claims == (False,)


def test_one_of_several_is_one_claim_and_its_best_ranked_is_the_first() -> None:
    said = verdict(
        Conclusion.ONE_OF, "shear", "lift", ranking=(candidate("lift"), candidate("shear"))
    )
    true = Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", said))
    assert (true.first, true.first_right, true.among_named, true.claims) == (
        "lift",
        True,
        True,
        (True,),
    )
    false = Outcome.of(key("a", Kind.ONE, acting("pole-wake")), filing("a", said))
    assert (false.first_right, false.among_named, false.claims) == (False, False, (False,))
    assert true.control_gap is None


def test_a_refusal_is_a_false_positive_on_a_null_and_no_detection_elsewhere() -> None:
    made = [key("a", Kind.NULL), key("b", Kind.OUTSIDE, acting("tether"))]
    result = graded("x", [Outcome.of(k, filing(k.name, None)) for k in made])
    assert result.false_positives.value == 1
    assert result.outside_recall.value == 0
    assert result.shares["data refused"].value == 1


def test_naming_an_effect_where_something_else_acts_is_a_false_discovery() -> None:
    outcome = Outcome.of(
        key("x", Kind.OUTSIDE, acting("tether")), filing("x", verdict(Conclusion.PARTLY, "lift"))
    )
    assert outcome.outside_said
    assert outcome.claims == (False,)


def test_the_corrective_field_names_no_effect() -> None:
    outcome = Outcome.of(
        key("x", Kind.OUTSIDE, acting("tether")),
        filing("x", verdict(Conclusion.OUTSIDE, "corrective-field")),
    )
    assert outcome.named == ()
    assert outcome.claims == ()


@pytest.mark.parametrize(
    ("conclusion", "half", "separated"),
    [
        (Conclusion.EFFECT, 0.5, True),
        (Conclusion.EFFECT, 1.5, False),
        (Conclusion.ONE_OF, 0.5, False),
    ],
)
def test_the_control_is_separated_where_its_interval_does_not_reach_zero(
    conclusion: Conclusion, half: float, separated: bool
) -> None:
    """Worse by 1 nat a segment; several named effects are not separated."""
    said = verdict(conclusion, "lift", apart=estimate(1.0, half))
    outcome = Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", said))
    assert outcome.separated is separated
    assert graded("x", [outcome]).separated.value == separated


def test_without_a_control_nothing_is_separated() -> None:
    alone = verdict(Conclusion.EFFECT, "lift", apart=None)
    assert Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", alone)).separated is None
    none = Outcome.of(
        key("a", Kind.NULL), filing("a", verdict(Conclusion.SUFFICIENT, apart=estimate(1.0, 0.5)))
    )
    assert none.separated is None


@pytest.mark.parametrize("conclusion", [Conclusion.EFFECT, Conclusion.ONE_OF])
def test_a_control_that_acts_is_none_that_is_wrong(conclusion: Conclusion) -> None:
    """Of two effects, the control beside the one that is named may be the other, which has to
    help."""
    beside = comparison(after=1e-3, control=2e-3)
    said = verdict(conclusion, "lift", apart=estimate(1.0, 0.5), comparisons=(beside,))
    wrong = acting("lift"), acting("full-hoist")
    right = acting("lift"), acting(beside.control_name)
    apart = conclusion is Conclusion.EFFECT
    assert Outcome.of(key("a", Kind.PAIR, *wrong), filing("a", said)).separated is apart
    assert Outcome.of(key("a", Kind.PAIR, *right), filing("a", said)).separated is None


def test_by_a_single_recording_the_control_is_separated_beyond_half_the_width() -> None:
    """The interval of the reduction is ± 1 mm: a control worse by 3 mm is separated, by 0.5 mm is
    not."""

    def gap(control: float | None) -> float | None:
        said = verdict(
            Conclusion.EFFECT, "lift", comparisons=(comparison(after=1e-3, control=control),)
        )
        return Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", said)).control_gap

    assert gap(4e-3) == pytest.approx(3.0)
    assert gap(1.5e-3) == pytest.approx(0.5)
    assert gap(None) is None


def test_coefficient_errors_and_coverage_are_those_of_the_named_effect() -> None:
    """Estimates 1.05 ± 0.1 and 1.5 ± 0.1 of a true 1: errors 5 % and 50 %, one of two covered."""
    estimates = iter((1.05, 1.5))
    result = sheet(
        lambda k: verdict(
            Conclusion.EFFECT, "lift", ranking=(candidate("lift", strength=next(estimates)),)
        ),
        [key("a", Kind.ONE, acting("lift")), key("b", Kind.ONE, acting("lift"))],
    )
    assert result.coefficients.errors == pytest.approx((0.05, 0.5))
    assert (result.coefficients.covered.hits, result.coefficients.covered.count) == (1, 2)


def test_a_strength_that_is_a_bound_contains_the_truth_on_its_side_and_has_no_error() -> None:
    """At least 0.8 contains a true 1, at least 1.3 does not; neither is an estimate that could
    err."""
    bounds = iter((0.8, 1.3))

    def bounded() -> Candidate:
        bound = next(bounds)
        return replace(
            candidate("lift"),
            strength=Quantity.of(
                value=bound, low=bound, high=math.inf, unit="1", bound=Bound.LEAST
            ),
        )

    result = sheet(
        lambda k: verdict(Conclusion.EFFECT, "lift", ranking=(bounded(),)),
        [key("a", Kind.ONE, acting("lift")), key("b", Kind.ONE, acting("lift"))],
    )
    assert result.coefficients.errors == ()
    assert (result.coefficients.covered.hits, result.coefficients.covered.count) == (1, 2)


def test_reduction_is_the_median_over_unseen_data_and_only_where_an_effect_was_named() -> None:
    said = verdict(
        Conclusion.EFFECT,
        "lift",
        comparisons=tuple(comparison(share=s) for s in (0.2, 0.8, None, 0.9)),
    )
    assert Outcome.of(
        key("a", Kind.ONE, acting("lift")), filing("a", said)
    ).reduction == pytest.approx(0.8)
    nothing = verdict(Conclusion.OUTSIDE, comparisons=(comparison(),))
    assert Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", nothing)).reduction is None


def test_reduction_is_measured_against_the_true_model_where_it_is_known() -> None:
    """From 5 mm to 2 mm where the true model has 1 mm: 3/4. None where the base model is no worse
    than the true one."""
    said = verdict(Conclusion.EFFECT, "lift", comparisons=(comparison(share=0.1, after=2e-3),))
    outcome = Outcome.of(key("a", Kind.ONE, acting("lift")), filing("a", said))
    assert replace(outcome, true_model_errors={"unseen": 1e-3}).reduction == pytest.approx(0.75)
    assert replace(outcome, true_model_errors={"another": 1e-3}).reduction == pytest.approx(0.1)
    assert replace(outcome, true_model_errors={"unseen": 6e-3}).reduction is None


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [
        # 0 of n: 1 − (α/2)^(1/n); n of n: (α/2)^(1/n), α = 0.1.
        (0, 20, 0.0, 1 - 0.05 ** (1 / 20)),
        (20, 20, 0.05 ** (1 / 20), 1.0),
        # Tables of the exact 90 % limits of the binomial: 1 of 20 is 0.0026 to 0.2161, 10 of 20 is
        # 0.3020 to 0.6980.
        (1, 20, 0.00256, 0.21611),
        (10, 20, 0.30195, 0.69805),
        (0, 0, 0.0, 1.0),
    ],
)
def test_intervals_of_shares_are_clopper_and_pearsons(
    hits: int, count: int, low: float, high: float
) -> None:
    share = Share.of([True] * hits + [False] * (count - hits))
    assert (share.low, share.high) == (pytest.approx(low, abs=1e-5), pytest.approx(high, abs=1e-5))
    assert share.value == (hits / count if count else None)


def test_a_power_curve_recovers_the_one_its_cases_are_drawn_from() -> None:
    """Slope 5, half at 2, among 400 cases from 0.5 to 8: standard errors of 6 % and 3 %, of which
    three."""
    rng = stream(2, "power")
    strength = np.exp(rng.uniform(np.log(0.5), np.log(8), 400))
    detected = rng.random(400) < 1 / (1 + (strength / 2) ** -5.0)
    power = Power.fitted(strength.tolist(), ["only"] * 400, detected.tolist())
    half, low, high = power.half["only"]
    assert half == pytest.approx(2, rel=0.15)
    assert low < 2 < high
    assert power.slope == pytest.approx(5, rel=0.35)
    assert float(power.at(np.array(half), "only")) == pytest.approx(0.5)


@pytest.mark.parametrize("outcome", [True, False])
def test_a_power_curve_exists_where_all_or_none_were_detected(outcome: bool) -> None:
    power = Power.fitted([1.0, 2.0, 4.0], ["a", "a", "b"], [outcome] * 3)
    half = power.half["a"][0]
    assert math.isfinite(half)
    assert (half < 2.0) is outcome


def test_power_curves_of_nothing_are_refused() -> None:
    with pytest.raises(InputError):
        Power.fitted([], [], [])
    with pytest.raises(InputError):
        Power.fitted([0.0], ["a"], [True])


def test_every_effect_in_a_class_is_in_the_library_and_in_one_class_only() -> None:
    listed = [effect for effects in classes().values() for effect in effects]
    assert set(listed) <= set(EFFECTS)
    assert len(listed) == len(set(listed))
    assert not set(classes()) & set(EFFECTS)
    assert class_of("lift") == "lift"


def test_the_sheet_shows_every_set_and_every_share(tmp_path) -> None:
    result = sheet(knowing, keys(5))
    document, page, picture = sheets.write(result, tmp_path)
    text = page.read_text()
    assert all(f"| {name} |" in text for name in result.shares)
    assert all(f"| {outcome.key.name} |" in text for outcome in result.outcomes)
    assert document.read_text().startswith("{")
    assert picture.stat().st_size > 10_000
    content = sheets.as_dict(result)
    assert content["sets"] == {"null": 5, "one": 5, "pair": 5, "outside": 5}
    assert content["confusion"]["nothing"] == {"no effect needed": 5}


def test_a_sheet_of_nothing_but_refused_nulls_can_be_written(tmp_path) -> None:
    sheets.write(graded("x", [Outcome.of(key("a", Kind.NULL), filing("a", None))]), tmp_path)
    assert "| a | nothing |" in (tmp_path / "challenge-score.md").read_text()
