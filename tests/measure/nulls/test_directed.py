"""One test along the directions of effects, on experiments that are drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from flagdata.core.arrays import FloatArray
from measure.nulls import GroupedConformal
from measure.nulls.directed_test import DirectedTest, Sought, Summary, beside
from models.trained.outliers import shrunk_covariance

COLUMNS, SEGMENTS = 20, 12
HIDDEN = 1e-4
"""What the last effect's expected strength does, in standard deviations of one column."""
SOUGHT = (
    Sought(name="first", expected=1.0, signs=(1,)),
    Sought(name="second", expected=2.0, signs=(1, -1)),
    Sought(name="hidden", expected=1.0, signs=(1, -1)),
)


class World:
    """Experiments of one known covariance, in which effects do what is known."""

    def __init__(self, seed: int, *, spread: float = 1.0) -> None:
        self.rng = np.random.default_rng(seed)
        mixed = self.rng.normal(size=(COLUMNS, COLUMNS))
        self.chance = mixed @ mixed.T / COLUMNS + 0.3 * np.eye(COLUMNS)
        self.covariance = (1 + spread) * self.chance
        self.directions = self.rng.normal(size=(COLUMNS, 3)) / [1.0, 2.0, 1 / HIDDEN]

    def experiment(self, acting: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Summary:
        chance = self.rng.multivariate_normal(np.zeros(COLUMNS), self.covariance)
        return Summary(
            values=chance + self.directions @ np.array(acting),
            directions=self.directions,
            unknown=np.zeros((COLUMNS, 1)),
            covariates=self.rng.normal(0.0, 0.1, 2),
            damping=float(self.rng.uniform(-2, 2)),
        )

    def test(self, kinds: int) -> DirectedTest:
        within = [
            self.rng.multivariate_normal(np.zeros(COLUMNS), self.chance, SEGMENTS)
            for _ in range(kinds)
        ]
        return DirectedTest.of(SOUGHT, [self.experiment() for _ in range(kinds)], within)

    def ideal(self, effect: int) -> float:
        """z of an effect at its expected strength in the mean, were the covariance known."""
        direction = self.directions[:, effect] * SOUGHT[effect].expected
        return math.sqrt(direction @ np.linalg.solve(self.covariance, direction))


def p_of(test: DirectedTest, summary: Summary, free: tuple[int, ...] = ()) -> float:
    scores = test.scores(summary, free)
    kinds = np.arange(len(scores.of_kinds))
    return GroupedConformal(null=scores.of_kinds, kinds=kinds).p(scores.farthest)


def covariance_by_sums(rows: FloatArray) -> FloatArray:
    """Ledoit and Wolf's estimate, as their section 3.2 has it."""
    about = rows - rows.mean(axis=0)
    sample = sum(np.outer(row, row) for row in about) / len(about)
    columns = len(sample)
    mean = np.trace(sample) / columns
    far = np.linalg.norm(sample - mean * np.eye(columns)) ** 2 / columns
    off = sum(np.linalg.norm(np.outer(row, row) - sample) ** 2 for row in about)
    chance = min(off / columns / len(about) ** 2, far)
    return np.asarray(chance / far * mean * np.eye(columns) + (far - chance) / far * sample)


def test_a_covariance_is_shrunk_as_ledoit_and_wolf_have_it() -> None:
    rows = np.random.default_rng(3).normal(size=(9, 5)) * [1.0, 2.0, 3.0, 1.0, 0.5]
    np.testing.assert_allclose(shrunk_covariance(rows)[0], covariance_by_sums(rows), rtol=1e-12)


def test_scores_are_those_of_the_equation() -> None:
    rng = np.random.default_rng(4)
    kinds = [
        Summary(
            values=rng.normal(size=3),
            directions=np.eye(3)[:, :1],
            unknown=np.array([[0.0], [0.7], [0.0]]),
            covariates=np.zeros(1),
        )
        for _ in range(7)
    ]
    # Within kinds all columns are alike and independent, so that V is shrunk as the columns are.
    within = [np.repeat(np.r_[np.eye(3), -np.eye(3)], 2, axis=0)] * 7
    sought = (Sought(name="one", expected=2.0, signs=(1,)),)
    seen = replace(kinds[0], values=np.array([2.0, 1.0, 0.0]))
    scores = DirectedTest.of(sought, kinds, within).scores(seen)

    def z(values: FloatArray, others: list[Summary]) -> tuple[float, float]:
        rows = np.stack([other.values for other in others])
        residuals = rows - rows.mean(axis=0)
        size = math.exp(np.log(((residuals / residuals.std(axis=0)) ** 2).mean(axis=1)).mean() / 2)
        residuals = residuals / size
        chance = np.diag((np.concatenate(within) ** 2).mean(axis=0))
        chance += 1e-6 * np.diag((1 / residuals.var(axis=0)).mean() * residuals.var(axis=0)) / 3
        root = np.sqrt(chance)
        inverse = np.linalg.inv(root)
        covariance = root @ covariance_by_sums(residuals @ inverse) @ root * size**2
        covariance += np.diag([0.0, 0.49, 0.0])
        gained = np.linalg.solve(covariance, (values - rows.mean(axis=0)))[0]
        information = np.linalg.inv(covariance)[0, 0]
        return gained / math.sqrt(information), information

    found = [z(k.values, [o for o in kinds if o is not k]) for k in kinds]
    usual = np.median([information for _, information in found])
    factor = math.sqrt(usual / (usual + (0.25 * 2.0) ** -2))
    of_kinds = factor * np.array([value for value, _ in found])
    data = factor * z(np.array([2.0, 1.0, 0.0]), kinds)[0]
    own = (data - of_kinds.mean()) / of_kinds.std(ddof=1)
    assert scores.farthest == pytest.approx(own, rel=1e-5)
    others = np.delete(of_kinds, 2)
    expected = (of_kinds[2] - others.mean()) / others.std(ddof=1)
    assert scores.of_kinds[2] == pytest.approx(expected, rel=1e-5)


def test_an_effect_that_makes_most_of_the_errors_does_not_hide_itself() -> None:
    """Its vector and all it moves by are in units of the errors, ten times as large."""
    world = World(9)
    test, plain = world.test(60), world.experiment((60 / world.ideal(0), 0.0, 0.0))
    smaller = Summary(
        values=plain.values / 10,
        directions=plain.directions / 10,
        unknown=plain.unknown / 10,
        covariates=plain.covariates,
        damping=plain.damping,
    )
    assert test.scores(smaller).farthest > 0.09 * test.scores(plain).farthest > 3


def test_what_acts_is_found_nearly_as_often_as_along_its_own_known_direction() -> None:
    found, named = [], []
    for seed in range(15):
        world = World(seed)
        test, size = world.test(60), 3.0 / world.ideal(0)
        for _ in range(8):
            scores = test.scores(world.experiment((size, 0.0, 0.0)))
            statistic, null = scores.along(0, 1)
            found.append(statistic > np.quantile(null, 0.95))
            named.append(scores.within(0.0) == [0])
    ideal = norm.sf(norm.isf(0.05) - 3.0)  # 0.91 of draws, were the covariance known
    assert np.mean(found) > ideal - 0.1
    assert np.mean(named) > 0.75


def test_the_level_is_held_by_experiments_of_kinds_that_were_not_seen() -> None:
    p = [
        p_of(test, world.experiment())
        for seed in range(10)
        for world in [World(seed)]
        for test in [world.test(39)]
        for _ in range(20)
    ]
    # 200 draws of which 20 share a bank: three standard errors of 5 % of each.
    assert np.mean(np.array(p) <= 0.05) < 0.05 + 3 * math.sqrt(0.05 * 0.95 / 100)


def test_a_direction_that_the_design_does_not_show_has_no_power_and_gives_no_alarm() -> None:
    world = World(5)
    test = world.test(60)
    scores = test.scores(world.experiment())
    null, moved = scores.of_kinds, scores.of_kinds_with(2, 5 * SOUGHT[2].expected)
    np.testing.assert_allclose(moved, null, atol=0.01)
    alone = np.array([abs(test.scores(world.experiment()).z[2]) for _ in range(20)])
    assert (alone < 0.05).all()


def test_what_is_free_is_not_tested_and_what_acts_beside_it_is_found() -> None:
    world = World(6)
    test = world.test(60)
    both = world.experiment((40 / world.ideal(0), 2 * 12 / world.ideal(1), 0.0))
    assert p_of(test, both, free=(0,)) == pytest.approx(1 / 61)
    assert test.scores(both, free=(0,)).within(0.0) == [1]
    p = [
        p_of(test, world.experiment((40 / world.ideal(0), 0.0, 0.0)), free=(0,)) for _ in range(20)
    ]
    assert np.mean(np.array(p) <= 0.05) < 0.2
    assert test.scores(both, free=(0, 1)).largest[[0, 1]].tolist() == [-math.inf, -math.inf]


def test_kinds_on_which_an_effect_acts_move_as_experiments_on_which_it_does() -> None:
    world = World(7)
    test = world.test(40)
    acting = [test.scores(world.experiment((3.0, 0.0, 0.0))).largest[0] for _ in range(60)]
    own = test.scores(world.experiment())
    moved = own.of_kinds_with(0, 3.0)
    assert np.median(moved) == pytest.approx(np.median(acting), rel=0.15)
    assert np.median(moved) > np.median(own.of_kinds) + 1


def test_a_second_test_takes_its_share_of_the_alarms() -> None:
    rng = np.random.default_rng(8)
    first, second = rng.gumbel(2.0, 0.6, 4000), rng.gumbel(-1.0, 3.0, 4000)
    scaled, value = beside(first, second, 20.0, share=0.2)
    larger = np.maximum(first, scaled)
    alarms = larger > np.quantile(larger, 0.95)
    assert np.mean(scaled[alarms] > first[alarms]) == pytest.approx(0.2, abs=0.06)
    out = (20.0 - second.mean()) / second.std(ddof=1) - math.sqrt(6) / math.pi * math.log(4)
    assert value == pytest.approx(first.mean() + first.std(ddof=1) * out)
