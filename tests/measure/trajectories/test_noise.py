"""The noise that is estimated is the noise that was added."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.trajectories.experiment import estimate, stencils
from tests.measure.trajectories.flags import flag


@pytest.mark.parametrize("sigma", [0.5e-3, 1e-3, 4e-3])
def test_white_noise_on_a_smooth_motion_is_estimated_within_a_tenth(sigma: float):
    seen = flag(noise=sigma, seed=11)
    assert estimate(seen.markers, seen.positions, where="") == pytest.approx(sigma, rel=0.1)


def test_the_estimate_scales_with_the_data_and_ignores_where_they_are():
    seen = flag(noise=1e-3, seed=3)
    once = estimate(seen.markers, seen.positions, where="")
    assert estimate(seen.markers, 7.0 * seen.positions + 100.0, where="") == pytest.approx(
        7.0 * once, rel=1e-6
    )


def test_without_noise_little_is_left():
    seen = flag()
    # A 1.5 Hz wave with harmonics, 60 markers, 50 frames a second: nothing above a tenth of a
    # millimetre.
    assert estimate(seen.markers, seen.positions, where="") < 1e-4


def test_lost_positions_do_not_change_the_estimate_much():
    seen = flag(noise=1e-3, seed=4)
    positions = np.array(seen.positions)
    positions[np.random.default_rng(0).random(positions.shape[:2]) < 0.05] = np.nan
    assert estimate(seen.markers, positions, where="") == pytest.approx(1e-3, rel=0.15)


def test_departures_from_a_polynomial_vanish_on_it():
    markers = flag().markers
    u, v = markers.T
    quadratic = (1 + 2 * u - v + 3 * u * v - u**2)[None, :, None] * np.ones(3)
    fits = stencils(markers, 2)
    assert fits is not None
    np.testing.assert_allclose(fits.of(quadratic), 0.0, atol=1e-12)


def test_two_frames_are_too_few():
    seen = flag()
    with pytest.raises(InputError, match="too few values"):
        estimate(
            seen.markers,
            replace(seen, positions=seen.positions[:2], times=seen.times[:2]).positions,
            where="",
        )
