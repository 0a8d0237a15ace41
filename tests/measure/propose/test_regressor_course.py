"""A line in the course of an amplitude is found at its frequency; noise shows lines no more often
than it says."""

from __future__ import annotations

import numpy as np
import pytest

from measure.propose.regressor_course import line

PERIOD = 0.04


def test_a_sine_in_noise_is_found_at_its_frequency() -> None:
    """Of variance 1/2 beside 1: a third of the variance."""
    times = np.arange(200) * PERIOD
    noise = np.random.default_rng(1).standard_normal(200)
    found = line(np.sin(2 * np.pi * 4.375 * times) + noise, PERIOD)  # 35 periods in 8 s
    assert found.frequency == pytest.approx(4.375)
    assert found.share == pytest.approx(1 / 3, abs=0.1)
    assert found.p_value < 1e-6


def test_white_noise_shows_rare_lines_as_rarely_as_they_say() -> None:
    rng = np.random.default_rng(2)
    values = np.array([line(rng.standard_normal(200), PERIOD).p_value for _ in range(1000)])
    for level in (0.01, 0.1, 0.5):
        # Three standard deviations of a share of 1000.
        assert (values <= level).mean() == pytest.approx(
            level, abs=3 * np.sqrt(level * (1 - level) / 1000)
        )


def test_a_trend_is_no_line() -> None:
    found = line(np.linspace(0, 1, 200), PERIOD)
    assert found.frequency >= 3 / (200 * PERIOD)
