"""How the attachments of nulls go: along the data's ways, from other instants on, without the noise
of the markers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from measure.nulls import SETTLE, tracks
from measure.nulls.null_simulation import CARRIED
from measure.trajectories import Trajectory, WindTrack, carry_attachments

RATE, SECONDS, FAR, FREQUENCY = 25.0, 8.0, 0.15, 0.7
MARKERS = np.array([[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.4, 0.4]])
SEATS = MARKERS[2:]


def swinging(noise: float = 0.0, *, name: str = "swung", height: float = 0.0) -> Trajectory:
    """A plane upright cloth that goes to and fro along y, FAR sin 2πft, and rises by 1 cm/s."""
    times = np.arange(round(SECONDS * RATE) + 1) / RATE
    places = np.zeros((len(times), 4, 3))
    places[:, :, 0], places[:, :, 2] = MARKERS[:, 0], MARKERS[:, 1] + height + 0.01 * times[:, None]
    places[:, :, 1] = FAR * np.sin(2 * math.pi * FREQUENCY * times)[:, None]
    places += noise * np.random.default_rng(3).standard_normal(places.shape)
    still = WindTrack.constant((0.0, 0.0, 0.0))
    plain = Trajectory(
        name=name, markers=MARKERS, positions=places, rate=RATE, wind=still, noise=noise
    )
    return carry_attachments(plain, SEATS)


def velocity(places: FloatArray) -> FloatArray:
    return np.diff(places, axis=0) / CARRIED


def test_nulls_of_a_cloth_held_still_are_held_still() -> None:
    one = swinging()
    held = Trajectory(
        name="held", markers=MARKERS, positions=one.positions, rate=RATE, wind=one.wind
    )
    assert tracks.like([held], SEATS, 4, duration=5.0, seed=1) == ()


def test_a_way_is_that_of_the_recording_or_its_reverse_where_it_does_not_turn() -> None:
    """Its height says at which instant of the recording it is, which goes by at one second a second
    for most of it."""
    for made in tracks.like([swinging()], SEATS, 6, duration=20.0, seed=1):
        assert made.times[0] == -SETTLE
        assert made.times[-1] >= 20.0
        instant = (made.places[:, 0, 2] - SEATS[0, 1]) / 0.01
        assert instant.min() >= -1e-6
        assert instant.max() <= SECONDS + 1e-6
        np.testing.assert_allclose(
            made.places[:, 0, 1], FAR * np.sin(2 * math.pi * FREQUENCY * instant), rtol=0, atol=1e-4
        )
        pace = np.abs(np.diff(instant)) / CARRIED
        assert pace.max() <= 1.01
        # A turn of a second for each 8 s, at whose ends the pace is again one.
        assert (pace > 0.99).mean() > 0.8


def test_a_way_turns_back_without_a_jump_of_its_velocity() -> None:
    """At the ends of 8 s at 0.7 Hz the cloth moves at up to 2πf · FAR = 0.66 m/s; turned in a
    second, that changes by 1.3 m/s², beside (2πf)² · FAR = 2.9 m/s² of the swing itself."""
    size = 2 * math.pi * FREQUENCY
    for made in tracks.like([swinging()], SEATS, 6, duration=30.0, seed=2):
        change = np.diff(velocity(made.places), axis=0) / CARRIED
        assert np.abs(change).max() < 1.1 * (size**2 * FAR + 2 * size * FAR)


def test_noise_is_taken_out_of_a_way_and_motion_is_not() -> None:
    noise = 2e-3
    tracked, plain = swinging(noise), swinging()
    assert tracked.attachments is not None
    assert plain.attachments is not None
    made = tracks.smooth_way(tracked, SEATS)(tracked.times)
    off, before = made - plain.attachments, tracked.attachments - plain.attachments
    assert np.sqrt((before**2).mean()) == pytest.approx(noise, rel=0.05)
    # 25 frames a second of a swing of 0.7 Hz: a smooth way through them has some five coefficients
    # a second and axis.
    assert np.sqrt((off**2).mean()) < 0.6 * noise
    # What is taken out is as large as the noise, by definition of the way.
    assert np.sqrt(((made - tracked.attachments) ** 2).mean()) == pytest.approx(noise, rel=0.01)
    exact = tracks.smooth_way(plain, SEATS)
    np.testing.assert_allclose(exact(plain.times), plain.attachments, rtol=0, atol=1e-12)


def test_ways_are_drawn_from_all_recordings_and_a_seed_gives_the_same() -> None:
    data = [swinging(), swinging(name="high", height=1.0)]
    first, again, other = (
        tracks.like(data, SEATS, 12, duration=3.0, seed=seed) for seed in (1, 1, 2)
    )
    for one, same in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.places, same.places)
    assert any(
        not np.array_equal(one.places, than.places) for one, than in zip(first, other, strict=True)
    )
    assert {round(float(one.places[0, 0, 2] - SEATS[0, 1])) for one in first} == {0, 1}
