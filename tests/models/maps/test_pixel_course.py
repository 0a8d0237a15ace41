"""Statistics of a pixel's course in time, against closed forms and the definition of the
spectrum."""

from __future__ import annotations

import math

import pytest
import torch

from flagdata.core.rng import stream
from models.maps.pixel_course import (
    at_rest,
    band_powers,
    centre_and_width,
    fourier_rows,
    log_power,
    shares_of_nyquist,
)
from models.maps.spectral_layer import periodogram

FRAMES = 30


def test_the_rows_give_the_spectrum_of_the_definition() -> None:
    signal = torch.as_tensor(stream(1, "course").normal(size=(FRAMES, 4, 5)) + 3.0).float()
    real, imaginary = fourier_rows(FRAMES) @ signal.flatten(1)
    expected, _ = periodogram(signal[None, None], rate=25.0)
    torch.testing.assert_close(
        (real.square() + imaginary.square()).unflatten(1, (4, 5)),
        expected[0, 0],
        rtol=1e-4,
        atol=1e-5,
    )


@pytest.mark.parametrize("place", [3, 8, 12])
def test_a_sinusoid_has_its_centre_at_its_frequency_and_the_width_of_the_window(place: int) -> None:
    """A Hann window spreads a bin's sinusoid over it and its neighbours by amplitudes of 1 to 1/2,
    powers of 1 to 1/4: of the power 1/6 lies one bin below and 1/6 above, so that the variance is a
    third of a bin's width squared."""
    wave = torch.sin(2 * math.pi * place * torch.arange(FRAMES) / FRAMES)
    power = (fourier_rows(FRAMES) @ wave[:, None]).square().sum(dim=0)[:, :, None]
    share = shares_of_nyquist(power, steps=FRAMES)
    centre, width = centre_and_width(power, share, floor=0.0)
    assert centre.item() == pytest.approx(place / 15, rel=1e-4)
    assert width.item() == pytest.approx(math.sqrt(1 / 3) / 15, rel=1e-3)


def test_bands_that_touch_share_out_all_power() -> None:
    power = torch.as_tensor(stream(2, "course").uniform(size=(2, 15, 3, 3)))
    share = shares_of_nyquist(power, steps=FRAMES)
    low, high = band_powers(power, share, ((0.0, 0.2), (0.2, 1.0)))
    torch.testing.assert_close(
        low, power[:, :3].sum(dim=1)
    )  # 0.2 of the Nyquist frequency is the third of 15 bins
    torch.testing.assert_close(low + high, power.sum(dim=1))


def test_where_nothing_moves_all_is_zero() -> None:
    nothing = torch.zeros(1, 15, 2, 2)
    centre, width = centre_and_width(nothing, shares_of_nyquist(nothing, steps=FRAMES), floor=1e-6)
    for own in (centre, width, log_power(nothing, floor=1e-3)):
        assert not own.any()


def test_the_picture_at_rest_is_its_mean_slope_and_spread() -> None:
    """Brightness 2x + y that swings by ±a has the slope |(2·2, 1·2)| between its neighbours, and
    the spread a."""
    ramp = 2.0 * torch.arange(5)[None, :] + torch.arange(4)[:, None]
    swing = torch.tensor([0.3, -0.3, 0.3, -0.3])
    mean, slope, spread = at_rest(ramp + swing[:, None, None])
    torch.testing.assert_close(mean, ramp)
    torch.testing.assert_close(
        slope[1:-1, 1:-1], torch.full((2, 3), math.log1p(10 * math.hypot(4, 2)))
    )
    torch.testing.assert_close(spread, torch.full((4, 5), math.log1p(3.0)))
