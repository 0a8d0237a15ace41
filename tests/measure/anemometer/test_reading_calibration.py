"""Laws of the regression of a log on what windows show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError, RefusedError
from measure.cloth import Log
from measure.measuring_model.intervals import half_width, mean_errors
from measure.measuring_model.regression import Ridge, blocks_of, validate_penalties, with_neighbours
from tests.measure.anemometer.made import STEP, features, gusts, model, recording, slow

_RNG = np.random.default_rng(3)


def test_a_ridge_without_a_penalty_is_the_least_squares_line() -> None:
    """Of wind = 2 + 3 a − b exactly."""
    rows = _RNG.normal(size=(50, 2))
    found = Ridge.fitted(rows, 2 + 3 * rows[:, 0] - rows[:, 1], 1e-9)
    np.testing.assert_allclose(
        found(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])), [2.0, 5.0, 1.0], atol=1e-6
    )


def test_neighbours_stand_beside_each_window_and_missing_ones_are_the_window_itself() -> None:
    values = np.array([[1.0], [2.0], [np.nan], [4.0]])
    np.testing.assert_array_equal(
        with_neighbours(values)[[0, 1, 3]], [[1, 1, 2], [2, 1, 2], [4, 4, 4]]
    )


def test_blocks_are_twenty_seconds_of_one_recording() -> None:
    found = blocks_of(np.array([0.0, 19.0, 21.0, 0.0, 19.0]), np.array([0, 0, 0, 1, 1]))
    assert found[0] == found[1]
    assert found[3] == found[4]
    assert len({found[0], found[2], found[3]}) == 3


def test_slow_noise_is_not_read_as_skill() -> None:
    """Features that have nothing but their slowness in common with the wind predict nothing of
    blocks that were left out; single windows that are left out are interpolated between their
    neighbours, which looks like skill."""
    both = slow(np.random.default_rng(3).standard_normal((300, 81)), 8.0)
    rows, wind = both[:, :80], both[:, 80]
    by_blocks = validate_penalties(
        rows,
        wind,
        blocks_of(STEP * np.arange(300, dtype=np.float64), np.zeros(300, int)),
        np.zeros(80, bool),
    )
    assert by_blocks.rmse > 0.97 * wind.std()
    by_windows = np.empty(300)
    for k in range(300):
        others = np.arange(300) != k
        by_windows[k] = wind[k] - Ridge.fitted(rows[others], wind[others], 1.0)(rows[[k]])[0]
    assert by_windows.std() < 0.65 * wind.std()


def test_a_few_features_that_say_much_have_a_penalty_of_their_own() -> None:
    """Of wind = a + noise beside 99 columns of noise: the error is nearly that of a regression on a
    alone."""
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((200, 100))
    wind = rows[:, 0] + 0.2 * rng.standard_normal(200)
    blocks = blocks_of(STEP * np.arange(200, dtype=np.float64), np.zeros(200, int))
    named = np.arange(100) == 0
    assert validate_penalties(rows, wind, blocks, named).rmse < 1.15 * 0.2
    assert validate_penalties(rows, wind, blocks, np.zeros(100, bool)).rmse > 1.3 * 0.2


def test_intervals_contain_the_wind_and_the_error_is_that_of_the_features() -> None:
    """The best linear reading of a window has the variance σ²/(1 + s) of its four features, with s
    the sum of their squared slopes over their noise; the log adds its own scatter and what it
    misses between samples."""
    found = model()
    slopes = np.array([1.0, 1.0, 0.5, 2.0]) / 0.3
    best = 0.8 / np.sqrt(1 + np.square(slopes).sum())
    wind = gusts(240.0, seed=11)
    later = features(wind, seed=11)
    times, speed = wind
    truth = np.array([speed[(times >= a) & (times < a + STEP)].mean() for a in later.starts])
    read = found.model.read(found.model.used(later))
    assert np.sqrt(np.mean((read - truth) ** 2)) < 1.5 * best
    assert found.uncalibrated_rmse > 4 * found.model.rmse
    logged = recording(seed=11).winds(0.0)
    held = np.abs(read - logged) <= found.half_width
    assert 0.82 <= held.mean() <= 0.97  # 200 windows, of which neighbours are alike


def test_a_clock_that_is_off_is_found_within_its_uncertainty() -> None:
    found = model(recording(late=0.8, clock=0.5))
    assert found.clock_offset == pytest.approx(0.75, abs=0.3)
    assert model(recording(late=0.0, clock=0.5)).clock_offset == pytest.approx(0.0, abs=0.3)
    exact = model(recording(late=0.8))
    assert (exact.clock_offset, exact.clock_sigma) == (0.0, 0.0)


def test_two_recordings_are_taken_together_and_share_no_neighbours() -> None:
    both = model(recording(seconds=90.0, seed=1), recording(seconds=90.0, seed=2))
    assert len(both.model.winds) == 2 * int(90 / STEP)
    assert {one.kind for one in both.findings} == {"short-calibration", "anemometer-accuracy"}


def test_a_steady_wind_a_short_film_and_a_film_of_something_else_are_refused() -> None:
    own = recording()
    steady = Log(times=own.log.times, speed=np.full(len(own.log.times), 5.0))
    with pytest.raises(RefusedError, match="hardly changes"):
        model(replace(own, log=steady))
    with pytest.raises(InputError, match="a log beside them"):
        model(recording(seconds=20.0))
    unlike = features(gusts(240.0, seed=77), seed=77)
    with pytest.raises(RefusedError, match="as much as their mean would"):
        model(replace(own, features=unlike))


def test_windows_beside_a_silence_of_the_log_are_left_out() -> None:
    own = recording()
    heard = (own.log.times < 50.0) | (own.log.times > 60.0)
    found = model(replace(own, log=Log(times=own.log.times[heard], speed=own.log.speed[heard])))
    # From the last sample before 50 s to the first after 60 s: 12 s, that is ten windows and the
    # part of one more.
    assert len(own.features.starts) - len(found.model.winds) in (10, 11)
    with pytest.raises(InputError, match="a log beside them"):
        model(replace(own, log=Log(times=own.log.times + 1000.0, speed=own.log.speed)))


def test_the_half_width_is_the_conformal_quantile() -> None:
    errors = np.concatenate([np.arange(1.0, 10.0), -np.arange(1.0, 10.0)])
    assert half_width(errors, 0.9) == 9.0  # the 18th of 19
    assert half_width(errors[:5], 0.9) == np.inf


def test_the_mean_of_windows_errs_as_blocks_do() -> None:
    """Errors that are alike within a block of five do not average out within it: σ/√(n/5), not
    σ/√n."""
    errors = np.repeat(_RNG.normal(size=400), 5)
    drawn = mean_errors(
        errors, count=100, length=50, draws=4000, generator=np.random.default_rng(1)
    )
    assert drawn.std() == pytest.approx(errors.std() * np.sqrt(5 / 100), rel=0.1)
