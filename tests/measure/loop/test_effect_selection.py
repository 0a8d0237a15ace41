"""Which effect is named, by statistics that are drawn."""

from __future__ import annotations

from dataclasses import replace

import pytest

from measure.forecasting import names
from measure.inference import NullModel
from measure.loop import GUST_COLUMN, HOIST, estimate, finalists, judge
from measure.loop.effect_selection import equivalent
from measure.loop.strength_estimates import strength
from measure.nulls import GUSTS, Reference
from measure.verdict import Conclusion
from tests.measure.loop.drawn_statistics import EXPECTED, judged, named, seen, slow


@pytest.mark.parametrize(
    "name",
    [
        "hem-mass.line_density",
        "lift.coefficient",
        "vertical-wind.inclination",
        "reactive-loading.mass",
        "finite-span-loading.share",
    ],
)
def test_an_effect_alone_is_named_alone(null: NullModel, reference: Reference, name: str) -> None:
    found = judged(null, reference, {name: 1.0})
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, [name])
    strength = found.ranking[0].candidate.strength
    assert strength.low < EXPECTED[names().index(name)] < strength.high


def test_two_effects_are_both_named(null: NullModel, reference: Reference) -> None:
    found = judged(null, reference, {"lift.coefficient": 1.0, "hem-mass.line_density": 1.2})
    assert found.conclusion is Conclusion.EFFECT
    assert set(named(found)) == {"lift.coefficient", "hem-mass.line_density"}


def test_a_pressure_that_fluctuates_is_called_gusts(
    blowing: tuple[NullModel, Reference],
) -> None:
    """In nine of ten draws or more, other columns being large by chance in the others: of twelve
    draws fewer than nine are then as rare as 2.6 % (binomial), where half of all draws would give
    nine in 7 % of cases. Seeds and rule were fixed before the draws were made."""
    null, reference = blowing
    found = [
        judge(seen(null, {}, gusts=0.5, seed=seed, course=slow(0.2)), reference, level=0.02)
        for seed in range(100, 112)
    ]
    assert sum(named(one) == ["gusts"] for one in found) >= 9
    # Half a relative deviation of the pressure is a quarter of the speed's; of twelve segments,
    # known to a fifth.
    strengths = [
        one.ranking[0].candidate.strength.point for one in found if named(one) == ["gusts"]
    ]
    assert strengths == pytest.approx([0.25] * len(strengths), rel=0.6)


def test_a_pressure_that_differs_by_a_constant_is_not(
    null: NullModel, reference: Reference
) -> None:
    assert "gusts" not in named(judged(null, reference, {GUSTS: 1.0}))


def test_an_effect_beside_gusts_is_named_with_them(blowing: tuple[NullModel, Reference]) -> None:
    null, reference = blowing
    hem = {"hem-mass.line_density": 0.6}
    found = judge(seen(null, hem, gusts=1.0, course=slow(0.4)), reference, level=0.02)
    assert set(named(found)) == {"gusts", "hem-mass.line_density"}
    assert found.conclusion is Conclusion.EFFECT


def test_a_force_along_the_motion_is_none_of_the_library(
    null: NullModel, reference: Reference
) -> None:
    """Where it predicts unseen recordings better than the effect whose way they go."""
    found = judged(null, reference, {"motion.1.10": 3.0, "lift.coefficient": 1.0})
    assert (found.conclusion, named(found)) == (Conclusion.OUTSIDE, [])


@pytest.mark.parametrize("beside", [0.0, 0.5])
def test_a_strength_that_is_another_in_every_recording_is_not_the_whole(
    null: NullModel, reference: Reference, beside: float
) -> None:
    """A wind that rises by a speed, fitted as one that rises by an angle."""
    hem = {"hem-mass.line_density": beside} if beside else {}
    same = judged(null, reference, {"vertical-wind.inclination": 1.0} | hem)
    other = judged(null, reference, {"vertical-wind.inclination": (1.6, 0.9, 0.5)} | hem)
    assert same.conclusion is Conclusion.EFFECT
    assert other.conclusion is Conclusion.PARTLY
    assert beside or named(other) == ["vertical-wind.inclination"]
    first, second = (
        next(
            w for w in found.ranking if w.candidate.effect == "vertical-wind"
        ).candidate.heterogeneity
        for found in (same, other)
    )
    assert first is not None
    assert second is not None
    assert second < 0.02 < first


def test_a_strength_that_an_effect_cannot_have_is_not_named(
    null: NullModel, reference: Reference
) -> None:
    """A hem does not make cloth lighter."""
    found = judged(null, reference, {"hem-mass.line_density": -1.0, "lift.coefficient": 1.0})
    assert "hem-mass.line_density" not in named(found)
    assert (
        "is unphysical"
        in next(w for w in found.ranking if w.candidate.effect == "hem-mass").candidate.why_not
    )


@pytest.mark.parametrize(("null", "coefficient"), [(0.0, 2.0), (1.0, 2.0), (0.0, -2.0)])
def test_the_interval_of_a_strength_is_a_factor_to_either_side(
    null: float, coefficient: float
) -> None:
    """Without an error of its own 90 % of a log-normal factor with a standard deviation of 0.5:
    e^(1.645 · 0.5) = 2.28; with one that is far larger, a normal interval."""
    fitted = strength(null, coefficient, 0.0, "1")
    near, far = sorted(abs(end - null) for end in (fitted.low, fitted.high))
    assert fitted.value == null + coefficient
    assert (near, far) == pytest.approx((2.0 / 2.2758, 2.0 * 2.2758), rel=1e-3)
    wide = strength(null, coefficient, 100.0, "1")
    assert (wide.low, wide.high) == pytest.approx((-164.5, 164.5), abs=4)


def test_finalists_are_the_first_by_score_and_by_gain(
    null: NullModel, reference: Reference
) -> None:
    found = judged(null, reference, {"lift.coefficient": 1.0})
    chosen = finalists(found)
    assert chosen[0] == found.ranking[0].column
    assert GUST_COLUMN not in chosen
    assert max(found.ranking, key=lambda w: w.gains.sum()).column in chosen
    assert len(set(chosen)) == len(chosen)


def test_holes_stand_for_less_pressure_and_never_for_more() -> None:
    assert equivalent("air-density", estimate(-0.2, 0.1, "1")) == ("porosity",)
    assert equivalent("air-density", estimate(0.6, 0.1, "1")) == ()
    assert equivalent("lift", estimate(-0.2, 0.1, "1")) == ()


def test_an_effect_that_the_cloth_cannot_have_is_not_weighed(
    null: NullModel, reference: Reference
) -> None:
    evidence, place = seen(null, {}), names().index(HOIST)
    curvature, score = evidence.curvature.copy(), evidence.score.copy()
    curvature[:, place] = curvature[:, :, place] = score[:, place] = 0.0
    found = judge(replace(evidence, curvature=curvature, score=score), reference, level=0.02)
    assert "full-hoist" not in {w.candidate.effect for w in found.ranking}
    assert "lift" in {w.candidate.effect for w in found.ranking}
