"""Frequency, amplitude and speed of drawn waves, and whether the intervals have their nominal
coverage."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import InputError
from tests.studies.validation.paper_flag.waves import Estimate, waves

RATE = 500.0
X = np.linspace(0, 0.14, 15)
TIME = np.arange(500) / RATE


def travelling(frequency: float, speed: float, *, amplitude: float = 0.03) -> FloatArray:
    """(frame, column) a wave that grows towards the tip and runs there, with a second harmonic of a
    tenth."""
    angle = 2 * np.pi * frequency * (TIME[:, None] - X / speed)
    return (
        amplitude * (0.2 + X / X[-1]) / 1.2 * (np.cos(angle) + 0.1 * np.cos(2 * angle + 1))
        + 0.01 * X
    )


def test_a_travelling_wave_is_measured_through_gaps() -> None:
    heights = travelling(12.3, 4.0) + 1e-4 * stream(1, "noise").standard_normal((len(TIME), len(X)))
    heights[heights < -0.02] = np.nan  # lost in the same part of every cycle, as a fast tip is
    found = waves(TIME, X, heights)
    assert found.frequency.value == pytest.approx(12.3, abs=0.02)
    assert found.amplitude.value == pytest.approx(0.03, rel=0.02)
    assert found.speed.value == pytest.approx(4.0, rel=0.02)
    assert found.explained > 0.999
    assert np.allclose(found.columns, X)


def test_a_motion_is_not_taken_for_its_harmonic_or_half_of_it() -> None:
    assert waves(TIME, X, travelling(20.0, 4.0)).frequency.value == pytest.approx(20, abs=0.02)


def test_a_standing_wave_does_not_travel_and_a_long_travelling_one_does() -> None:
    standing = np.sin(np.pi * X / 0.14) * np.cos(2 * np.pi * 10 * TIME[:, None])
    running = np.cos(
        2 * np.pi * (10 * TIME[:, None] - X / 0.07)
    )  # two wavelengths in view: a circle
    assert waves(TIME, X, standing).travelling < 0.01
    assert waves(TIME, X, running).travelling > 0.9


def test_a_wave_towards_the_clamp_has_a_negative_speed() -> None:
    assert waves(TIME, X, travelling(12.0, -3.0)).speed.value == pytest.approx(-3.0, rel=0.02)


def test_the_interval_of_the_frequency_covers_it_as_often_as_it_says() -> None:
    # The phase does a random walk, as a real flutter's does: each cycle lasts 3 % longer or shorter
    # than the mean.
    draws, held = 60, 0
    x = X[::5]
    for draw in range(draws):
        rng = stream(7, "walk", draw)
        walk = np.cumsum(rng.standard_normal(len(TIME))) * 0.03 * 2 * np.pi / math.sqrt(RATE / 11)
        angle = 2 * np.pi * 11 * TIME + walk
        heights = np.cos(angle[:, None] - 20 * x) + 0.02 * rng.standard_normal((len(TIME), len(x)))
        found = waves(TIME, x, heights, band=(8.0, 15.0), harmonics=1).frequency
        held += found.low <= 11 <= found.high
    # 90 % claimed; of 60 draws fewer than 46 would hold it with a probability of 0.1 % (binomial).
    assert held >= 46


def test_noise_alone_gives_no_interval_that_pretends() -> None:
    noise = stream(2, "noise").standard_normal((len(TIME), len(X)))
    assert waves(TIME, X, noise, band=(8.0, 15.0)).explained < 0.1


def test_two_modes_hold_a_travelling_wave() -> None:
    assert waves(
        TIME, X, np.cos(2 * np.pi * (10 * TIME[:, None] - X / 0.1))
    ).two_modes == pytest.approx(1, abs=1e-9)


def test_too_few_cycles_and_too_few_columns_are_refused() -> None:
    with pytest.raises(InputError, match="cycles"):
        waves(TIME[:100], X, travelling(11.0, 4.0)[:100], band=(8.0, 15.0))
    with pytest.raises(InputError, match="columns"):
        waves(TIME, X, np.full((len(TIME), len(X)), np.nan))


def test_an_estimate_changes_unit_with_its_interval() -> None:
    found = Estimate(value=2.0, error=0.5, low=1.0, high=3.0, count=5).scaled(10)
    assert (found.value, found.error, found.low, found.high, found.count) == (20, 5, 10, 30, 5)
    assert (
        Estimate(value=1.0, error=math.nan, low=math.nan, high=math.nan, count=1).as_dict()["low"]
        is None
    )
