"""Winds of nulls: steady where the data's are, else the data's logs, begun elsewhere and brought to
another speed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from measure.nulls import SETTLE, winds
from measure.trajectories import Trajectory, WindTrack

SPEEDS = (3.0, 4.5, 6.0, 7.5)  # m/s
DURATION = 6.0  # s


def recording(speed: float, *, share: float, along: float = 0.0) -> Trajectory:
    """12 s in U (1 + s sin 2πt/3 s), in a direction of the ground [rad]: no mean but U, and s/√2 of
    fluctuation."""
    times = np.arange(0.0, 14.0, 0.05)
    size = speed * (1 + share * np.sin(2 * math.pi * times / 3))
    return Trajectory(
        name=f"{speed}",
        markers=np.zeros((1, 2)),
        positions=np.zeros((301, 1, 3)),
        rate=25.0,
        wind=WindTrack(
            times=times, velocity=np.outer(size, [math.cos(along), math.sin(along), 0.0])
        ),
    )


def test_nulls_of_steady_data_have_no_winds_of_their_own() -> None:
    steady = [recording(4.0, share=0.0), recording(6.0, share=1e-5)]
    assert winds.like(steady, SPEEDS, duration=DURATION, seed=1) == ()


def test_still_air_beside_a_gusty_wind_lends_nulls_no_course() -> None:
    gusty = recording(4.0, share=0.2)
    for still in (recording(0.0, share=0.0), recording(0.01, share=0.5)):
        for seed in range(4):
            made = winds.like([still, gusty], SPEEDS, duration=DURATION, seed=seed)
            means = [np.linalg.norm(wind.velocity, axis=1).mean() for wind in made]
            np.testing.assert_allclose(means, SPEEDS, rtol=0.05)
        assert winds.like([still], SPEEDS, duration=DURATION, seed=1) == ()


def test_nulls_fluctuate_as_the_logs_do_at_their_own_speeds() -> None:
    made = winds.like([recording(4.0, share=0.2)], SPEEDS, duration=DURATION, seed=1)
    for speed, wind in zip(SPEEDS, made, strict=True):
        assert wind.times[0] == -SETTLE
        assert wind.times[-1] >= DURATION
        size = np.linalg.norm(wind.velocity, axis=1)
        # nine seconds are three periods where the log is not turned back, and nearly so where it is
        assert size.mean() == pytest.approx(speed, rel=0.05)
        assert size.std() / size.mean() == pytest.approx(0.2 / math.sqrt(2), rel=0.15)
        assert size.max() <= 1.2 * speed * 1.001


def test_a_log_that_is_too_short_goes_on_without_a_jump() -> None:
    """Turned back at its ends, the wind changes by no more between samples than the log does: U s
    2π/3 s · 0.05 s."""
    made = winds.like([recording(4.0, share=0.2)], SPEEDS, duration=60.0, seed=3)
    for speed, wind in zip(SPEEDS, made, strict=True):
        steps = np.linalg.norm(np.diff(wind.velocity, axis=0), axis=1)
        assert steps.max() <= speed * 0.2 * 2 * math.pi / 3 * 0.05 * 1.01


def test_each_begins_at_an_instant_of_its_own_and_a_seed_gives_the_same() -> None:
    data = [recording(4.0, share=0.2), recording(6.0, share=0.1, along=0.5)]
    first, again, other = (
        winds.like(data, SPEEDS * 3, duration=DURATION, seed=seed) for seed in (1, 1, 2)
    )
    for one, same in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.velocity, same.velocity)
    assert any(
        not np.array_equal(one.velocity, than.velocity)
        for one, than in zip(first, other, strict=True)
    )
    shapes = {
        np.round(one.velocity[0] / np.linalg.norm(one.velocity, axis=1).mean(), 6).tobytes()
        for one in first
    }
    assert len(shapes) == len(first)
    directions = {round(math.atan2(one.velocity[0, 1], one.velocity[0, 0]), 6) for one in first}
    assert directions == {0.0, 0.5}
