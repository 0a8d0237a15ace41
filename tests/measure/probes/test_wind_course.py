"""The wind's course, inferred from errors: found where it was, called turbulence where it may
be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import UsageError
from measure.forecasting import Calibration, EffectColumn, Forecaster, Segments, winds
from measure.probes import ALONG, LEFT, Course, Statistics, error_scale, projected_statistics
from measure.probes.statistics import statistics
from measure.probes.wind_course import Gauge
from measure.trajectories import Trajectory, WindTrack
from sim.wind import VonKarman

COLUMNS = (EffectColumn(effect="lift", parameter="coefficient", step=0.3),)
RECORDINGS, SEGMENTS, WINDOWS, FRAMES = 3, 4, 10, 5
RECORDING = np.repeat(np.arange(RECORDINGS), SEGMENTS)
SIZE = 1e3
"""h of a window: a wind that is a tenth stronger moves a window's markers by √10 of their
errors."""
SWAY, OMEGA = 0.05, 2 * np.pi / 1.6
"""Of a wind that was not logged: a share of the mean one, and rad/s."""


def seen(parts: FloatArray, *, noise: float = 0.0, seed: int = 0) -> Course:
    """What a wind of parts (recording · segment, window, part) leaves, beside noise in units of the
    errors."""
    eye = np.broadcast_to(SIZE * np.eye(3), (*parts.shape, 3))
    drawn = noise * SIZE**0.5 * stream(seed, "course").normal(size=parts.shape)
    return Course(score=SIZE * parts + drawn, curvature=eye)


def turbulence(
    speed: float, length: float, *, left: float = 0.78, up: float = 0.52, seed: int = 0
) -> FloatArray:
    """Of an intensity of 0.2, across and upward with half the length, as in `Gusts`."""
    rng, count = stream(seed, "turbulence"), SEGMENTS * WINDOWS * FRAMES
    parts = []
    for share, scale in ((1.0, length), (left, length / 2), (up, length / 2)):
        own = VonKarman(mean=speed, intensity=0.2, length=scale)
        series = [
            own.series(rng, duration=count * 0.04 + 1, rate=25.0)[:count] for _ in range(RECORDINGS)
        ]
        parts.append(share * (np.stack(series) - speed) / speed)
    return np.stack(parts, axis=-1).reshape(RECORDINGS * SEGMENTS, WINDOWS, FRAMES, 3).mean(axis=2)


def pulses(period: float = 3.7, width: float = 0.5) -> FloatArray:
    """A wind that is weaker for half a second, again and again, from wherever it comes."""
    time = np.arange(SEGMENTS * WINDOWS) * FRAMES * 0.04
    made = np.zeros((RECORDINGS, len(time), 3))
    for recording, phase in enumerate((0.3, 1.7, 2.9)):
        made[recording, :, ALONG] = -0.5 * np.exp(
            -0.5 * (((time + phase) % period - period / 2) / (width / 2)) ** 2
        )
    return made.reshape(RECORDINGS * SEGMENTS, WINDOWS, 3)


@pytest.mark.parametrize("speed", [4.0, 8.0])
@pytest.mark.parametrize("length", [10.0, 60.0])
def test_turbulence_is_taken_for_it(speed: float, length: float) -> None:
    found = [
        seen(turbulence(speed, length, seed=seed), noise=1.0, seed=seed)
        .variation(RECORDING)
        .turbulent
        for seed in range(60)
    ]
    # 1 % and 1 % are not, by their course (docstring of `course`): of 60, P(more than 5) is 0.1 %.
    assert sum(found) >= 55


def test_a_wind_of_pulses_is_not_turbulence() -> None:
    # Half a second of every 3.7 s, by whatever phase: in 2 s there is one or none.
    found = seen(pulses(), noise=1.0).variation(RECORDING)
    assert found.total[ALONG] > 0.005
    assert not found.turbulent
    # Nor is it with the other parts of turbulence: it is too fast.
    fast = pulses()
    fast[..., 1:] = 0.6 * fast[..., :1]
    along = seen(fast, noise=1.0).variation(RECORDING)
    assert not along.turbulent
    assert "faster" in along.words


def test_a_pressure_that_varies_alone_is_not_turbulence() -> None:
    found = [
        seen(turbulence(5.0, 60.0, left=0.0, up=0.0, seed=seed), noise=1.0, seed=seed).variation(
            RECORDING
        )
        for seed in range(40)
    ]
    # Noise alone makes a part of it seem to vary, by chance: seldom by so much.
    assert sum(v.turbulent for v in found) <= 2
    assert all(
        "varies across its mean by" in v.words
        for v in found
        if not v.turbulent and v.fast[ALONG] < v.total[ALONG] / 2
    )


@pytest.mark.parametrize(
    ("size", "turned", "least", "most"), [(0.25, 0.2, 0, 2), (1.0, 0.2, 0, 2), (2.0, 0.0, 32, 40)]
)
def test_a_wind_varies_along_itself_alone_only_where_chance_cannot_hide_that_it_turns(
    size: float, turned: float, least: int, most: int
) -> None:
    """Of an intensity of 0.05, 0.2 or 0.4. Obstacles turn the wind by 0.15 to 0.23 of what they do
    along it; at the bound of 0.15 two of 40 pass on the average, since its interval is of 95 % on
    one side, and at 0.2 fewer."""
    found = [
        seen(
            size * turbulence(5.0, 60.0, left=turned, up=0.0, seed=seed), noise=1.0, seed=seed
        ).variation(RECORDING)
        for seed in range(40)
    ]
    assert least <= sum(v.alone for v in found) <= most


def test_variances_are_the_winds_and_noise_adds_nothing_to_them() -> None:
    parts = turbulence(5.0, 60.0, seed=3)
    about = parts - parts.reshape(RECORDINGS, -1, 3).mean(axis=1).repeat(SEGMENTS, axis=0)[:, None]
    neighbours = (about[:, 1:] * about[:, :-1]).mean(axis=(0, 1))
    np.testing.assert_allclose(seen(parts).variation(RECORDING).total, neighbours, rtol=1e-12)
    noisy = np.mean(
        [seen(parts, noise=1.0, seed=seed).variation(RECORDING).total for seed in range(200)],
        axis=0,
    )
    # Of noise of variance 1/h, products of neighbours have −1/(h N) of the N windows of a
    # recording, for its mean.
    np.testing.assert_allclose(
        noisy, neighbours - 1 / SIZE / SEGMENTS / WINDOWS, rtol=0.03, atol=5e-6
    )


def test_a_steady_wind_that_differs_from_the_logged_one_does_not_swing() -> None:
    steady = np.broadcast_to(0.3 * np.arange(1, 4), (RECORDINGS * SEGMENTS, WINDOWS, 3)).copy()
    steady[RECORDING == 1] *= 2  # by as much as it likes from one recording to another
    np.testing.assert_allclose(seen(steady).swing(RECORDING), 0.0, atol=1e-9)


def test_errors_that_are_larger_all_over_swing_no_more() -> None:
    parts = turbulence(5.0, 60.0)
    twice = replace(
        seen(parts), score=SIZE / 4 * parts, curvature=seen(parts).curvature / 4
    )  # over twice the scale
    np.testing.assert_allclose(
        twice.variation(RECORDING).total, seen(parts).variation(RECORDING).total, rtol=1e-12
    )
    np.testing.assert_allclose(twice.swing(RECORDING), seen(parts).swing(RECORDING) / 4, rtol=1e-12)


@pytest.fixture(scope="module")
def gusty(own_recording: Trajectory) -> Segments:
    """The cloth in a steady wind, declared weaker by a share c: errors as of gusts c."""
    times = np.arange(120) / own_recording.rate
    logged = np.stack([4.0 * (1 - SWAY * np.sin(OMEGA * times)), 0 * times, 0 * times], axis=1)
    return Segments.of([replace(own_recording, wind=WindTrack(times=times, velocity=logged))])


def test_a_gauge_recovers_the_course_of_a_wind_that_was_not_logged(
    forecaster: Forecaster, gusty: Segments
) -> None:
    segments = gusty
    nominal = [Calibration()] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    scale = torch.ones(base.shape[1], base.shape[3], dtype=base.dtype)
    changes = [forecaster.sensitivity(wind, segments, nominal, base) for wind in winds()]
    gauge = Gauge.of(changes, scale, period=segments.period)
    gauged = gauge.course(base.permute(3, 0, 1, 2).flatten(2))
    value = np.linalg.solve(gauged.curvature, gauged.score[..., None])[..., 0]
    starts = np.array([item.start for item in segments.items]) + segments.first * segments.period
    middles = starts[:, None] + (np.arange(value.shape[1]) + 0.5) * gauge.window * segments.period
    phase = OMEGA * middles.ravel()
    waves = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    (sine, cosine), *_ = np.linalg.lstsq(waves, value[..., ALONG].ravel(), rcond=None)
    # The mean of a sine over a window, and an observer's delay: by two frames or so.
    mean = np.sinc(OMEGA * gauge.window * segments.period / 2 / np.pi)
    assert np.hypot(sine, cosine) == pytest.approx(SWAY * mean, rel=0.1)
    assert 0 < -np.arctan2(cosine, sine) / OMEGA < 3 * segments.period
    assert np.abs(value[..., LEFT]).max() < SWAY / 4


def test_kept_directions_say_of_the_base_model_what_the_statistics_say(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    nominal = [Calibration(area_weight=1.1)] * len(segments)
    found, projection = projected_statistics(forecaster, segments, nominal, COLUMNS)
    errors = forecaster.errors(*forecaster.system(segments, nominal), segments)
    kept, own = projection.course(errors), found.course
    assert kept is not None
    assert own is not None
    np.testing.assert_allclose(kept.score, own.score, rtol=1e-9, atol=1e-12)
    alone = statistics(forecaster, segments, nominal, COLUMNS).course
    assert alone is not None
    np.testing.assert_array_equal(alone.curvature, own.curvature)
    # By twice the scale, half the score.
    changes = [forecaster.sensitivity(wind, segments, nominal, errors) for wind in winds()]
    scale = error_scale(errors, segments.recording, segments.noise)
    twice = Gauge.of(changes, 2 * scale, period=segments.period)
    assert projection.gauge is not None
    torch.testing.assert_close(twice.moved, projection.gauge.moved / 2)


def test_courses_of_some_parts_alone_are_refused(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    own = statistics(forecaster, segments, [Calibration()] * len(segments), COLUMNS)
    assert own.course is not None
    both = Statistics.joined([own, own]).course
    assert both is not None
    assert both.score.shape[0] == 2 * len(segments)
    np.testing.assert_array_equal(own.select(np.array([0])).recording, own.recording[:1])
    with pytest.raises(UsageError, match="only some parts have course"):
        Statistics.joined([own, replace(own, course=None)])
