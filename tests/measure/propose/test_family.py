"""Errors as nulls have them are called significant as rarely as the level says, however many terms
are tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.forecasting import PRIOR
from measure.inference import NullModel, Nulls
from measure.probes import Statistics
from measure.propose.family import Family
from measure.propose.projected import evidence

DIRECTIONS, TERMS, KINDS, RECORDINGS, SEGMENTS = 12, 20, 30, 8, 2


def drawn(rng: np.random.Generator) -> tuple[Nulls, Statistics]:
    """Nulls of a covariance and of shifts from kind to kind, and projected responses to terms;
    calibrated parameters move the first three directions."""
    count = KINDS * RECORDINGS * SEGMENTS
    numerics = np.repeat(np.arange(KINDS), RECORDINGS * SEGMENTS)
    recording = np.repeat(np.arange(KINDS * RECORDINGS), SEGMENTS)
    mixing = rng.normal(size=(DIRECTIONS, DIRECTIONS)) / 3 + np.eye(DIRECTIONS)
    offsets = (rng.normal(size=(KINDS * 2, 3)) * PRIOR / 2)[
        np.repeat(np.arange(KINDS * 2), count // KINDS // 2)
    ]
    square = np.tile(np.eye(DIRECTIONS), (count, 1, 1))
    shifts = rng.normal(size=(KINDS, DIRECTIONS)) * np.linspace(1, 0, DIRECTIONS)
    r = shifts[numerics] + rng.normal(size=(count, DIRECTIONS)) @ mixing.T
    own = Statistics(
        recording=recording,
        r=r,
        response=square,
        error=np.ones(count),
        marker_error=np.ones((count, 1)),
    )
    nulls = Nulls(
        statistics=own,
        speeds=rng.uniform(3, 6, count),
        calibration=offsets,
        numerics=numerics,
        noise=np.zeros(count),
        period=np.full(count, 0.04),
        cloth=np.full(count, "made"),
    )
    terms = np.tile(rng.normal(size=(DIRECTIONS, TERMS)), (4, 1, 1))
    seen = Statistics(
        recording=np.array([0, 0, 1, 1]),
        r=np.zeros((4, DIRECTIONS)),
        error=np.ones(4),
        marker_error=np.ones((4, 1)),
        response=np.concatenate([square[:4, :, :3], terms], axis=2),
    )
    return nulls, seen


@pytest.mark.parametrize("level", [0.05, 0.2])
def test_nulls_of_numerics_never_seen_reach_the_level_as_often_as_it_says(level: float) -> None:
    rng = np.random.default_rng(5)
    below: list[bool] = []
    for _ in range(4):
        nulls, seen = drawn(rng)
        pool = list(range(3, 3 + TERMS))
        inside = nulls.numerics >= KINDS // 3
        model, family = (
            NullModel.fit(nulls.select(inside), nulls.design),
            Family.of(nulls.select(inside), seen, noise=0.0, seed=0),
        )
        others = nulls.select(~inside)
        for index in range(int(others.experiment.max()) + 1):
            chosen = np.flatnonzero(others.experiment == index)[:4]
            own = evidence(
                replace(seen, r=others.statistics.r[chosen]), others.speeds[chosen], model
            )
            largest = float(family.statistics(own)[pool].max())
            below.append(family.p_value(largest, pool) <= level)
    # 80 experiments, of which those of one kind are alike: three standard deviations of 40
    # independent ones.
    assert len(below) == 80
    assert np.mean(below) <= level + 3 * np.sqrt(level * (1 - level) / 40)


def test_a_term_that_acts_is_found_among_the_others() -> None:
    nulls, seen = drawn(np.random.default_rng(6))
    model, family = NullModel.fit(nulls, nulls.design), Family.of(nulls, seen, noise=0.0, seed=0)
    pool = list(range(3, 3 + TERMS))
    acting = replace(seen, r=20.0 * seen.response[:, :, 10])
    own = evidence(acting, np.full(4, 4.5), model)
    statistics = family.statistics(own)
    assert pool[int(np.argmax(statistics[pool]))] == 10
    assert family.p_value(float(statistics[10]), pool) < 0.01
