"""What is looked at beside the columns: moments, spectra, the course of the wind, where recordings
settle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import UsageError
from measure.inference import NullModel
from measure.loop import GUST_COLUMN, LibraryJudgement, judge
from measure.nulls import NullBank, Reference
from measure.verdict import NOT_REJECTED, Conclusion
from tests.measure.loop.drawn_statistics import (
    SEGMENTS,
    SHED,
    Acting,
    judged,
    made,
    named,
    pulses,
    seen,
    slow,
)


@pytest.fixture(scope="module")
def turning() -> tuple[NullModel, Reference]:
    """Of nulls whose moments are looked at."""
    bank = made(seed=7, moments=True)
    return bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)


def test_what_moments_alone_show_rejects_and_counts_in_what_an_effect_leaves(
    turning: tuple[NullModel, Reference],
) -> None:
    null, reference = turning
    drag, lift = {"tangential-quadratic-drag.coefficient": 1.0}, {"lift.coefficient": 1.0}

    def found(acting: Acting, moments: Acting) -> LibraryJudgement:
        return judge(seen(null, acting, moments=moments), reference, level=0.02)

    assert found({}, {}).conclusion in NOT_REJECTED
    assert found({}, drag).conclusion not in NOT_REJECTED
    assert (found(lift, lift).conclusion, named(found(lift, lift))) == (
        Conclusion.EFFECT,
        list(lift),
    )
    # A drag that moments alone show points to no effect that predicts unseen recordings better.
    assert (found(lift, lift | drag).conclusion, named(found(lift, lift | drag))) == (
        Conclusion.EFFECT,
        list(lift),
    )


def test_errors_that_swing_with_the_wind_are_described_and_reject_nothing(
    null: NullModel, reference: Reference
) -> None:
    found, plain = (
        judged(null, reference, {}, line=10.0, seed=3),
        judged(null, reference, {}, seed=3),
    )
    assert (found.conclusion, found.test.p) == (plain.conclusion, plain.test.p)
    assert found.line is not None
    assert (found.line.reduced, found.line.axis) == (SHED, 1)
    assert judged(null, reference, {}).line is None


def test_an_effect_beside_a_line_is_named(null: NullModel, reference: Reference) -> None:
    """What it leaves still swings, and no effect of the library does that."""
    found = judged(null, reference, {"lift.coefficient": 1.5}, line=4.0)
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, ["lift.coefficient"])
    assert found.line is not None


def test_spectra_of_the_data_alone_are_refused(bank: NullBank, null: NullModel) -> None:
    blind = replace(bank.nulls, statistics=replace(bank.nulls.statistics, lines=None))
    with pytest.raises(UsageError, match="spectra"):
        judged(null, replace(bank, nulls=blind).reference(12, noise=0.0, seed=1), {})


def test_a_course_alone_rejects_the_base_model(blowing: tuple[NullModel, Reference]) -> None:
    null, reference = blowing
    calm, windy = (
        judge(seen(null, {}, course=c), reference, level=0.02)
        for c in (np.zeros((3 * SEGMENTS, 10, 3)), pulses(0.3))
    )
    assert calm.conclusion in NOT_REJECTED
    assert windy.conclusion not in NOT_REJECTED
    assert windy.test.course == windy.test.statistic > calm.test.statistic


def test_gusts_are_named_where_the_course_is_turbulences(
    blowing: tuple[NullModel, Reference],
) -> None:
    null, reference = blowing
    # In twelve segments a draw in five leads by less than two standard errors.
    gusty = [
        named(judge(seen(null, {}, gusts=1.0, course=slow(0.2), seed=seed), reference, level=0.02))
        for seed in range(10)
    ]
    assert gusty.count(["gusts"]) >= 8
    assert gusty.count([]) == 10 - gusty.count(["gusts"])
    # The same pressure, in a wind that comes in pulses and turns a little, as behind obstacles that
    # pass.
    passing = judge(
        seen(null, {}, gusts=1.0, course=pulses(2.0, turned=0.2)), reference, level=0.02
    )
    assert "gusts" not in named(passing)
    assert (
        "varies across its mean by"
        in next(w for w in passing.ranking if w.column == GUST_COLUMN).candidate.why_not
    )


def test_a_wind_that_varies_along_itself_alone_is_not_barred_from_gusts(
    blowing: tuple[NullModel, Reference],
) -> None:
    null, reference = blowing
    slowly = judge(seen(null, {}, gusts=1.0, course=pulses(2.0)), reference, level=0.02)
    assert named(slowly) == ["gusts"]
    # Within segments alone: their mean pressure does not differ, and the course says how much it
    # varies.
    within = judge(seen(null, {}, course=pulses(2.0)), reference, level=0.02)
    assert (within.conclusion, named(within)) == (Conclusion.EFFECT, ["gusts"])
    found = next(w for w in within.ranking if w.column == GUST_COLUMN).candidate
    # Weaker by 2 in three windows of nine, and in both of two neighbours in two of nine: a
    # covariance of 4 (2/9 − 1/9).
    assert found.strength.point == pytest.approx(2 / 3, rel=0.1)
    assert not found.why_not


def test_courses_of_the_data_alone_are_refused(null: NullModel, reference: Reference) -> None:
    with pytest.raises(UsageError, match="courses"):
        judge(seen(null, {}, course=pulses(0.1)), reference, level=0.02)


def test_what_recordings_settle_at_rejects_nothing_and_leaves_a_verdict_open() -> None:
    bank = made(seed=9, settled=True)
    null, reference = bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)

    def found(off: float) -> LibraryJudgement:
        evidence = seen(null, {})
        return judge(replace(evidence, settled=np.full((12, 2), [0.0, off])), reference, level=0.02)

    # The mean of three recordings is 0.06 in nulls.
    assert found(0.05).test.p == found(-1.0).test.p > 0.02
    assert found(-1.0).conclusion is Conclusion.UNDECIDED
    departing = "the observables depart"
    assert departing in "".join(found(-1.0).open)
    assert departing not in "".join(found(0.05).open)


def test_settled_quantities_of_the_data_alone_are_refused(
    null: NullModel, reference: Reference
) -> None:
    with pytest.raises(UsageError, match="settled"):
        judge(replace(seen(null, {}), settled=np.zeros((12, 2))), reference, level=0.02)
