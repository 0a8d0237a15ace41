"""Judgements on made statistics, in which it is known what acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from flagdata.errors import UsageError
from flagdata.rng import stream
from measure.forecasting.calibration import PRIOR, THETA
from measure.forecasting.regressors import TURNED, EffectColumn, columns, names
from measure.inference.evidence import Evidence
from measure.inference.random_effect import NullModel, Nulls
from measure.loop.refit import Refit
from measure.loop.selection import (
    GUST_COLUMN,
    Judgement,
    equivalent,
    estimate,
    finalists,
    judge,
    strength,
    withdrawn,
)
from measure.loop.set_up import HOIST, SetUp
from measure.nulls.reference import GUSTS, NullBank, Reference
from measure.probes.course import Course
from measure.probes.lines import REDUCED
from measure.probes.statistics import Statistics
from measure.verdict.record import Conclusion

Floats = NDArray[np.float64]
KINDS, CLOTHS, WINDS, SEGMENTS = 50, 1, 4, 4
COUNT = len(names())
SHED = REDUCED[40]
CLEAR = 6.0
"""Response of a segment to an expected strength, in standard deviations of its errors."""


def expected(column: int) -> float:
    """The strength of a column that is expected where it acts."""
    if column < len(THETA):
        return float(PRIOR[column])
    own = columns()[column - len(THETA)]
    if not isinstance(own, EffectColumn):
        return 0.5
    low, high = (end - own.described.null for end in own.described.prior)
    return high if high > -low else low


EXPECTED = np.array([expected(column) for column in range(COUNT)])


def drawn(rng: np.random.Generator, delta: Floats, numerics: Floats, speeds: Floats) -> Statistics:
    """r = shift of the numerics + R δ + ε of recordings, with coefficients (segment, column) and ε ~ N(0, 1)."""
    recording = np.repeat(np.arange(len(speeds)), SEGMENTS)
    mixed = rng.normal(size=(len(recording), COUNT, COUNT)) + CLEAR * np.eye(COUNT)
    response = mixed / np.abs(EXPECTED)
    r = np.einsum("sij,sj->si", response, delta) + numerics[recording] + rng.normal(size=(len(recording), COUNT))
    return Statistics(
        recording=recording, r=r, response=response, error=np.ones(len(r)), marker_error=np.ones((len(r), 1)),
        lines=rng.exponential(size=(len(r), len(REDUCED), 3)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def bank() -> NullBank:
    return made(seed=1)


def blown(rng: np.random.Generator, segments: int, parts: Floats | float = 0.0) -> Course:
    """What noise makes of the wind's course, and a wind of parts (segment, window, part)."""
    size = 100.0
    score = size * np.broadcast_to(parts, (segments, 10, 3)) + size**0.5 * rng.normal(size=(segments, 10, 3))
    return Course(score=score, curvature=np.broadcast_to(size * np.eye(3), (*score.shape, 3)))


def pulses(strength: float, *, turned: float = 0.0) -> Floats:
    """(segment, window, part) of three recordings: a wind that is weaker for one window of every nine."""
    weaker = np.where(np.arange(3 * SEGMENTS * 10) % 9 < 3, -strength, 0.0).reshape(-1, 10, 1)
    return weaker * np.array([1.0, turned, 0.0])


def slow(strength: float) -> Floats:
    """The same of a wind that changes from one segment to another, and turns as well."""
    return strength * stream(5, "slow").normal(size=(3 * SEGMENTS, 1, 3)) * np.ones((1, 10, 1))


def made(seed: int, *, moments: bool = False, courses: bool = False, settled: bool = False) -> NullBank:
    """A bank of nulls, with moments about the pole or without, with courses of the wind, with settled quantities."""
    rng = np.random.default_rng(seed)
    recordings = KINDS * CLOTHS * WINDS
    cloths = np.repeat(rng.normal(size=(KINDS * CLOTHS, len(THETA))) * PRIOR, WINDS * SEGMENTS, axis=0)
    delta = np.zeros((len(cloths), COUNT))  # statistics are taken at each one's own calibration
    shifts = np.repeat(rng.normal(size=(KINDS * CLOTHS, COUNT)), WINDS, axis=0)
    speeds = rng.uniform(3, 8, recordings)
    own = drawn(rng, delta, shifts, speeds)
    if moments:
        own = replace(own, turning=replace(drawn(rng, delta, shifts[::-1], speeds), lines=None))
    if courses:
        own = replace(own, course=blown(rng, len(own.r)))
    if settled:
        own = replace(own, settled=0.1 * rng.normal(size=(recordings, 2))[own.recording])
    nulls = Nulls(
        statistics=own, speeds=speeds[own.recording], calibration=cloths, noise=np.zeros(len(cloths)),
        period=np.full(len(cloths), 0.04), cloth=np.full(len(cloths), "made"),
        numerics=np.repeat(np.arange(KINDS), CLOTHS * WINDS * SEGMENTS),
    )  # fmt: skip
    return NullBank(nulls=nulls, columns=names(), duration=2.0, words="made")


@pytest.fixture(scope="module")
def null(bank: NullBank) -> NullModel:
    return bank.model(bank.nulls.design)


@pytest.fixture(scope="module")
def reference(bank: NullBank) -> Reference:
    return bank.reference(12, noise=0.0, seed=1)


Acting = Mapping[str, float | tuple[float, float, float]]


def strengths(acting: Acting) -> Floats:
    """(segment, column) of three recordings, from shares of what is expected, of all or of each."""
    delta = np.zeros((3 * SEGMENTS, COUNT))
    for name, share in acting.items():
        each = np.repeat(np.broadcast_to(share, 3), SEGMENTS)
        delta[:, names().index(name)] = each * EXPECTED[names().index(name)]
    return delta


def seen(
    null: NullModel,
    acting: Acting,
    *,
    gusts: float = 0.0,
    line: float = 0.0,
    seed: int = 2,
    moments: Acting | None = None,
    course: Floats | None = None,
) -> Evidence:
    """Of three recordings with strengths in units of what is expected, a pressure that fluctuates by `gusts`, and
    `line` of power more at `SHED`, across the wind; beside them moments of other strengths, and a course of the
    wind."""
    rng = np.random.default_rng(seed)
    delta = strengths(acting)
    delta[:, names().index(GUSTS)] += gusts * rng.normal(size=len(delta))
    speeds = np.array([3.5, 5.0, 7.0])
    own = drawn(rng, delta, np.tile(rng.normal(size=COUNT), (3, 1)), speeds)
    assert own.lines is not None
    own.lines[:, np.searchsorted(REDUCED, SHED), 1] += line
    if moments is not None:
        turned = drawn(rng, strengths(moments), np.tile(rng.normal(size=COUNT), (3, 1)), speeds)
        own = replace(own, turning=replace(turned, lines=None))
    if course is not None:
        own = replace(own, course=blown(rng, len(own.r), course))
    return Evidence.of(own, speeds[own.recording], null)


def judged(
    null: NullModel,
    reference: Reference,
    acting: Acting,
    *,
    gusts: float = 0.0,
    line: float = 0.0,
    seed: int = 2,
) -> Judgement:
    return judge(seen(null, acting, gusts=gusts, line=line, seed=seed), reference, level=0.02)


def named(judgement: Judgement) -> list[str]:
    return ["gusts" if column == GUST_COLUMN else names()[column] for column in judgement.named]


def test_nothing_is_found_where_nothing_acts() -> None:
    """By six banks, 40 nulls each, at 5 %: 12 of 240 are expected, and more than 18 come once in 30 times."""
    rejected = 0
    for bank in (made(seed) for seed in range(6)):
        null, reference = bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)
        chances = [reference.conformal.p(reference.farthest(seen(null, {}, seed=seed), names())) for seed in range(40)]
        rejected += sum(p <= 0.05 for p in chances)
    assert rejected <= 18


def test_what_is_not_rejected_needs_no_effect(null: NullModel, reference: Reference) -> None:
    found = [judged(null, reference, {}, seed=seed) for seed in range(20)]
    assert [j.conclusion is Conclusion.SUFFICIENT for j in found] == [j.p_value > 0.02 for j in found]
    assert all(not j.named for j in found if j.conclusion is Conclusion.SUFFICIENT)


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
    found = judged(null, reference, {"lift.coefficient": 1.0, "hem-mass.line_density": 0.8})
    assert found.conclusion is Conclusion.EFFECT
    assert set(named(found)) == {"lift.coefficient", "hem-mass.line_density"}


def test_a_pressure_that_fluctuates_is_called_gusts(null: NullModel, reference: Reference) -> None:
    """In five of six draws or more: in one, other columns may be large by chance."""
    found = [judged(null, reference, {}, gusts=0.5, seed=seed) for seed in range(2, 8)]
    assert sum(named(one) == ["gusts"] for one in found) >= 5
    # Half a relative deviation of the pressure is a quarter of the speed's; of twelve segments, known to a fifth.
    assert [one.ranking[0].candidate.strength.value for one in found] == pytest.approx([0.25] * 6, rel=0.6)


def test_a_pressure_that_differs_by_a_constant_is_not(null: NullModel, reference: Reference) -> None:
    assert "gusts" not in named(judged(null, reference, {GUSTS: 1.0}))


def test_an_effect_beside_gusts_is_named_with_them(null: NullModel, reference: Reference) -> None:
    found = judged(null, reference, {"hem-mass.line_density": 0.6}, gusts=1.0)
    assert set(named(found)) == {"gusts", "hem-mass.line_density"}
    assert found.conclusion is Conclusion.EFFECT


def test_a_force_along_the_motion_is_none_of_the_library(null: NullModel, reference: Reference) -> None:
    found = judged(null, reference, {"motion.1.10": 2.0})
    assert (found.conclusion, named(found)) == (Conclusion.OUTSIDE, [])


@pytest.mark.parametrize("beside", [0.0, 0.5])
def test_a_strength_that_is_another_in_every_recording_is_not_the_whole(
    null: NullModel, reference: Reference, beside: float
) -> None:
    """A wind that rises by a speed, fitted as one that rises by an angle; its mean is the same as that of the first."""
    hem = {"hem-mass.line_density": beside} if beside else {}
    same = judged(null, reference, {"vertical-wind.inclination": 1.0} | hem)
    other = judged(null, reference, {"vertical-wind.inclination": (1.8, 0.8, 0.4)} | hem)
    assert same.conclusion is Conclusion.EFFECT
    assert other.conclusion is Conclusion.PARTLY
    assert beside or named(other) == ["vertical-wind.inclination"]
    first, second = (
        next(w for w in found.ranking if w.candidate.effect == "vertical-wind").candidate.heterogeneity
        for found in (same, other)
    )
    assert first is not None
    assert second is not None
    assert second < 0.02 < first


def test_what_moments_alone_show_rejects_and_counts_in_what_an_effect_leaves() -> None:
    bank = made(seed=7, moments=True)
    null, reference = bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)
    drag, lift = {"tangential-quadratic-drag.coefficient": 1.0}, {"lift.coefficient": 1.0}

    def found(acting: Acting, moments: Acting) -> Judgement:
        return judge(seen(null, acting, moments=moments), reference, level=0.02)

    assert found({}, {}).conclusion is Conclusion.SUFFICIENT
    assert found({}, drag).conclusion is not Conclusion.SUFFICIENT
    assert (found(lift, lift).conclusion, named(found(lift, lift))) == (Conclusion.EFFECT, list(lift))
    assert (found(lift, lift | drag).conclusion, named(found(lift, lift | drag))) == (Conclusion.PARTLY, list(lift))


def test_beside_gusts_moments_are_not_looked_at() -> None:
    """Two true gusts of a challenge left 3.1 and 3.4 by the columns, of 3.9 that nulls leave, and 6.6 and 8.2 by the
    moments: a pressure that swings within a segment moves them however it is set free from one to the next."""
    bank = made(seed=7, moments=True)
    null, reference = bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)
    drag = {"tangential-quadratic-drag.coefficient": 1.0}
    found = judge(seen(null, {}, gusts=1.0, moments=drag), reference, level=0.02)
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, ["gusts"])


def test_errors_that_swing_with_the_wind_are_none_of_the_library(null: NullModel, reference: Reference) -> None:
    found = judged(null, reference, {}, line=10.0, seed=3)
    assert (found.conclusion, named(found)) == (Conclusion.OUTSIDE, [])
    assert found.line is not None
    assert (found.line.reduced, found.line.axis) == (SHED, 1)
    assert judged(null, reference, {}).line is None


def test_an_effect_beside_a_line_explains_a_part(null: NullModel, reference: Reference) -> None:
    # The lift is the farthest, and what it leaves still swings.
    found = judged(null, reference, {"lift.coefficient": 1.5}, line=4.0)
    assert (found.conclusion, named(found)) == (Conclusion.PARTLY, ["lift.coefficient"])
    assert found.line is not None


def test_spectra_of_the_data_alone_are_refused(bank: NullBank, null: NullModel) -> None:
    blind = replace(bank.nulls, statistics=replace(bank.nulls.statistics, lines=None))
    with pytest.raises(UsageError, match="spectra"):
        judged(null, replace(bank, nulls=blind).reference(12, noise=0.0, seed=1), {})


@pytest.fixture(scope="module")
def blowing() -> tuple[NullModel, Reference]:
    """Of nulls whose wind's course is looked at."""
    bank = made(seed=1, courses=True)
    return bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)


def test_a_course_alone_rejects_the_base_model(blowing: tuple[NullModel, Reference]) -> None:
    null, reference = blowing
    calm, windy = (
        judge(seen(null, {}, course=c), reference, level=0.02) for c in (np.zeros((3 * SEGMENTS, 10, 3)), pulses(0.3))
    )
    assert calm.conclusion is Conclusion.SUFFICIENT
    assert windy.conclusion is not Conclusion.SUFFICIENT
    assert windy.statistic > calm.statistic


def test_gusts_are_named_where_the_course_is_turbulences(blowing: tuple[NullModel, Reference]) -> None:
    null, reference = blowing
    gusty = judge(seen(null, {}, gusts=1.0, course=slow(0.2)), reference, level=0.02)
    assert named(gusty) == ["gusts"]
    # The same pressure, in a wind that comes in pulses and turns a little, as behind obstacles that pass.
    passing = judge(seen(null, {}, gusts=1.0, course=pulses(2.0, turned=0.2)), reference, level=0.02)
    assert "gusts" not in named(passing)
    assert "varies across its mean by" in next(w for w in passing.ranking if w.column == GUST_COLUMN).candidate.why_not


def test_a_wind_that_varies_along_itself_alone_is_not_barred_from_gusts(blowing: tuple[NullModel, Reference]) -> None:
    null, reference = blowing
    slowly = judge(seen(null, {}, gusts=1.0, course=pulses(2.0)), reference, level=0.02)
    assert named(slowly) == ["gusts"]
    # Within segments alone: their mean pressure does not differ, and the course says how much it varies.
    within = judge(seen(null, {}, course=pulses(2.0)), reference, level=0.02)
    assert (within.conclusion, named(within)) == (Conclusion.EFFECT, ["gusts"])
    found = next(w for w in within.ranking if w.column == GUST_COLUMN).candidate
    # Weaker by 2 in three windows of nine, and in both of two neighbours in two of nine: a covariance of 4 (2/9 − 1/9).
    assert found.strength.value == pytest.approx(2 / 3, rel=0.1)
    assert not found.why_not


def test_courses_of_the_data_alone_are_refused(null: NullModel, reference: Reference) -> None:
    with pytest.raises(UsageError, match="courses"):
        judge(seen(null, {}, course=pulses(0.1)), reference, level=0.02)


def test_a_strength_that_an_effect_cannot_have_is_not_named(null: NullModel, reference: Reference) -> None:
    """A hem does not make cloth lighter."""
    found = judged(null, reference, {"hem-mass.line_density": -1.0})
    assert "hem-mass.line_density" not in named(found)
    assert "is unphysical" in next(w for w in found.ranking if w.candidate.effect == "hem-mass").candidate.why_not


@pytest.mark.parametrize(("null", "coefficient"), [(0.0, 2.0), (1.0, 2.0), (0.0, -2.0)])
def test_the_interval_of_a_strength_is_a_factor_to_either_side(null: float, coefficient: float) -> None:
    """Without an error of its own 90 % of a log-normal factor with a standard deviation of 0.5: e^(1.645 · 0.5) = 2.28;
    with one that is far larger, a normal interval."""
    fitted = strength(null, coefficient, 0.0, "1")
    near, far = sorted(abs(end - null) for end in (fitted.low, fitted.high))
    assert fitted.value == null + coefficient
    assert (near, far) == pytest.approx((2.0 / 2.2758, 2.0 * 2.2758), rel=1e-3)
    wide = strength(null, coefficient, 100.0, "1")
    assert (wide.low, wide.high) == pytest.approx((-164.5, 164.5), abs=4)


LIFT, HEM = names().index("lift.coefficient"), names().index("hem-mass.line_density")


def predicting(evidence: Evidence, each: float, *, leftover: float = 0.5, seed: int = 0) -> Refit:
    """A model that predicts every segment better than the base model by so much, and a deviation of 1."""
    gained = each + stream(seed, "gains").normal(size=3 * SEGMENTS)
    return Refit(coefficient=0.3, gains=gained, leftover=leftover, evidence=evidence)


@pytest.mark.parametrize(
    ("hem", "left", "said"),
    [
        (5.0, (0.5, 0.5), ["hem-mass.line_density", "lift.coefficient"]),
        (3.0, (0.5, 0.5), ["lift.coefficient"]),  # a difference of 24 to a standard error of √24 = 4.9
        (5.0, (0.01, 0.5), ["hem-mass.line_density"]),
        (5.0, (0.5, 0.01), ["lift.coefficient"]),
    ],
)
def test_what_is_named_is_the_confidence_set_less_what_fails_its_predictive_test(
    null: NullModel, reference: Reference, hem: float, left: tuple[float, float], said: list[str]
) -> None:
    data, rest = seen(null, {"lift.coefficient": 1.0}), seen(null, {}, seed=3)
    refits = {
        LIFT: predicting(rest, 5.0, leftover=left[0]), HEM: predicting(rest, hem, leftover=left[1], seed=1),
        **{column: None for column in range(len(THETA), len(THETA) + 18) if column not in (LIFT, HEM)},
    }  # fmt: skip
    found = judge(data, reference, level=0.02, refits=refits)
    assert sorted(named(found)) == said
    assert found.conclusion is (Conclusion.ONE_OF if len(said) > 1 else Conclusion.EFFECT)


def test_where_the_base_model_predicts_as_well_nothing_is_named(null: NullModel, reference: Reference) -> None:
    """However well an effect fits what rejects the base model."""
    useless = Refit(coefficient=0.3, gains=np.tile([1.0, -1.0], 6), leftover=0.5, evidence=seen(null, {}, seed=3))
    refits = dict.fromkeys(range(len(THETA), len(THETA) + 18), useless)
    found = judge(seen(null, {}, line=10.0), reference, level=0.02, refits=refits)
    assert (found.conclusion, found.named, found.confident) == (Conclusion.OUTSIDE, (), ())


def test_a_cloth_that_diverges_is_no_model(null: NullModel, reference: Reference) -> None:
    data = seen(null, {"lift.coefficient": 1.0})
    assert named(judge(data, reference, level=0.02)) == ["lift.coefficient"]
    assert "lift.coefficient" not in named(judge(data, reference, level=0.02, refits={LIFT: None}))


def test_a_level_that_the_kinds_cannot_test_is_not_tested(null: NullModel, reference: Reference) -> None:
    """By 50 kinds of numerics no p is below 1/51."""
    data = seen(null, {"lift.coefficient": 1.0})
    assert judge(data, reference, level=1 / 51 + 1e-9).conclusion is Conclusion.EFFECT
    untested = judge(data, reference, level=0.019)
    assert (untested.conclusion, untested.named) == (Conclusion.UNTESTED, ())


def test_intervals_of_the_calibrated_parameters_contain_those_of_new_kinds() -> None:
    """Of 90 %: by ten banks, 20 experiments each of their own kind, whose numerics move all directions."""
    held = []
    for seed in range(10):
        bank = made(seed)
        null, reference = bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)
        for place in range(20):
            own = seen(null, {}, seed=1000 + place).fit(()).in_errors(range(len(THETA)))
            held.append(np.abs(own) <= reference.reach)
    share = np.mean(held, axis=0)
    # 200 experiments against ten quantiles of 50 kinds each: a standard error of 0.02 and one of 0.013.
    assert (np.abs(share - 0.9) < 3 * 0.025).all(), share


def test_finalists_are_the_first_by_gain_and_by_statistic(null: NullModel, reference: Reference) -> None:
    found = judged(null, reference, {"lift.coefficient": 1.0})
    chosen = finalists(found)
    assert chosen[0] == found.ranking[0].column
    assert GUST_COLUMN not in chosen
    assert set(found.confident) <= set(chosen)
    assert len(set(chosen)) == len(chosen)


def test_a_rerun_counts_in_place_of_the_linear(null: NullModel, reference: Reference) -> None:
    """An effect whose refitted model predicts nothing is not named."""
    rng = np.random.default_rng(2)
    delta = np.zeros((12, COUNT))
    place = names().index("lift.coefficient")
    delta[:, place] = EXPECTED[place]
    speeds = np.array([3.5, 5.0, 7.0])
    own = drawn(rng, delta, np.zeros((3, COUNT)), speeds)
    evidence = Evidence.of(own, speeds[own.recording], null)
    linear = judge(evidence, reference, level=0.02)
    assert linear.named == (place,)
    useless = Refit(coefficient=0.1, gains=np.full(12, -1.0), leftover=0.5, evidence=evidence)
    assert place not in judge(evidence, reference, level=0.02, refits={place: useless}).named


def test_what_recordings_settle_at_rejects_alone_and_counts_in_what_is_left() -> None:
    bank = made(seed=9, settled=True)
    null, reference = bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)

    def found(off: float) -> Judgement:
        evidence = seen(null, {})
        return judge(replace(evidence, settled=np.full((12, 2), [0.0, off])), reference, level=0.02)

    assert found(0.05).conclusion is Conclusion.SUFFICIENT
    # The mean of three recordings is 0.06 in nulls.
    assert found(-1.0).conclusion is Conclusion.OUTSIDE
    plain = judge(seen(null, {}), reference, level=0.02)
    assert found(-1.0).ranking[0].candidate.leftover < 0.05 < plain.ranking[0].candidate.leftover


def test_settled_quantities_of_the_data_alone_are_refused(null: NullModel, reference: Reference) -> None:
    with pytest.raises(UsageError, match="settled"):
        judge(replace(seen(null, {}), settled=np.zeros((12, 2))), reference, level=0.02)


def logged(null: NullModel, angle: float, tolerance: float) -> Evidence:
    """Of a wind that is turned by an angle from its log, whose direction has a tolerance [rad]."""
    rng = np.random.default_rng(2)
    delta = np.zeros((3 * SEGMENTS, COUNT))
    delta[:, names().index(TURNED)] = angle
    speeds = np.array([3.5, 5.0, 7.0])
    own = drawn(rng, delta, np.tile(rng.normal(size=COUNT), (3, 1)), speeds)
    off = np.zeros((len(own.r), COUNT, 3))
    off[..., 1] = tolerance * own.response[..., names().index(TURNED)]
    return Evidence.of(replace(own, log=off), speeds[own.recording], null)


def test_a_wind_turned_beyond_its_tolerance_is_the_verdict(null: NullModel, reference: Reference) -> None:
    found = judge(logged(null, 0.8, 0.2), reference, level=0.02, set_up=SetUp(tolerance=0.2))
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, [TURNED])
    assert found.direction is not None
    assert 0.2 < found.direction.low < 0.8 < found.direction.high
    shown = next(w for w in found.ranking if w.column == names().index(TURNED))
    assert shown.candidate.strength == found.direction
    assert names().index(TURNED) in finalists(found)


def test_a_wind_turned_within_its_tolerance_is_no_effect(null: NullModel, reference: Reference) -> None:
    found = judge(logged(null, 0.8, 0.8), reference, level=0.02, set_up=SetUp(tolerance=0.8))
    assert TURNED not in named(found)
    shown = next(w for w in found.ranking if w.column == names().index(TURNED))
    assert not shown.admissible
    assert "46° of tolerance" in shown.unlike


def test_a_hoist_that_stands_still_leads_whatever_the_test_says(null: NullModel, reference: Reference) -> None:
    found = judge(seen(null, {}), reference, level=0.02, set_up=SetUp(attached=True))
    assert found.p_value > 0.02
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, [HOIST])
    assert names().index(HOIST) in finalists(found)


def test_an_effect_with_which_unseen_errors_rise_is_not_named(null: NullModel, reference: Reference) -> None:
    found = withdrawn(judged(null, reference, {"lift.coefficient": 1.0}))
    assert (found.conclusion, named(found)) == (Conclusion.OUTSIDE, [])
    assert "unseen recordings are larger" in found.ranking[0].candidate.why_not


def test_holes_stand_for_less_pressure_and_never_for_more() -> None:
    assert equivalent("air-density", estimate(-0.2, 0.1, "1")) == ("porosity",)
    assert equivalent("air-density", estimate(0.6, 0.1, "1")) == ()
    assert equivalent("lift", estimate(-0.2, 0.1, "1")) == ()


def test_an_effect_that_the_cloth_cannot_have_is_not_weighed(null: NullModel, reference: Reference) -> None:
    evidence, place = seen(null, {}), names().index(HOIST)
    curvature, score = evidence.curvature.copy(), evidence.score.copy()
    curvature[:, place] = curvature[:, :, place] = score[:, place] = 0.0
    found = judge(replace(evidence, curvature=curvature, score=score), reference, level=0.02)
    assert "full-hoist" not in {w.candidate.effect for w in found.ranking}
    assert "lift" in {w.candidate.effect for w in found.ranking}
