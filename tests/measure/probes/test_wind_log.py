"""What a log of the wind may be off by is a nuisance with a prior, and markers that are missing
correct nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from measure.forecasting import THETA, Calibration, Cut, Forecaster, Segments, library
from measure.forecasting.segments import Segment
from measure.inference import Evidence, NullModel
from measure.probes import Course, Statistics, by_recording, lags, projected_statistics
from measure.probes.wind_log import misread
from measure.trajectories import Trajectory, WindTrack

COLUMNS = (next(c for c in library() if c.name == "lift.coefficient"),)
COUNT = len(THETA) + len(COLUMNS)
LOG = WindTrack(
    times=np.array([0.0, 1.0, 2.0]),
    velocity=np.array([[4.0, 0.0, 0.0], [5.0, 0.0, 0.0], [7.0, 0.0, 0.0]]),
)


def test_a_log_that_lags_shows_what_it_says_later_than_it_was() -> None:
    assert misread(LOG, clock=0.5).at(np.array([0.5]))[0, 0] == pytest.approx(
        LOG.at(np.array([1.0]))[0, 0]
    )


def test_a_wind_turned_to_the_left_keeps_its_speed() -> None:
    turned = misread(LOG, direction=math.pi / 2)
    np.testing.assert_allclose(turned.velocity, [[0, 4, 0], [0, 5, 0], [0, 7, 0]], atol=1e-12)


def test_nuisances_move_their_own_recording_alone() -> None:
    moved = np.arange(1.0, 13.0).reshape(3, 2, 2)
    spread = by_recording(moved, np.array([0, 1, 0]))
    assert spread.shape == (3, 2, 4)
    np.testing.assert_array_equal(spread[0], [[1.0, 2.0, 0.0, 0.0], [3.0, 4.0, 0.0, 0.0]])
    np.testing.assert_array_equal(spread[1], [[0.0, 0.0, 5.0, 6.0], [0.0, 0.0, 7.0, 8.0]])
    np.testing.assert_array_equal(spread[2], [[9.0, 10.0, 0.0, 0.0], [11.0, 12.0, 0.0, 0.0]])


def null() -> NullModel:
    """Of numerics that leave nothing but noise of variance 1."""
    return NullModel(
        coefficients=np.zeros((3, COUNT)), covariance=np.eye(COUNT), shifts=np.zeros((0, COUNT))
    )


def looked_at(forecaster: Forecaster, recording: Trajectory) -> tuple[Statistics, FloatArray]:
    segments = Segments.of([recording])
    found, _ = projected_statistics(forecaster, segments, [Calibration()] * len(segments), COLUMNS)
    return replace(found, turning=None, course=None), np.full(len(segments), 4.0)


@pytest.mark.parametrize(("gain", "turn"), [(0.05, 0.0), (0.0, math.radians(5.0))])
def test_a_wind_that_is_off_within_its_prior_leaves_less_misfit_once_it_may_be(
    forecaster: Forecaster, own_recording: Trajectory, gain: float, turn: float
) -> None:
    off = replace(own_recording, wind=misread(own_recording.wind, gain=gain, direction=turn))
    found, speeds = looked_at(forecaster, off)
    without = Evidence.of(replace(found, log=None), speeds, null()).fit(()).remainder
    assert Evidence.of(found, speeds, null()).fit(()).remainder < 0.5 * without


def test_a_wind_that_is_known_exactly_has_no_nuisance(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    exact = replace(
        own_recording, wind=replace(own_recording.wind, gain=0.0, direction=0.0, clock=0.0)
    )
    found, speeds = looked_at(forecaster, exact)
    without = Evidence.of(replace(found, log=None), speeds, null()).fit(()).remainder
    assert Evidence.of(found, speeds, null()).fit(()).remainder == pytest.approx(without)


def test_missing_markers_correct_nothing_and_leave_the_models_own_errors_small(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    seen = np.random.default_rng(0).random(own_recording.positions.shape[:2]) > 0.1
    segments = Segments.of([replace(own_recording, seen=seen)])
    errors = forecaster.errors(
        *forecaster.system(segments, [Calibration()] * len(segments)), segments
    ).numpy()
    assert segments.counted is not None
    assert not errors[~segments.counted[:, :, None].repeat(3, axis=2)].any()
    # On itself the observer errs by less than 1 mm; it forgets what it did not see within two
    # frames.
    assert np.sqrt((errors**2).sum(axis=2)[segments.counted].mean()) < 1e-3


def test_a_forecast_never_compares_with_what_was_filled_in(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    seen = np.random.default_rng(0).random(own_recording.positions.shape[:2]) > 0.1
    seen[:3] = True  # a start is taken from positions as they are
    wrong = own_recording.positions + 0.3 * ~seen[:, :, None]
    found = []
    for positions in (own_recording.positions, wrong):
        segments = Segments.of([replace(own_recording, seen=seen, positions=positions)]).select([0])
        found.append(
            forecaster.errors(*forecaster.system(segments, [Calibration()]), segments).numpy()
        )
    np.testing.assert_array_equal(found[0], found[1])


@pytest.mark.parametrize("lag", [-0.45, 0.0, 0.3])
def test_the_course_of_a_log_that_lags_gives_the_lag(lag: float) -> None:
    period, count, window = 0.04, 10, 5
    fine = np.arange(-3.0, 16.0, 0.1)
    speed = 5 + 0.7 * np.sin(2 * np.pi * 0.3 * fine) + 0.4 * np.sin(2 * np.pi * 0.17 * fine + 1)
    log = WindTrack(times=fine, velocity=np.stack([speed, 0 * speed, 0 * speed], axis=1))
    cut = Cut(stride=1, period=period, warm=6, length=count * window)
    items = tuple(
        Segment(
            recording=0,
            start=place * 2.0,
            positions=np.zeros((cut.length + 8, 1, 3)),
            wind=log,
            noise=0.0,
        )
        for place in range(4)
    )
    segments = Segments(items=items, markers=np.zeros((1, 2)), cut=cut)
    frames = (segments.first + np.arange(cut.length)) * period
    value = np.zeros((4, count, 3))
    for place, item in enumerate(items):
        times = item.start + frames
        share = log.at(times + lag)[:, 0] / log.at(times)[:, 0] - 1
        value[place, :, 0] = share.reshape(count, window).mean(axis=1)
    value += 0.01 * np.random.default_rng(0).standard_normal(value.shape)
    course = Course(score=50 * value, curvature=np.broadcast_to(50 * np.eye(3), (4, count, 3, 3)))
    # Noise of 1 % in 40 windows against a slope of 25 % a second: known to some 0.01 s.
    assert lags(course, segments) == pytest.approx((lag,), abs=0.03)


def test_a_steady_wind_gives_no_lag(own_recording: Trajectory) -> None:
    segments = Segments.of([own_recording])
    course = Course(
        score=np.ones((len(segments), 10, 3)), curvature=np.ones((len(segments), 10, 3, 3))
    )
    assert lags(course, segments) == (0.0,)
