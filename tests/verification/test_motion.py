"""Summaries of motion against motions whose numbers are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.errors import UsageError
from tests.verification.motion import edge_motion

RATE = 100.0


def test_a_sinusoid_has_its_frequency_and_mean_speed() -> None:
    # x = A sin(2π f t): mean |v| = 4 A f, root mean square frequency f. Differences of frames: f sinc(f/rate), 0.04 %.
    amplitude, frequency = 0.3, 1.5
    time = np.arange(1000) / RATE  # fifteen whole periods
    track = np.zeros((len(time), 2, 3))
    track[:, :, 1] = 5.0 + amplitude * np.sin(2 * math.pi * frequency * time)[:, None]
    motion = edge_motion(track, rate=RATE)
    assert motion.frequency == pytest.approx(frequency, rel=2e-3)
    assert motion.speed == pytest.approx(4 * amplitude * frequency, rel=2e-3)
    np.testing.assert_allclose(motion.position, [0, 5, 0], atol=1e-12)


def test_of_two_sinusoids_the_frequency_is_their_root_mean_square() -> None:
    time = np.arange(2000) / RATE
    track = np.zeros((len(time), 1, 3))
    track[:, 0, 0] = np.sin(2 * math.pi * time) + np.sin(2 * math.pi * 3 * time)
    assert edge_motion(track, rate=RATE).frequency == pytest.approx(
        math.sqrt((1 + 9) / 2), rel=5e-3
    )


def test_what_stands_still_has_no_frequency_and_one_frame_is_refused() -> None:
    still = np.ones((10, 4, 3))
    assert edge_motion(still, rate=RATE).frequency == 0.0
    assert edge_motion(still, rate=RATE).speed == 0.0
    with pytest.raises(UsageError, match="two frames"):
        edge_motion(still[:1], rate=RATE)
