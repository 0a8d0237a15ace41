"""Inference on made statistics that obey its model exactly, where the answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest, uniform

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError, UsageError
from measure.forecasting import PRIOR, THETA, Design
from measure.inference import Evidence, NullModel, Nulls, gains
from measure.inference.fluctuation import fluctuation
from measure.nulls import GUSTS, NullBank
from measure.probes import Statistics

COLUMNS, KINDS, CLOTHS, WINDS, SEGMENTS = 8, 40, 1, 4, 4
RECORDINGS = KINDS * CLOTHS * WINDS


class World:
    """r = μ(U) + shift of the numerics + R δ + ε, with ε ~ N(0, Σ)."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        factor = self.rng.normal(size=(COLUMNS, COLUMNS)) / 2
        self.covariance = factor @ factor.T + np.eye(COLUMNS)
        self.slopes = self.rng.normal(size=(3, COLUMNS)) * np.array([[1.0], [0.2], [0.02]])
        self.direction = 2 * self.rng.normal(size=COLUMNS)

    def draw(
        self, delta: FloatArray, *, recordings: int, numerics: FloatArray, speeds: FloatArray
    ) -> Statistics:
        """Segments of recordings with coefficients (recording, column)."""
        recording = np.repeat(np.arange(recordings), SEGMENTS)
        response = self.rng.normal(size=(len(recording), COLUMNS, COLUMNS)) + 4 * np.eye(COLUMNS)
        noise = self.rng.multivariate_normal(
            np.zeros(COLUMNS), self.covariance, size=len(recording)
        )
        u = speeds[recording]
        mean = (
            np.stack([np.ones_like(u), u, u**2], axis=1) @ self.slopes
            + numerics[recording, None] * self.direction
        )
        r = mean + np.einsum("sij,sj->si", response, delta[recording]) + noise
        return Statistics(
            recording=recording,
            r=r,
            response=response,
            error=np.ones(len(r)),
            marker_error=np.ones((len(r), 1)),
        )

    def nulls(self) -> Nulls:
        kinds = np.repeat(np.arange(KINDS), CLOTHS * WINDS)
        offsets = np.repeat(
            self.rng.normal(size=(KINDS * CLOTHS, len(THETA))) * PRIOR, WINDS, axis=0
        )
        delta = np.zeros(
            (RECORDINGS, COLUMNS)
        )  # statistics are taken at each one's own calibration
        speeds = self.rng.uniform(3, 8, RECORDINGS)
        shift = np.repeat(self.rng.normal(size=KINDS * CLOTHS), WINDS)
        own = self.draw(delta, recordings=RECORDINGS, numerics=shift, speeds=speeds)
        return Nulls(
            statistics=own,
            speeds=speeds[own.recording],
            calibration=offsets[own.recording],
            numerics=kinds[own.recording],
            noise=np.zeros(len(own.recording)),
            period=np.full(len(own.recording), 0.04),
            cloth=np.full(len(own.recording), "made"),
        )

    def data(self, null: NullModel, delta: FloatArray) -> Evidence:
        """Three recordings of one cloth in one kind of numerics."""
        speeds = np.array([3.5, 5.0, 7.0])
        shift = np.full(3, self.rng.normal())
        own = self.draw(np.tile(delta, (3, 1)), recordings=3, numerics=shift, speeds=speeds)
        return Evidence.of(own, speeds[own.recording], null)


@pytest.fixture(scope="module")
def world() -> World:
    return World(1)


@pytest.fixture(scope="module")
def null(world: World) -> NullModel:
    nulls = world.nulls()
    return NullModel.fit(nulls, nulls.design)


def effect(strength: float, column: int = 5) -> FloatArray:
    delta = np.zeros(COLUMNS)
    delta[column] = strength
    return delta


def test_coefficients_that_nothing_was_taken_along_are_found_by_the_other_columns() -> None:
    world = World(7)
    null = NullModel.fit(world.nulls(), world.nulls().design)
    speeds, strengths = np.array([3.5, 5.0, 7.0]), np.array([3.0, -2.0])
    own = world.draw(np.zeros((3, COLUMNS)), recordings=3, numerics=np.zeros(3), speeds=speeds)
    beside = world.rng.normal(size=(len(own.r), COLUMNS, 2))
    moved = replace(own, r=own.r + beside @ strengths)
    evidence = Evidence.of(moved, speeds[own.recording], null, further=beside)
    assert not {COLUMNS, COLUMNS + 1} & set(evidence.nuisance)
    fit = evidence.fit([COLUMNS, COLUMNS + 1])
    for place, strength in enumerate(strengths):
        value, error = fit.of(COLUMNS + place)
        assert abs(value - strength) < 3.5 * error < 0.5 * abs(strength)


def test_the_null_model_finds_mean_and_covariance(world: World, null: NullModel) -> None:
    speeds = np.array([3.0, 5.0, 8.0])
    features = np.stack([np.ones(3), speeds, speeds**2], axis=1)
    # Forty experiments, whose shift has deviation 1: 1/√40 of the direction, twice that at a
    # parabola's ends; three deviations, and as many of the noise of 640 segments.
    bound = 6 / 40**0.5 * np.abs(world.direction) + 0.5
    assert (np.abs(null.mean(speeds) - features @ world.slopes) < bound).all()
    ratio = np.diag(null.covariance) / np.diag(world.covariance)
    np.testing.assert_allclose(ratio, 1.0, atol=0.4)  # 5 % by 640 segments, more by the inflation


def test_the_mean_is_that_of_the_design_of_the_data(world: World) -> None:
    # Nulls whose r rise by 3 a mm² of noise and fall by 2 for 10 ms of period; of 40 experiments,
    # as above.
    nulls, rng = world.nulls(), np.random.default_rng(3)
    kinds = np.arange(nulls.numerics.max() + 1)
    noise, period = rng.choice([0.0, 1e-3, 2e-3], len(kinds))[nulls.numerics], (0.03, 0.04)
    period = rng.choice(period, len(kinds))[nulls.numerics]
    moved = (
        nulls.statistics.r
        + 3.0 * (1e3 * noise[:, None]) ** 2
        - 2.0 * (period[:, None] - 0.04) / 0.01
    )
    seen = replace(nulls, statistics=replace(nulls.statistics, r=moved), noise=noise, period=period)
    speed = np.array([5.0])
    plain = NullModel.fit(nulls, nulls.design).mean(speed)
    found = NullModel.fit(seen, Design(noise=1e-3, period=0.03, cloth="made")).mean(speed)
    bound = 12 / 40**0.5 * np.abs(world.direction) + 0.5
    assert (np.abs(found - plain - 5.0) < bound).all()


def of_cloths(world: World, moves: dict[str, FloatArray]) -> Nulls:
    """Nulls of cloths in turn, one to a kind of numerics, whose means are moved."""
    nulls = world.nulls()
    cloth = np.array(list(moves))[nulls.numerics % len(moves)]
    moved = nulls.statistics.r + np.stack([moves[str(name)] for name in cloth])
    return replace(nulls, statistics=replace(nulls.statistics, r=moved), cloth=cloth)


def test_the_mean_is_that_of_the_cloth_of_the_data() -> None:
    world = World(1)
    moves = {name: 6 * world.rng.normal(size=COLUMNS) for name in ("wool", "silk", "felt", "jute")}
    centre = np.mean(list(moves.values()), axis=0)
    nulls = of_cloths(world, moves)
    speed = np.array([5.0])
    unknown = NullModel.fit(nulls, replace(nulls.design, cloth="linen"))
    for name, move in moves.items():
        known = NullModel.fit(nulls, replace(nulls.design, cloth=name))
        # Of the five kinds of a cloth: their shifts have deviation 1 along the direction, two
        # experiments each; and of the 160 segments noise. Three deviations.
        bound = (
            3 * (np.abs(world.direction) / 10**0.5 + np.sqrt(np.diag(world.covariance) / 160)) + 0.2
        )
        assert (
            np.abs((known.mean(speed) - unknown.mean(speed))[0] - (move - centre)) < bound
        ).all(), name
        # How cloths differ is a shift of one that is not known, and of no other.
        spread = [np.linalg.norm(model.shifts) for model in (known, unknown)]
        assert spread[0] < 0.75 * spread[1]


def test_cloths_that_are_alike_move_no_mean() -> None:
    # Where the cloth moves nothing, its share is a few hundredths: the moments of 20 kinds say it
    # is little or none.
    world = World(1)
    nulls = of_cloths(world, {name: np.zeros(COLUMNS) for name in ("wool", "silk", "felt", "jute")})
    speed = np.array([5.0])
    means = [
        NullModel.fit(nulls, replace(nulls.design, cloth=name)).mean(speed)[0]
        for name in ("wool", "silk", "none")
    ]
    own = np.linalg.solve(
        np.linalg.cholesky(world.covariance), np.stack([means[0] - means[2], means[1] - means[2]]).T
    )
    assert np.abs(own).max() < 1.0


def test_the_null_model_finds_how_numerics_shift_the_mean(world: World, null: NullModel) -> None:
    first = null.shifts[0]
    cosine = first @ world.direction / np.linalg.norm(first) / np.linalg.norm(world.direction)
    assert abs(cosine) > 0.9


def test_recordings_of_one_cloth_by_one_numerics_are_one_experiment(world: World) -> None:
    nulls = world.nulls()
    together = nulls.experiment[:, None] == nulls.experiment[None, :]
    place = np.arange(len(nulls.speeds)) // (WINDS * SEGMENTS)
    assert (together == (place[:, None] == place[None, :])).all()


def test_p_values_of_nulls_are_uniform() -> None:
    world = World(3)
    columns = (
        *(name for name, _, _ in THETA),
        *(f"c{k}" for k in range(COLUMNS - len(THETA) - 1)),
        GUSTS,
    )
    bank = NullBank(nulls=world.nulls(), columns=columns, duration=2.0, words="made")
    null, reference = bank.model(bank.nulls.design), bank.reference(3 * SEGMENTS, noise=0.0, seed=0)
    found = []
    for _ in range(150):
        data = world.data(null, effect(0.0))
        found.append(reference.test(data).p)
    # Of 150 draws against 40 experiments: their quantiles are themselves uncertain by 1/√40 at the
    # most.
    assert kstest(found, uniform.cdf).statistic < 2 / 40**0.5
    assert np.mean(np.array(found) <= 0.05) < 0.05 + 3 * (0.05 / 40) ** 0.5


def test_a_bank_of_shorter_experiments_than_the_data_is_refused(world: World) -> None:
    columns = (
        *(name for name, _, _ in THETA),
        *(f"c{k}" for k in range(COLUMNS - len(THETA) - 1)),
        GUSTS,
    )
    bank = NullBank(nulls=world.nulls(), columns=columns, duration=2.0, words="made")
    with pytest.raises(InputError, match="17 segments"):
        bank.reference(WINDS * SEGMENTS + 1, noise=0.0, seed=0)


@pytest.fixture
def worlds() -> list[tuple[World, NullModel]]:
    """Thirty worlds, each with a null model of its own: one model of 40 kinds knows a variance to
    √(2/40) = 22 %, and all draws against it share that."""
    found = []
    for seed in range(30):
        own = World(seed)
        nulls = own.nulls()
        found.append((own, NullModel.fit(nulls, nulls.design)))
    return found


def test_strengths_are_found_within_their_errors(worlds: list[tuple[World, NullModel]]) -> None:
    scores = []
    for own, null in worlds:
        for value, error in (own.data(null, effect(0.3)).fit([5]).of(5) for _ in range(10)):
            scores.append((value - 0.3) / error)
    # Of 300 draws against 30 models: the mean within 4/√300, the spread within a fifth.
    assert abs(np.mean(scores)) < 0.23
    assert np.std(scores) == pytest.approx(1.0, abs=0.2)


def test_drops_of_nulls_follow_a_chi_square_of_one(worlds: list[tuple[World, NullModel]]) -> None:
    drops = np.array(
        [own.data(null, effect(0.0)).drops()[5] for own, null in worlds for _ in range(10)]
    )
    # A model's inflated covariance makes them somewhat smaller; the share beyond has a deviation of
    # 0.017.
    assert 0.7 < drops.mean() < 1.2
    assert kstest(drops, chi2(1).cdf).pvalue > 1e-3
    for level in (0.5, 0.1, 0.05):
        assert (
            abs(np.mean(drops > chi2(1).isf(level)) - level)
            < 4 * (level * (1 - level) / 300) ** 0.5
        )


def test_drops_are_those_of_fits(world: World, null: NullModel) -> None:
    evidence = world.data(null, effect(0.5))
    without, with_it = evidence.fit(()).remainder, evidence.fit([5]).remainder
    assert evidence.drops()[5] == pytest.approx(without - with_it, rel=1e-6)
    beside = evidence.fit([4]).remainder - evidence.fit([4, 5]).remainder
    assert evidence.drops([4])[5] == pytest.approx(beside, rel=1e-6)


def test_an_unobserved_column_carries_no_information() -> None:
    """An effect without a moment, among moments: neither it nor the others are disturbed."""
    world = World(5)
    nulls, unseen = world.nulls(), 7

    def blind(statistics: Statistics) -> Statistics:
        r, response = statistics.r.copy(), statistics.response.copy()
        r[:, unseen] = response[:, unseen, :] = response[:, :, unseen] = 0.0
        return replace(statistics, r=r, response=response)

    null = NullModel.fit(replace(nulls, statistics=blind(nulls.statistics)), nulls.design)
    speeds = np.repeat([3.5, 5.0, 7.0], SEGMENTS)
    found = world.draw(
        np.tile(effect(0.6), (3, 1)),
        recordings=3,
        numerics=np.zeros(3),
        speeds=np.array([3.5, 5.0, 7.0]),
    )
    evidence = Evidence.of(blind(found), speeds, null)
    drops = evidence.drops()
    assert drops[unseen] == 0.0
    assert np.argmax(drops) == 5
    value, error = evidence.fit([5]).of(5)
    assert abs(value - 0.6) < 4 * error


def test_moments_of_nulls_or_data_alone_are_refused(world: World, null: NullModel) -> None:
    own = world.draw(
        np.zeros((3, COLUMNS)), recordings=3, numerics=np.zeros(3), speeds=np.full(3, 5.0)
    )
    with pytest.raises(UsageError, match="only the nulls or only the data have moments"):
        Evidence.of(replace(own, turning=own), np.full(3 * SEGMENTS, 5.0), null)


def test_always_fitted_columns_never_drop(world: World, null: NullModel) -> None:
    assert not world.data(null, effect(0.5)).drops()[: len(THETA)].any()


def test_the_true_effect_predicts_left_out_recordings_best(world: World, null: NullModel) -> None:
    best = [
        int(np.argmax(gains(world.data(null, effect(0.6)), [[3], [4], [5], [6], [7]]).sum(axis=1)))
        for _ in range(20)
    ]
    assert best == [2] * 20


def test_what_is_not_there_gains_nothing(world: World, null: NullModel) -> None:
    gained = [gains(world.data(null, effect(0.0)), [[5]]).sum() for _ in range(100)]
    # Half a unit is what one free coefficient loses on as much data again; no gain in the mean.
    assert np.mean(gained) < 0.1


def fluctuating(world: World, null: NullModel) -> Evidence:
    """Of a strength that is another in each segment, with a deviation of 0.5."""
    evidence = world.data(null, effect(0.0))
    extra = world.rng.normal(0, 0.5, len(evidence.recording))
    column = evidence.curvature[:, :, 5]
    return Evidence(
        recording=evidence.recording,
        curvature=evidence.curvature,
        columns=evidence.columns,
        score=evidence.score + extra[:, None] * column,
        energy=evidence.energy
        + 2 * extra * evidence.score[:, 5]
        + extra**2 * evidence.curvature[:, 5, 5],
    )


def test_a_fluctuation_is_found_with_its_size(world: World, null: NullModel) -> None:
    found = [fluctuation(fluctuating(world, null), 5).deviation for _ in range(40)]
    # Twelve segments a draw: their spread of 20 % averages to 4 % over 40.
    assert np.mean(found) == pytest.approx(0.5, rel=0.2)


def test_a_constant_does_not_fluctuate(worlds: list[tuple[World, NullModel]]) -> None:
    """Of a strength that is the same in all segments, a likelihood ratio no larger than that of
    nulls."""
    constant, nothing = (
        np.array(
            [
                fluctuation(own.data(null, effect(size)), 5).likelihood
                for own, null in worlds
                for _ in range(5)
            ]
        )
        for size in (0.5, 0.0)
    )
    error = nothing.std() / np.sqrt(len(nothing))
    assert np.mean(constant) < np.mean(nothing) + 3 * error
    # What does fluctuate, by as much as the constant is: far beyond.
    swinging = [fluctuation(fluctuating(own, null), 5).likelihood for own, null in worlds]
    assert np.mean(constant) + 3 * error < np.mean(swinging)


def test_what_is_left_beside_a_free_coefficient_is_that_of_a_coefficient_for_every_segment(
    world: World, null: NullModel
) -> None:
    """Least squares of the nuisances and of column 5 in each segment, written out in full."""
    evidence = world.data(null, effect(0.4))
    nuisance, count = evidence.nuisance, len(evidence.recording)
    total, score, energy = evidence._total()  # pyright: ignore[reportPrivateUsage]
    across = evidence.curvature[:, nuisance, 5].T
    curvature = np.block(
        [
            [total[np.ix_(nuisance, nuisance)], across],
            [across.T, np.diag(evidence.curvature[:, 5, 5])],
        ]
    )
    right = np.concatenate([score[nuisance], evidence.score[:, 5]])
    assert len(right) == len(nuisance) + count
    left = energy - right @ np.linalg.solve(curvature, right)
    freed = evidence.freed(5)
    assert freed.fit(()).remainder == pytest.approx(left, rel=1e-9)
    assert freed.drops()[5] == 0
    assert fluctuation(freed, 5).likelihood == pytest.approx(0, abs=1e-9)


def test_nulls_fluctuate_little(world: World, null: NullModel) -> None:
    assert (
        np.median([fluctuation(world.data(null, effect(0.0)), 5).deviation for _ in range(40)])
        < 0.1
    )


def test_what_numerics_leave_is_that_of_the_damping_of_the_data(world: World) -> None:
    """Where all of r is 1.5 times larger for each factor of e in the damping, so are the mean, the
    shifts and Σ of a design's null model."""
    nulls = world.nulls()
    rng = np.random.default_rng(5)
    damping = rng.uniform(-1.5, 2.5, nulls.experiment.max() + 1)[nulls.experiment]
    calibration = nulls.calibration.copy()
    calibration[:, 2] = damping
    larger = nulls.statistics.r * np.exp(np.log(1.5) * damping)[:, None]
    seen = replace(nulls, statistics=replace(nulls.statistics, r=larger), calibration=calibration)
    speeds = np.array([3.0, 5.0, 8.0])
    plain = NullModel.fit(nulls, nulls.design)
    for step in (-1.0, 0.0, 2.0):
        own = NullModel.fit(seen, replace(nulls.design, damping=2.5e-3 * np.exp(step)))
        ratio = np.sqrt(np.diag(own.covariance) / np.diag(plain.covariance))
        np.testing.assert_allclose(ratio, 1.5**step, rtol=0.15)
        np.testing.assert_allclose(
            np.linalg.norm(own.shifts[0]) / np.linalg.norm(plain.shifts[0]), 1.5**step, rtol=0.2
        )
        np.testing.assert_allclose(
            own.mean(speeds), 1.5**step * plain.mean(speeds), rtol=0.2, atol=0.6 * 1.5**step
        )


def test_what_a_parameter_takes_in_shows_on_recordings_left_out() -> None:
    """An effect that grows by the square of the wind, beside a parameter that does the same in all:
    to 9, 25 and 49 the mean, 27.7, leaves squares of 809; each left out, the mean of the others
    leaves 784 + 16 + 1024."""
    count, segments = len(THETA) + 1, 12
    recording, speeds = np.repeat(np.arange(3), 4), np.repeat([3.0, 5.0, 7.0], 4)
    free = np.array([1e3, 1e-3, 1e-3])
    null = NullModel(
        coefficients=np.zeros((3, count)),
        covariance=np.eye(count),
        shifts=np.zeros((0, count)),
        prior=free,
    )
    response = np.zeros((segments, count, count))
    response[:, 0, 0], response[:, 0, -1] = 1.0, speeds**2
    found = Statistics(
        recording=recording,
        r=response[:, :, -1],
        response=response,
        error=np.ones(segments),
        marker_error=np.ones((segments, 1)),
    )
    evidence = Evidence.of(found, speeds, null)
    assert evidence.drops()[-1] / 2 == pytest.approx(4 * 809 / 2, rel=1e-2)
    last = evidence.columns - 1
    assert gains(evidence, [[last]]).sum() == pytest.approx(4 * 1824 / 2, rel=1e-2)
