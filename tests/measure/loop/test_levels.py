"""Shares of drawn null experiments that are rejected, and of intervals that contain what they are
of."""

from __future__ import annotations

import numpy as np
import pytest

from measure.forecasting import THETA
from measure.inference import NullModel
from measure.loop import judge
from measure.nulls import Reference
from measure.verdict import NOT_REJECTED, Conclusion
from tests.measure.loop.drawn_statistics import judged, made, seen


@pytest.fixture(scope="module")
def judges() -> list[tuple[NullModel, Reference]]:
    """Of ten banks."""
    banks = [made(seed) for seed in range(10)]
    return [
        (bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)) for bank in banks
    ]


def test_nothing_is_found_where_nothing_acts(judges: list[tuple[NullModel, Reference]]) -> None:
    """By six banks, 40 nulls each, at 5 %: 12 of 240 are expected, and more than 18 come once in 30
    times."""
    rejected = 0
    for null, reference in judges[:6]:
        chances = [reference.test(seen(null, {}, seed=seed)).p for seed in range(40)]
        rejected += sum(p <= 0.05 for p in chances)
    assert rejected <= 18


def test_what_is_not_rejected_needs_no_effect(null: NullModel, reference: Reference) -> None:
    found = [judged(null, reference, {}, seed=seed) for seed in range(20)]
    assert [j.conclusion in NOT_REJECTED for j in found] == [j.test.p > 0.02 for j in found]
    assert all(not j.named for j in found if j.conclusion in NOT_REJECTED)


def test_a_level_that_the_kinds_cannot_test_is_not_tested(
    null: NullModel, reference: Reference
) -> None:
    """By 50 kinds of numerics no p is below 1/51."""
    data = seen(null, {"lift.coefficient": 1.0})
    assert judge(data, reference, level=1 / 51 + 1e-9).conclusion is Conclusion.EFFECT
    untested = judge(data, reference, level=0.019)
    assert (untested.conclusion, untested.named) == (Conclusion.UNTESTED, ())


def test_intervals_of_the_calibrated_parameters_contain_those_of_new_kinds(
    judges: list[tuple[NullModel, Reference]],
) -> None:
    """Of 90 %: by ten banks, 20 experiments each of their own kind, whose numerics move all
    directions."""
    held = []
    for null, reference in judges:
        for place in range(20):
            own = seen(null, {}, seed=1000 + place).fit(()).in_errors(range(len(THETA)))
            held.append(np.abs(own) <= reference.reach)
    share = np.mean(held, axis=0)
    # 200 experiments against ten quantiles of 50 kinds each: a standard error of 0.02 and one of
    # 0.013.
    assert (np.abs(share - 0.9) < 3 * 0.025).all(), share
