"""A verdict on recordings of which simulations are a known function."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding, Severity
from flagdata.errors import RefusedError, UsageError
from measure.cloth import FlagBatch, Observed, close_loop, simulations, solve, verdict_of, weighable
from measure.cloth.films_verdict import strength_of
from measure.cloth.model_evidence import Fit
from measure.verdict import CRITERIA, Conclusion, Verdict, with_level
from tests.measure.cloth.loop.conftest import ALIKE, EFFECTS, options, recording, simulate_cheaply

DRAG = {"tangential-linear-drag.coefficient": 0.9}


def both(
    effects: Mapping[str, float] | None = None, *, foreign: float = 0.0, seed: int = 6
) -> list[Observed]:
    """Two recordings of one cloth."""
    return [
        recording(mean=mean, seed=seed, foreign=foreign, effects=effects) for mean in (4.0, 6.5)
    ]


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Verdict:
    """Of flags on which nothing acts."""
    with pytest.MonkeyPatch.context() as patch:
        simulate_cheaply(patch)
        return close_loop(both(), options(), folder=tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="module")
def dragged(tmp_path_factory: pytest.TempPathFactory) -> Verdict:
    with pytest.MonkeyPatch.context() as patch:
        simulate_cheaply(patch)
        return close_loop(both(DRAG), options(), folder=tmp_path_factory.mktemp("dragged"))


@pytest.mark.parametrize("weight", [155.0, 1.3, 0.018])
def test_a_weight_that_no_null_flag_has_is_refused_before_anything_is_simulated(
    weight: float,
) -> None:
    with pytest.raises(UsageError, match=r"null experiments have flags of 0\.05 to 0\.45"):
        options(area_weight=f"{weight}±{0.05 * weight}")
    assert options(area_weight="0.6±0.03").recipe()["area_weight"] == [0.6, 0.03]
    assert options(area_weight="0.6").recipe()["area_weight"] == pytest.approx([0.6, 0.006])


def test_flags_on_which_nothing_acts_need_no_effect_but_at_the_level(
    cheap: list[int], plain: Verdict, tmp_path: Path
) -> None:
    # Of twelve flags at a level of 5 % four or more are rejected with a probability of 0.2 %.
    found = [solve(both(seed=seed), options(), folder=tmp_path).judged for seed in range(5, 17)]
    assert sum(one.conclusion is not Conclusion.SUFFICIENT for one in found) <= 3
    assert np.median([one.p_value for one in found]) > 0.25
    assert plain.conclusion is Conclusion.SUFFICIENT
    assert plain.named == ()


def test_an_effect_is_named_with_its_strength(dragged: Verdict) -> None:
    assert dragged.conclusion is Conclusion.EFFECT
    assert dragged.named == ("tangential-linear-drag",)
    assert dragged.test.effective is not None
    assert dragged.test.p_value.point == pytest.approx(1 / (1 + dragged.test.effective))
    strength = dragged.ranking[0].strength
    assert strength.low < 0.9 < strength.high
    assert strength.value == pytest.approx(0.9, rel=0.15)
    assert dragged.ranking[0].probability == pytest.approx(1.0, abs=0.05)


def test_the_effect_lowers_the_error_on_unseen_windows_in_the_observables_own_unit(
    dragged: Verdict,
) -> None:
    moved = {
        one.what: one for one in dragged.comparisons if one.what.startswith("amplitude-across")
    }
    assert set(moved) == {"amplitude-across, other halves", "amplitude-across, recordings left out"}
    for one in moved.values():
        assert one.before.unit == "1"
        assert one.before.point > 0.08  # of 0.12 that the effect makes
        assert one.after.point < 0.03
        assert one.reduction.low > 0
        assert one.control is not None
        assert one.control.point > 0.08


def test_a_recording_that_shows_nothing_in_one_half_is_judged_as_a_whole(
    cheap: list[int], tmp_path: Path
) -> None:
    first, second = both(DRAG)
    lost = first.readings.copy()
    lost[:6] = np.nan  # of ten windows of its first half, and of twenty in all
    found = close_loop([replace(first, readings=lost), second], options(), folder=tmp_path)
    assert found.named == ("tangential-linear-drag",)
    (said,) = (what for kind, what in found.findings if kind == "half-without-readings")
    assert said.startswith(f"{first.name}: one half of it shows no observable")
    moved = {one.what: one for one in found.comparisons if one.what.startswith("amplitude-across")}
    assert set(moved) == {"amplitude-across, other halves", "amplitude-across, recordings left out"}
    assert all(one.reduction.low > 0 for one in moved.values())


def test_two_effects_that_act_alike_are_named_together(cheap: list[int], tmp_path: Path) -> None:
    found = close_loop(
        both({"air-density.change": 0.5}), options(only=(*EFFECTS, *ALIKE)), folder=tmp_path
    )
    assert found.conclusion is Conclusion.ONE_OF
    assert set(found.named) == {"air-density", "power-law-drag"}


def test_what_no_effect_explains_is_none_of_the_library(cheap: list[int], tmp_path: Path) -> None:
    recordings = both(foreign=0.3)
    found = close_loop(
        recordings, options(only=("tangential-linear-drag.coefficient",)), folder=tmp_path
    )
    assert found.conclusion is Conclusion.OUTSIDE
    assert found.named == ()


def test_an_effect_beside_something_else_is_a_part(cheap: list[int], tmp_path: Path) -> None:
    recordings = both(DRAG, foreign=0.1)
    found = close_loop(
        recordings, options(only=("tangential-linear-drag.coefficient",)), folder=tmp_path
    )
    assert found.conclusion is Conclusion.PARTLY
    assert found.named == ("tangential-linear-drag",)


def test_too_few_kinds_of_numerics_cannot_test(cheap: list[int], tmp_path: Path) -> None:
    found = close_loop(both(), options(kinds=4), folder=tmp_path)
    assert found.conclusion is Conclusion.UNTESTED
    assert "with 4 numerical set-ups no p is below 0.1" in found.words  # of eight flags at most


def test_recordings_that_would_show_none_of_the_effects_decide_nothing(
    cheap: list[int], tmp_path: Path
) -> None:
    found = close_loop(
        both(), options(only=("hem-mass.line_density",)), folder=tmp_path
    )  # which moves nothing here
    assert found.conclusion is Conclusion.UNDECIDED
    assert any("would have been seen with a chance of" in reason for reason in found.open)
    assert found.power[0].share < 0.1
    assert all(reason in found.words for reason in found.open)


def test_the_power_is_that_of_effects_at_the_mean_strength_of_their_priors(plain: Verdict) -> None:
    seen = {one.effect: one for one in plain.power}
    assert list(seen) == [one.effect for one in sorted(plain.power, key=lambda one: -one.share)]
    # 0.2 · 2.3/8 for lift, whose noise of a mean is 0.02/√20, and as much for the others.
    assert min(one.share for one in plain.power) > 0.9
    low, high = 0.3, 8.0
    assert seen["lift"].strength == pytest.approx((high - low) / math.log(high / low), rel=0.05)
    assert plain.open == ()


def test_an_effect_that_is_not_weighed_is_refused() -> None:
    with pytest.raises(UsageError, match="direction-change"):
        options(only=("direction-change.angle",))


def test_a_cloth_that_is_heavier_than_it_was_weighed_is_not_the_base_model(
    cheap: list[int], plain: Verdict, tmp_path: Path
) -> None:
    recordings, own = both(), plain.parameters[0].before.point
    right = close_loop(recordings, options(area_weight=f"{own}±{0.02 * own}"), folder=tmp_path)
    wrong = close_loop(
        recordings, options(area_weight=f"{0.5 * own}±{0.01 * own}"), folder=tmp_path
    )
    assert right.conclusion is Conclusion.SUFFICIENT
    assert wrong.test.p_value.point <= 0.05


def test_what_is_missing_is_stated_with_its_size_and_unit(dragged: Verdict) -> None:
    assert "amplitude-across +0.12 (" in dragged.proposal  # 0.2 · 0.9/1.5


def test_effects_that_the_recordings_would_not_show_are_listed(
    cheap: list[int], tmp_path: Path
) -> None:
    tiny = "hem-mass.line_density"
    verdict = close_loop(both(), options(only=(*EFFECTS, tiny)), folder=tmp_path)
    assert any(
        "even where they are strong, hem-mass would move" in text for text in verdict.assumptions
    )


def test_a_constant_wind_is_reported_to_hide_what_acts_as_another_weight_does(
    cheap: list[int], tmp_path: Path
) -> None:
    verdict = close_loop([recording(mean=5.0, seed=5, swing=0.0)], options(), folder=tmp_path)
    assert [kind for kind, _ in verdict.findings] == ["constant-wind"]
    assert any("one steady wind" in text for text in verdict.assumptions)


def test_what_was_merely_noted_on_a_film_is_no_doubt_beside_the_verdict(
    cheap: list[int], tmp_path: Path
) -> None:
    still, lost = (
        Finding(kind=kind, severity=severity, what=kind)
        for kind, severity in (("camera-still", Severity.NOTE), ("camera-lost", Severity.WARNING))
    )
    seen = [replace(one, findings=(still, lost)) for one in both()]
    outcome = solve(seen, options(), folder=tmp_path)
    assert {finding.kind for finding in outcome.findings} >= {"camera-still", "camera-lost"}
    assert {kind for kind, _ in verdict_of(outcome).findings} == {"camera-lost"}


def test_a_strength_beyond_what_is_assumed_is_a_bound(cheap: list[int], tmp_path: Path) -> None:
    """A drag of 3 where 1.5 is assumed at most: what is known is that it is large."""
    found = close_loop(
        both({"tangential-linear-drag.coefficient": 3.0}), options(), folder=tmp_path
    )
    strength = found.ranking[0].strength
    assert found.named == ("tangential-linear-drag",)
    assert strength.bound == "at-least"
    assert 0.5 < strength.point == strength.low < 1.5
    assert strength.high == math.inf
    assert strength.level == pytest.approx(0.95)
    assert "at least" in found.words


def test_a_strength_of_two_signs_leans_on_either_end() -> None:
    shear = next(
        one for one in weighable(options().calibration.flag) if one.name == "shear.exponent"
    )  # −0.3 to 0.8
    null, factor = shear.column.described.null, np.exp(CRITERIA.reach * CRITERIA.strength_factor)

    def at(*shares: float) -> Quantity:
        scores = ndtri(np.array(shares))[None, :, None]
        none, even = np.zeros(1), np.full((1, len(shares)), 1 / len(shares))
        return strength_of(shear, Fit(evidence=none, misfit=none, scores=scores, weights=even))

    high, low = at(*np.linspace(0.7, 0.999, 300)), at(*np.linspace(0.001, 0.2, 300))
    middle, either = at(*np.linspace(0.4, 0.6, 300)), at(*([0.01, 0.5, 0.99] * 100))
    assert (high.bound, high.high) == ("at-least", math.inf)
    assert high.point == pytest.approx(null + (-0.3 + 1.1 * 0.715) / factor, rel=0.01)
    assert (low.bound, low.low) == ("at-most", -math.inf)
    assert low.point == pytest.approx(null + (-0.3 + 1.1 * 0.19) / factor, rel=0.01)
    assert middle.bound is None
    assert either.bound == "nothing"
    assert with_level(either) == "not determined"


def test_a_recording_whose_simulations_show_something_else_is_left_out_with_the_reason(
    cheap: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The verdict is that of the others, and says so."""
    usual = simulations.readings_of

    def read(batches: list[FlagBatch], **given: Any) -> FloatArray:
        """Of the third recording's flags none is seen."""
        found = usual(batches, **given)
        return np.full_like(found, np.nan) if batches[0].log.speed.mean() > 8 else found

    monkeypatch.setattr(simulations, "readings_of", read)
    recordings = [*both(DRAG), replace(recording(mean=9.0, seed=6), name="dusk")]
    found = close_loop(recordings, options(), folder=tmp_path)
    kind, said = found.findings[0]
    assert kind == "left-out"
    assert said.startswith("dusk is left out: 0 of 128 simulations show what the film shows")
    assert found.named == ("tangential-linear-drag",)
    assert {one.frames for one in found.comparisons if "recordings left out" in one.what} == {40}
    with pytest.raises(RefusedError, match="0 of 128 simulations"):
        close_loop(recordings[2:], options(), folder=tmp_path)
